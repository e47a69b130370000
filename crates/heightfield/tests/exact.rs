//! The exact search against closed forms and against a plain walk over every cell.

#![allow(clippy::unwrap_used)]

mod common;

use common::{Random, from_fn, maps, noise, walk, waves};
use heightfield::{HeightField, MarchOptions, OutputSet, RayArray, Status, Technique, Wrap, march, oracle};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

fn random_ray(random: &mut Random, kind: usize) -> ([f64; 3], [f64; 3]) {
    let azimuth = random.range(0.0, std::f64::consts::TAU);
    let lateral = [0.0, 0.05, 0.5, 3.0, 30.0][kind % 5];
    let (mut du, mut dv) = (lateral * azimuth.cos(), lateral * azimuth.sin());
    if kind % 7 == 3 {
        du = 0.0;
    } else if kind % 7 == 5 {
        dv = 0.0;
    }
    let origin = [random.range(-1.0, 2.0), random.range(-1.0, 2.0), random.range(1.0, 1.5)];
    (origin, [du, dv, -1.0])
}

/// Compares one ray with the walk. A tangent ray may be called either way by rounding; then the two
/// hits must both lie on the surface.
fn agree(field: &HeightField, name: &str, origin: [f64; 3], direction: [f64; 3], reach: f64) {
    let found = oracle::exact(field, origin, direction);
    let expected = walk(field, origin, direction, reach);
    match expected {
        Some(t) => {
            assert_eq!(found.status, Status::Hit, "{name} {origin:?} {direction:?}: walk hits at {t}");
            let tolerance = 1e-9 * (1.0 + t.abs());
            assert!(
                (found.t - t).abs() <= tolerance,
                "{name} {origin:?} {direction:?}: walk {t}, exact {}",
                found.t
            );
        }
        None => assert_ne!(found.status, Status::Hit, "{name} {origin:?} {direction:?}: walk finds nothing"),
    }
}

#[test]
fn downward_rays_agree_with_the_walk() {
    for (w, h) in [(1, 1), (1, 8), (5, 3), (32, 32), (61, 47)] {
        for wrap in WRAPS {
            for (name, field) in maps(w, h, wrap) {
                let mut random = Random(w as u64 * 100 + h as u64);
                for kind in 0..700 {
                    let (origin, direction) = random_ray(&mut random, kind);
                    agree(&field, name, origin, direction, f64::INFINITY);
                }
            }
        }
    }
}

#[test]
fn rays_along_cell_borders_and_through_corners_agree_with_the_walk() {
    for wrap in WRAPS {
        for (name, field) in maps(16, 16, wrap) {
            for i in -3..20 {
                for (du, dv) in
                    [(1.0, 0.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (2.0, -1.0), (-0.25, -0.25)]
                {
                    let centre = (f64::from(i) + 0.5) / 16.0;
                    agree(&field, name, [centre, centre, 1.0], [du, dv, -1.0], f64::INFINITY);
                    agree(&field, name, [centre, 0.5 / 16.0, 1.0], [du, dv, -0.125], f64::INFINITY);
                }
            }
        }
    }
}

#[test]
fn rising_and_level_rays_agree_with_the_walk() {
    for wrap in WRAPS {
        for (name, field) in maps(24, 18, wrap) {
            let mut random = Random(99);
            for kind in 0..600 {
                let (u, v) = (random.next(), random.next());
                let height = field.height_at(u, v);
                let z = height + (1.0 - height) * random.range(0.001, 1.0);
                let azimuth = random.range(0.0, std::f64::consts::TAU);
                let dz = [0.0, 0.01, 0.3, 5.0][kind % 4];
                let direction = [azimuth.cos(), azimuth.sin(), dz];
                let origin = [u, v, z];
                // A level ray may go on for ever: only what the walk finds within reach is compared.
                if dz > 0.0 || walk(&field, origin, direction, 40.0).is_some() {
                    agree(&field, name, origin, direction, 1e4);
                }
            }
        }
    }
}

#[test]
fn a_level_ray_along_an_axis_ends() {
    let field = from_fn(16, 16, Wrap::Repeat, |i, j| if (i, j) == (3, 3) { 1.0 } else { 0.0 });
    for direction in [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [-1.0, 0.0, 0.0]] {
        let found = oracle::exact(&field, [0.8, 0.8, 0.5], direction);
        assert_eq!(found.status, Status::Left, "{direction:?}");
    }
    let found = oracle::exact(&field, [0.8, 3.5 / 16.0, 0.5], [1.0, 0.0, 0.0]);
    assert_eq!(found.status, Status::Hit);
    assert!((found.uv[0] - (1.0 + 3.0 / 16.0)).abs() < 1e-12, "{:?}", found.uv);
}

#[test]
fn a_plane_is_hit_where_the_formula_says() {
    // h = 0.25 + 0.5 (x + 0.5) / 64 between the texel centres of a clamped map.
    let field = from_fn(64, 64, Wrap::Clamp, |i, _| (0.25 + 0.5 * (i as f64 + 0.5) / 64.0) as f32);
    let mut random = Random(3);
    for _ in 0..2000 {
        let u = random.range(0.3, 0.6);
        let direction = [random.range(-0.2, 0.2), random.range(-3.0, 3.0), -1.0];
        let found = oracle::exact(&field, [u, 0.5, 1.0], direction);
        let t = (1.0 - 0.25 - 0.5 * u) / (1.0 + 0.5 * direction[0]);
        assert!((found.t - t).abs() < 1e-7, "u {u} {direction:?}: {} against {t}", found.t);
        assert!((found.gradient[0] - 0.5).abs() < 1e-4 && found.gradient[1].abs() < 1e-9);
    }
}

#[test]
fn a_saddle_is_hit_where_the_quadratic_says() {
    // One bilinear cell: h = x y with the corners of texels (0, 0) .. (1, 1).
    let field = from_fn(2, 2, Wrap::Clamp, |i, j| (i * j) as f32);
    let mut random = Random(4);
    for _ in 0..2000 {
        let (x, y) = (random.next(), random.next());
        let (ex, ey) = (random.next(), random.next());
        // The ray from (x, y, 1) to (ex, ey, 0): 1 - t = (x + t (ex - x)) (y + t (ey - y)).
        let (dx, dy) = (ex - x, ey - y);
        let found =
            oracle::exact(&field, [(x + 0.5) / 2.0, (y + 0.5) / 2.0, 1.0], [dx / 2.0, dy / 2.0, -1.0]);
        let t = found.t;
        let residual = 1.0 - t - (x + t * dx) * (y + t * dy);
        assert!(residual.abs() < 1e-12, "({x}, {y}) -> ({ex}, {ey}): t {t}, residual {residual}");
        let earlier = (0..1000).map(|k| t * f64::from(k) / 1000.0);
        for s in earlier {
            assert!(1.0 - s - (x + s * dx) * (y + s * dy) > -1e-12);
        }
    }
}

#[test]
fn a_shadow_ray_ignores_the_point_it_starts_on_and_nothing_else() {
    for wrap in WRAPS {
        for (name, field) in maps(24, 18, wrap) {
            let mut random = Random(5);
            for _ in 0..400 {
                let (u, v) = (random.next(), random.next());
                let z = field.height_at(u, v);
                let azimuth = random.range(0.0, std::f64::consts::TAU);
                let direction = [azimuth.cos(), azimuth.sin(), random.range(0.05, 20.0)];
                let [gu, gv] = field.gradient_at(u, v);
                let leaving = direction[2] - gu * direction[0] - gv * direction[1];
                let found = oracle::occluded(&field, [u, v, z], direction);
                if leaving < -1e-9 {
                    assert!(found, "{name}: the ray goes into the surface");
                } else if leaving > 1e-6 {
                    // Off the surface by a hair the walk sees the same, unless the ray grazes.
                    let lifted = [u, v, z + 1e-9];
                    let low = walk(&field, lifted, direction, 1e4).is_some();
                    let lifted = [u, v, z + 1e-6];
                    let high = walk(&field, lifted, direction, 1e4).is_some();
                    if low == high {
                        assert_eq!(found, low, "{name} ({u}, {v}) {direction:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn a_ray_from_below_the_surface_hits_where_it_starts() {
    let field = noise(32, 32, Wrap::Repeat, 1);
    let found = oracle::exact(&field, [0.3, 0.4, -0.5], [0.1, 0.2, 1.0]);
    assert_eq!((found.status, found.t), (Status::Hit, 0.0));
}

#[test]
fn a_million_tiles_away_is_the_same_as_here() {
    let field = waves(64, 32, Wrap::Repeat);
    let mut random = Random(6);
    for _ in 0..500 {
        let (u, v) = ((random.next() * 1024.0).floor() / 1024.0, (random.next() * 1024.0).floor() / 1024.0);
        let direction = [random.range(-1.0, 1.0), random.range(-1.0, 1.0), -1.0];
        let here = oracle::exact(&field, [u, v, 1.0], direction);
        let far = oracle::exact(&field, [u + 1_048_576.0, v - 1_048_576.0, 1.0], direction);
        // Only the rounding of the far coordinate itself may show: 2^-33 tiles.
        assert!((here.t - far.t).abs() < 1e-6, "{u} {v} {direction:?}: {} {}", here.t, far.t);
    }
}

#[test]
fn the_f32_search_agrees_with_the_oracle() {
    let exact = Technique::named("exact").unwrap();
    for wrap in WRAPS {
        for (name, field) in maps(61, 47, wrap) {
            let mut random = Random(8);
            let mut differing = 0;
            let rays = 2000;
            for kind in 0..rays {
                let (mut origin, direction) = random_ray(&mut random, kind);
                origin[2] = 1.0;
                let cos_theta = field.extent().cos_theta(direction);
                let period = heightfield::march::period(wrap);
                let segment = heightfield::Segment::clip(origin, direction, cos_theta, period).unwrap();
                let found = exact.search(&field, segment.start, segment.delta, cos_theta);
                // The f32 segment is the question both are asked.
                let truth = oracle::exact(
                    &field,
                    segment.start.to_array().map(f64::from),
                    segment.delta.to_array().map(f64::from),
                );
                assert_eq!(found.status, Status::Hit, "{name} {wrap:?}");
                let texels = (f64::from(found.tau) - truth.t)
                    * (f64::from(segment.delta.x) * 61.0).hypot(f64::from(segment.delta.y) * 47.0);
                differing += usize::from(texels.abs() > 0.01);
            }
            // Grazing touches that one precision sees and the other does not.
            assert!(differing <= rays / 1000, "{name} {wrap:?}: {differing} of {rays} rays differ");
        }
    }
}

#[test]
fn a_search_that_skips_a_cell_would_be_noticed() {
    // Negative control: the comparison above, fed with a walk over a map that lacks one ridge.
    let whole = common::ridges(32, 32, Wrap::Repeat);
    let lacking =
        from_fn(32, 32, Wrap::Repeat, |i, j| if i == 3 { 0.0 } else { whole.texel(i as i64, j as i64) });
    let mut random = Random(9);
    let differing = (0..1000)
        .filter(|&kind| {
            let (origin, direction) = random_ray(&mut random, kind);
            let t = walk(&lacking, origin, direction, f64::INFINITY).unwrap_or(f64::INFINITY);
            (oracle::exact(&whole, origin, direction).t - t).abs() > 1e-9
        })
        .count();
    assert!(differing > 50, "only {differing} of 1000 rays notice a missing ridge");
}

#[test]
fn a_batch_gives_what_single_rays_give() {
    let field = waves(40, 30, Wrap::Repeat);
    let mut random = Random(10);
    let n = 10_000;
    let mut origins = Vec::new();
    let mut directions = Vec::new();
    for kind in 0..n {
        let (o, d) = random_ray(&mut random, kind);
        origins.extend(o);
        directions.extend(d);
    }
    let exact = Technique::named("exact").unwrap();
    let hits =
        march(&field, &exact, RayArray::F64(&origins), RayArray::F64(&directions), &MarchOptions::default())
            .unwrap();
    let (t, uv, z, normal) = (hits.t.unwrap(), hits.uv.unwrap(), hits.z.unwrap(), hits.normal.unwrap());
    for i in 0..n {
        let o = [origins[3 * i], origins[3 * i + 1], origins[3 * i + 2]];
        let d = [directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]];
        let truth = oracle::exact(&field, o, d);
        assert_eq!(t[i], truth.t as f32);
        assert_eq!([uv[2 * i], uv[2 * i + 1]], truth.uv.map(|x| x as f32));
        assert_eq!(z[i], truth.z as f32);
        let slope = [-normal[3 * i] / normal[3 * i + 2], -normal[3 * i + 1] / normal[3 * i + 2]];
        assert!((f64::from(slope[0]) - truth.gradient[0]).abs() < 1e-4);
        assert!((f64::from(slope[1]) - truth.gradient[1]).abs() < 1e-4);
    }
    let only_z = MarchOptions { outputs: OutputSet::Z, ..Default::default() };
    let again = march(&field, &exact, RayArray::F64(&origins), RayArray::F64(&directions), &only_z).unwrap();
    assert_eq!(again.z.unwrap(), z);
    assert!(again.t.is_none() && again.status.is_none());
}

#[test]
fn lit_points_do_not_shadow_themselves() {
    // Every light ray rises faster than any slope of the map, so nothing can be in its way.
    let exact = Technique::named("exact").unwrap();
    let rough = noise(300, 200, Wrap::Repeat, 12);
    let field = from_fn(300, 200, Wrap::Repeat, |i, j| 0.4 + 0.1 * rough.texel(i as i64, j as i64));
    let mut random = Random(13);
    let mut blocked = 0;
    for _ in 0..200_000 {
        let (u, v) = (random.next() as f32, random.next() as f32);
        let start = glam::Vec3::new(u, v, field.sample(u, v));
        let azimuth = random.range(0.0, std::f64::consts::TAU);
        let lateral = random.range(0.0, 0.7 / (0.2 * 300.0));
        let delta = glam::DVec3::new(lateral * azimuth.cos(), lateral * azimuth.sin(), 1.0).as_vec3();
        blocked += usize::from(exact.occluded(&field, start, delta * 0.5, 1.0));
    }
    assert_eq!(blocked, 0, "of 200000 lit points");
}

#[test]
fn what_lies_beyond_the_light_throws_no_shadow() {
    let exact = Technique::named("exact").unwrap();
    let field = from_fn(64, 64, Wrap::Repeat, |i, _| if i == 48 { 1.0 } else { 0.25 });
    let blocked = |lateral| {
        let delta = glam::Vec3::new(lateral, 0.0, 0.5 * lateral);
        exact.occluded(&field, glam::Vec3::new(0.25, 0.5, 0.25), delta, 1.0)
    };
    assert!(blocked(0.6), "the wall stands between the point and the light");
    assert!(!blocked(0.4), "the wall stands behind the light");
}
