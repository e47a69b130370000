//! Cone maps against brute force, against samples of the bilinear surface, and in use.

#![allow(clippy::unwrap_used, clippy::panic)]

mod cone_maps;

use bake::{BakeError, ConeMode, Progress, cone_map, relaxed_cone_map};
use cone_maps::{Random, from_fn, height, maps, noise, of, waves};
use heightfield::{HeightField, Wrap};

/// The cones of all texels: a double loop in `f64` over all texels and their images.
fn brute_force(field: &HeightField) -> Vec<f64> {
    let (w, h) = (field.width() as i64, field.height() as i64);
    let reach = |n: i64| if field.wrap() == Wrap::Clamp { 0..n } else { -2 * n..3 * n };
    let mut map = Vec::new();
    for j in 0..h {
        for i in 0..w {
            let mut best = 1.0_f64;
            for y in reach(h) {
                for x in reach(w) {
                    let rise = f64::from(field.texel(x, y)) - f64::from(field.texel(i, j));
                    if rise > 0.0 {
                        let away = ((x - i) as f64 / w as f64).hypot((y - j) as f64 / h as f64);
                        best = best.min(away / rise);
                    }
                }
            }
            map.push(best);
        }
    }
    map
}

fn cones(field: &HeightField, mode: ConeMode) -> Vec<f32> {
    cone_map(field, mode, Progress::none()).unwrap()
}

#[test]
fn texel_mode_is_the_textbook_definition() {
    for (w, h) in [(21, 13), (16, 16), (1, 9), (7, 1), (1, 1)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for (name, field) in maps(w, h, wrap) {
                let found = cones(&field, ConeMode::Texel);
                for (at, (found, expected)) in found.iter().zip(brute_force(&field)).enumerate() {
                    let error = f64::from(*found) - expected;
                    assert!(
                        (-1e-6..=0.0).contains(&error),
                        "{name} {w}x{h} {wrap:?} {at}: {found}, {expected}"
                    );
                }
            }
        }
    }
}

/// Points of the plane: texels' corners, where the surface has its peaks, and any others.
fn targets(field: &HeightField, random: &mut Random) -> Vec<[f64; 2]> {
    let (w, h) = (field.width(), field.height());
    let mut points = Vec::new();
    for j in -(h as i64)..2 * h as i64 {
        for i in -(w as i64)..2 * w as i64 {
            points.push([(i as f64 + 0.5) / w as f64, (j as f64 + 0.5) / h as f64]);
        }
    }
    points.extend((0..1000).map(|_| [random.range(-1.0, 2.0), random.range(-1.0, 2.0)]));
    points
}

#[test]
fn cones_are_empty_over_every_point_around_the_texel() {
    for (w, h) in [(13, 9), (1, 8), (6, 1)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for (name, field) in maps(w, h, wrap) {
                let mut random = Random(5);
                let targets = targets(&field, &mut random);
                let map = cones(&field, ConeMode::Conservative);
                for (at, &ratio) in map.iter().enumerate() {
                    let ratio = f64::from(ratio);
                    assert!(ratio > 0.0 && ratio <= 1.0);
                    for _ in 0..2 {
                        let near = |i: usize, n: usize, r: f64| (i as f64 + 0.5 + r) / n as f64;
                        let x = [
                            near(at % w, w, random.range(-1.0, 1.0)),
                            near(at / w, h, random.range(-1.0, 1.0)),
                        ];
                        let low = height(&field, x);
                        let close = (0..200).map(|_| {
                            let reach = 2.0_f64.powf(random.range(-12.0, 2.0));
                            let turn = random.range(0.0, std::f64::consts::TAU);
                            [x[0] + reach * turn.cos() / w as f64, x[1] + reach * turn.sin() / h as f64]
                        });
                        let close: Vec<_> = close.collect();
                        for y in close.iter().chain(&targets) {
                            let depth = height(&field, *y) - low - (y[0] - x[0]).hypot(y[1] - x[1]) / ratio;
                            assert!(
                                depth <= 1e-6,
                                "{name} {w}x{h} {wrap:?}: {depth} inside at {at}, {x:?} {y:?}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn textbook_cones_cut_the_surface_and_the_check_sees_it() {
    let field = noise(17, 12, Wrap::Repeat, 7);
    let mut random = Random(1);
    let map = cones(&field, ConeMode::Texel);
    let cut = (0..2000)
        .filter(|_| {
            let x = [random.range(0.0, 1.0), random.range(0.0, 1.0)];
            let ratio = f64::from(of(&field, &map).sample(x[0] as f32, x[1] as f32));
            (0..200).any(|_| {
                let reach = random.range(0.0, 3.0);
                let turn = random.range(0.0, std::f64::consts::TAU);
                let y = [x[0] + reach * turn.cos() / 17.0, x[1] + reach * turn.sin() / 12.0];
                height(&field, y) - height(&field, x) > (y[0] - x[0]).hypot(y[1] - x[1]) / ratio + 1e-3
            })
        })
        .count();
    assert!(cut > 200, "{cut} of 2000");
}

fn relaxed(field: &HeightField, mode: ConeMode) -> Vec<f32> {
    relaxed_cone_map(field, mode, Progress::none()).unwrap()
}

/// How far above the surface a ray comes out again inside the cone, after it was below.
fn pierced_twice(field: &HeightField, x: [f64; 2], ratio: f64, random: &mut Random) -> f64 {
    let low = height(field, x);
    let (turn, start) = (random.range(0.0, std::f64::consts::TAU), random.range(low, 1.0));
    // Level, or falling by up to 100 heights a tile.
    let fall = if random.next() < 0.2 { 0.0 } else { 10.0_f64.powf(random.range(-2.0, 2.0)) };
    let reach = (start - low) / (1.0 / ratio + fall);
    let (mut deepest, mut out) = (0.0_f64, 0.0_f64);
    for k in 1..150 {
        let away = reach * f64::from(k) / 150.0;
        let y = [x[0] + away * turn.cos(), x[1] + away * turn.sin()];
        let gap = start - fall * away - height(field, y);
        deepest = deepest.min(gap);
        if deepest < -1e-6 {
            out = out.max(gap);
        }
    }
    out
}

#[test]
fn relaxed_cones_are_pierced_at_most_once() {
    let mut twice = 0;
    for (w, h) in [(24, 15), (1, 12), (9, 1)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            for (name, field) in maps(w, h, wrap) {
                let mut random = Random(3);
                let (map, published) =
                    (relaxed(&field, ConeMode::Conservative), relaxed(&field, ConeMode::Texel));
                let published = of(&field, &published);
                let empty = cones(&field, ConeMode::Conservative);
                for (at, &ratio) in map.iter().enumerate() {
                    assert!(ratio >= empty[at] && ratio <= 1.0, "{name} {w}x{h} {wrap:?} {at}: narrower");
                    for _ in 0..6 {
                        let x = [
                            ((at % w) as f64 + 0.5 + random.range(-1.0, 1.0)) / w as f64,
                            ((at / w) as f64 + 0.5 + random.range(-1.0, 1.0)) / h as f64,
                        ];
                        let out = pierced_twice(&field, x, f64::from(ratio), &mut random);
                        assert!(out <= 1e-6, "{name} {w}x{h} {wrap:?} {at}: out by {out}");
                        let textbook = f64::from(published.sample(x[0] as f32, x[1] as f32));
                        twice += usize::from(pierced_twice(&field, x, textbook, &mut random) > 1e-3);
                    }
                }
            }
        }
    }
    assert!(twice > 100, "the check sees only {twice} textbook cones pierced twice");
}

#[test]
fn relaxed_cones_are_wider_on_smooth_slopes() {
    let field = waves(64, 64, Wrap::Repeat);
    let (empty, wide) = (cones(&field, ConeMode::Conservative), relaxed(&field, ConeMode::Conservative));
    let wider = empty.iter().zip(&wide).filter(|(empty, wide)| **wide > 1.2 * **empty).count();
    assert!(wider > 400, "{wider} of 4096 are wider by a fifth");
}

/// The steepest rise from around a texel to where the surface falls outwards, among points half a texel apart;
/// those on borders between cells count a little farther out.
///
/// Past the border of a clamped map the surface is level across it, so that on a way straight to the border the least turn
/// aside decides whether it falls there: those ways are looked at as well, turned by next to nothing.
fn falling(field: &HeightField, [i, j]: [i64; 2]) -> f64 {
    let size = [field.width() as i64, field.height() as i64];
    let half = size.map(|n| 0.5 / n as f64);
    let place = |at: [i64; 2]| [at[0] as f64 * half[0], at[1] as f64 * half[1]];
    let middle = [i, j].map(|at| 2 * at + 1);
    let from: Vec<_> = (0..25).map(|k| place([middle[0] + k % 5 - 2, middle[1] + k / 5 - 2])).collect();
    let mut steepest = 1.0_f64;
    let mut look = |x: [f64; 2], low: f64, y: [f64; 2], high: f64| {
        let (u, v, rise) = (y[0] - x[0], y[1] - x[1], high - low);
        if rise > 0.0 && rise * rise > steepest * steepest * (u * u + v * v) {
            let away = u.hypot(v);
            let behind = [y[0] + 1e-6 * u / away, y[1] + 1e-6 * v / away];
            if height(field, behind) < high {
                steepest = rise / away;
            }
        }
    };
    if field.wrap() == Wrap::Clamp {
        for &x in &from {
            for (axis, border) in [(0, half[0]), (0, 1.0 - half[0]), (1, half[1]), (1, 1.0 - half[1])] {
                for aside in [-1e-4, 1e-4] {
                    let mut y = x;
                    y[axis] = border;
                    y[1 - axis] += aside * half[1 - axis];
                    look(x, height(field, x), y, height(field, y));
                }
            }
        }
    }
    let from: Vec<_> = from.into_iter().map(|x| (x, height(field, x))).collect();
    // In half texels: all of a clamped map, and more than half a period of the others.
    let reach = size.map(|n| if field.wrap() == Wrap::Clamp { 2 * n } else { n * 3 / 2 });
    for b in middle[1] - reach[1]..=middle[1] + reach[1] {
        for a in middle[0] - reach[0]..=middle[0] + reach[0] {
            let y = place([a, b]);
            let high = height(field, y);
            from.iter().for_each(|&(x, low)| look(x, low, y, high));
        }
    }
    steepest
}

#[test]
fn relaxed_cones_are_nearly_as_wide_as_they_may_be_on_smooth_ground() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        let (w, h) = (200, 150);
        let field = waves(w, h, wrap);
        let map = relaxed(&field, ConeMode::Conservative);
        let mut narrower: Vec<f64> = (0..16)
            .map(|k| {
                let at = k * 7919 % (w * h);
                let widest = 1.0 / falling(&field, [(at % w) as i64, (at / w) as i64]);
                let ratio = f64::from(map[at]);
                assert!(ratio <= widest * (1.0 + 1e-6), "{wrap:?} {at}: {ratio} may be {widest}");
                1.0 - ratio / widest
            })
            .collect();
        narrower.sort_by(f64::total_cmp);
        println!("{wrap:?}: narrower by {narrower:.4?}");
        // One of these texels lies five from a clamped border, beyond which nothing falls but along it: 5.9 %.
        let most = if wrap == Wrap::Clamp { 0.06 } else { 0.04 };
        assert!(narrower[8] < 0.01 && narrower[14] < 0.04 && narrower[15] < most, "{wrap:?}");
    }
}

/// The published construction for one texel: from over it down through each other texel to the floor, in 128
/// equal parts behind that; the ratio to the first that lies more than `margin` above the surface.
fn published(field: &HeightField, [i, j]: [i64; 2], margin: f64) -> f64 {
    let (w, h) = (field.width() as i64, field.height() as i64);
    let low = f64::from(field.texel(i, j));
    let reach = |at: i64, n: i64| {
        if field.wrap() == Wrap::Clamp { 0..=n - 1 } else { at - 2 * n..=at + 2 * n }
    };
    let mut best = 1.0_f64;
    for y in reach(j, h) {
        for x in reach(i, w) {
            let top = f64::from(field.texel(x, y));
            let way = [(x - i) as f64 / w as f64, (y - j) as f64 / h as f64];
            let out = way[0].hypot(way[1]);
            if out == 0.0 || top <= low {
                continue;
            }
            let place = |k: i32| {
                let z = top - top * f64::from(k) / 128.0;
                let reach = if top < 1.0 { (1.0 - z) / (1.0 - top) } else { 1.0 };
                (z, reach)
            };
            let uv = |reach: f64| {
                [(i as f64 + 0.5) / w as f64 + reach * way[0], (j as f64 + 0.5) / h as f64 + reach * way[1]]
            };
            let exit = (1..=128).map(place).find(|&(z, reach)| height(field, uv(reach)) < z - margin);
            let exit = if top >= 1.0 { Some((top, 1.0)) } else { exit };
            if let Some((z, reach)) = exit
                && z > low
            {
                best = best.min(out * reach / (z - low));
            }
        }
    }
    best
}

#[test]
fn relaxed_texel_mode_is_the_textbook_loop() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for (name, field) in maps(13, 9, wrap) {
            let found = relaxed(&field, ConeMode::Texel);
            let mut either = 0;
            for (at, &found) in found.iter().enumerate() {
                let texel = [at as i64 % 13, at as i64 / 13];
                // Rays along the surface are in or out by rounding: both are the textbook's.
                let (narrow, wide) = (published(&field, texel, -1e-9), published(&field, texel, 1e-9));
                let found = f64::from(found);
                either += usize::from(wide - narrow > 1e-6);
                assert!(
                    found >= narrow - 1e-6 && found <= wide + 1e-6,
                    "{name} {wrap:?} {at}: {found} against {narrow} to {wide}"
                );
            }
            println!("{name} {wrap:?}: {either} of {} texels by rounding", found.len());
        }
    }
}

#[test]
fn flat_maps_and_lonely_peaks_have_known_cones() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for mode in [ConeMode::Conservative, ConeMode::Texel] {
            let flat = from_fn(6, 4, wrap, |_, _| 0.3);
            assert!(cones(&flat, mode).iter().all(|&ratio| ratio == 1.0));
            assert_eq!(cones(&from_fn(1, 1, wrap, |_, _| 0.7), mode), [1.0]);
        }
    }
    let peak = from_fn(64, 64, Wrap::Clamp, |i, j| if (i, j) == (32, 32) { 1.0 } else { 0.0 });
    let map = cones(&peak, ConeMode::Texel);
    assert!((map[32 * 64 + 12] - 20.0 / 64.0).abs() < 1e-6);
    assert!((map[(32 + 3) * 64 + 36] - 5.0 / 64.0).abs() < 1e-6);
    assert_eq!(map[32 * 64 + 32], 1.0);
    // Seen from up to a texel nearer, along the row: the peak itself is the steepest.
    let map = cones(&peak, ConeMode::Conservative);
    assert!((map[32 * 64 + 12] - 19.0 / 64.0).abs() < 1e-3, "{}", map[32 * 64 + 12] * 64.0);
}

#[test]
fn roots_keep_narrow_cones_in_eight_bits() {
    use bake::encode::Range;
    use bake::maps::{Map, Value, bake};
    let field = noise(300, 200, Wrap::Repeat, 3);
    for name in ["cone", "relaxed_cone"] {
        let map = Map::named(name).unwrap();
        let texels = |curve: &str| {
            let options = map.info.defaults().with("curve", Value::Choice(curve.to_owned())).unwrap();
            bake(&field, map, &options, Progress::none()).unwrap().layers.remove(0).texels
        };
        let (ratios, roots) = (texels("linear"), texels("sqrt"));
        let (mut gone, mut kept) = (0, 0);
        for (&ratio, &root) in ratios.iter().zip(&roots) {
            assert!(f64::from(root) * f64::from(root) <= f64::from(ratio));
            assert!((root * root - ratio).abs() <= 3e-7 * ratio);
            let in_file = |value: f32| f64::from(Range::LOWER_BOUND.encode(value, 255)) / 255.0;
            let back = in_file(root) * in_file(root);
            assert!(back <= f64::from(ratio));
            gone += usize::from(in_file(ratio) == 0.0);
            kept += usize::from(back >= 0.8 * f64::from(ratio));
        }
        println!("{name}: {gone} of {} lost, {kept} within a fifth as roots", ratios.len());
        assert!(gone > ratios.len() / 4 && kept == ratios.len());
    }
}

#[test]
fn bakes_can_be_stopped_and_count_up() {
    let field = noise(64, 64, Wrap::Repeat, 1);
    let mut stop = |_: usize, _: usize| false;
    let stopped = cone_map(&field, ConeMode::Conservative, Progress::new(&mut stop));
    assert!(matches!(stopped, Err(BakeError::Interrupted)));
    let mut seen = Vec::new();
    let mut watch = |done: usize, total: usize| {
        seen.push((done, total));
        true
    };
    cone_map(&field, ConeMode::Conservative, Progress::new(&mut watch)).unwrap();
    assert!(seen.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    assert!(seen.last().is_some_and(|(done, total)| done == total));
}
