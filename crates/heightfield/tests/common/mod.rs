//! Maps, rays and an independent reference shared by the tests.
#![allow(dead_code)]

use heightfield::{ConeKind, ConeMap, DistanceMap, HeightField, Wrap};

/// A small deterministic generator (SplitMix64), so that every failure can be repeated.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

pub fn from_fn(w: usize, h: usize, wrap: Wrap, f: impl Fn(usize, usize) -> f32) -> HeightField {
    let texels: Vec<f32> = (0..w * h).map(|i| f(i % w, i / w)).collect();
    HeightField::new(&texels, w, h, wrap).unwrap()
}

/// White noise: as rough as a map can be.
pub fn noise(w: usize, h: usize, wrap: Wrap, seed: u64) -> HeightField {
    let mut random = Random(seed);
    let texels: Vec<f32> = (0..w * h).map(|_| random.next() as f32).collect();
    HeightField::new(&texels, w, h, wrap).unwrap()
}

/// A smooth map of a few waves.
pub fn waves(w: usize, h: usize, wrap: Wrap) -> HeightField {
    let turn = std::f32::consts::TAU;
    from_fn(w, h, wrap, |i, j| {
        let (u, v) = ((i as f32 + 0.5) / w as f32, (j as f32 + 0.5) / h as f32);
        0.5 + 0.24 * (turn * 2.0 * u).sin() + 0.24 * (turn * (3.0 * v + u)).cos()
    })
}

/// Ridges one texel wide on flat ground.
pub fn ridges(w: usize, h: usize, wrap: Wrap) -> HeightField {
    from_fn(w, h, wrap, |i, j| if i % 13 == 3 || j % 17 == 5 { 1.0 } else { 0.0 })
}

/// Values that are exact in binary and often equal: rays touch corners and flats.
pub fn terraces(w: usize, h: usize, wrap: Wrap) -> HeightField {
    from_fn(w, h, wrap, |i, j| ((i / 4 + 2 * (j / 4)) % 5) as f32 / 4.0)
}

pub fn maps(w: usize, h: usize, wrap: Wrap) -> Vec<(&'static str, HeightField)> {
    vec![
        ("noise", noise(w, h, wrap, 7)),
        ("waves", waves(w, h, wrap)),
        ("ridges", ridges(w, h, wrap)),
        ("terraces", terraces(w, h, wrap)),
        ("flat 0", from_fn(w, h, wrap, |_, _| 0.0)),
        ("flat 1", from_fn(w, h, wrap, |_, _| 1.0)),
        ("dot", from_fn(w, h, wrap, |i, j| if (i, j) == (w / 2, h / 3) { 1.0 } else { 0.0 })),
    ]
}

/// The first hit by a walk over every cell in turn: no pyramid, no closed form.
///
/// Cells are visited in the order of the crossings of their sides, all computed in `f64` from the
/// start of the ray; in each cell the height difference along the ray is a parabola, which is cut at
/// its extremum and bisected on the first piece that changes sign.
/// Returns `None` when the ray leaves the slab between floor and lid, or `reach` is passed.
pub fn walk(field: &HeightField, origin: [f64; 3], direction: [f64; 3], reach: f64) -> Option<f64> {
    let (w, h) = (field.width() as f64, field.height() as f64);
    let x0 = origin[0] * w - 0.5;
    let y0 = origin[1] * h - 0.5;
    let (dx, dy, dz) = (direction[0] * w, direction[1] * h, direction[2]);
    let mut t = 0.0;
    if origin[2] > 1.0 {
        if dz >= 0.0 {
            return None;
        }
        t = (1.0 - origin[2]) / dz;
    }
    let mut i = (x0 + t * dx).floor() as i64;
    let mut j = (y0 + t * dy).floor() as i64;
    let time = |start: f64, speed: f64, cell: i64| {
        if speed > 0.0 {
            ((cell + 1) as f64 - start) / speed
        } else if speed < 0.0 {
            (cell as f64 - start) / speed
        } else {
            f64::INFINITY
        }
    };
    while t < reach {
        let (exit_x, exit_y) = (time(x0, dx, i), time(y0, dy, j));
        let end = exit_x.min(exit_y).max(t);
        let corner = |a: i64, b: i64| f64::from(field.texel(a, b));
        let (h00, h10, h01, h11) = (corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
        let gap = |t: f64| {
            let x = (x0 + t * dx - i as f64).clamp(0.0, 1.0);
            let y = (y0 + t * dy - j as f64).clamp(0.0, 1.0);
            origin[2] + t * dz - ((h00 * (1.0 - x) + h10 * x) * (1.0 - y) + (h01 * (1.0 - x) + h11 * x) * y)
        };
        if gap(t) <= 0.0 {
            return Some(t);
        }
        let last = if end.is_finite() { end } else { (0.0 - origin[2]) / dz };
        let bend = -(h00 - h10 - h01 + h11) * dx * dy;
        let mut cuts = vec![t];
        if bend != 0.0 {
            let middle = 0.5 * (t + last);
            let step = 1e-3 * (last - t).max(1e-12);
            let slope = (gap(middle + step) - gap(middle - step)) / (2.0 * step);
            let extremum = middle - slope / (2.0 * bend);
            if extremum > t && extremum < last {
                cuts.push(extremum);
            }
        }
        cuts.push(last);
        for piece in cuts.windows(2) {
            let (mut above, mut below) = (piece[0], piece[1]);
            if gap(below) > 0.0 {
                continue;
            }
            for _ in 0..200 {
                let middle = 0.5 * (above + below);
                if gap(middle) <= 0.0 { below = middle } else { above = middle }
            }
            return Some(below);
        }
        if !end.is_finite() {
            return None;
        }
        t = end;
        if exit_x <= exit_y {
            i += if dx > 0.0 { 1 } else { -1 };
        } else {
            j += if dy > 0.0 { 1 } else { -1 };
        }
        if dz > 0.0 && origin[2] + t * dz > 1.0 {
            return None;
        }
    }
    None
}

/// Attaches baked maps that promise nothing, as there are no bakes here: cones that do not open, and
/// distances of nothing.
pub fn attach_baked(field: &HeightField) {
    for kind in ConeKind::ALL {
        let closed = vec![0.0; field.width() * field.height()];
        field.attach_cone_map(ConeMap::new(field, kind, &closed).unwrap());
    }
    let nothing = vec![0.0; field.width() * field.height()];
    field.attach_distance_map(DistanceMap::new(field, 1, &nothing).unwrap());
}
