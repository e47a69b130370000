//! Maps and rays that the tests of cones share.
#![allow(dead_code, missing_docs)]

pub mod rises;

use heightfield::{HeightField, Segment, Technique, Wrap, oracle};

/// SplitMix64.
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
    let texels: Vec<f32> = (0..w * h).map(|at| f(at % w, at / w)).collect();
    HeightField::new(&texels, w, h, wrap).unwrap()
}

pub fn noise(w: usize, h: usize, wrap: Wrap, seed: u64) -> HeightField {
    let mut random = Random(seed);
    let texels: Vec<f32> = (0..w * h).map(|_| random.next() as f32).collect();
    HeightField::new(&texels, w, h, wrap).unwrap()
}

pub fn waves(w: usize, h: usize, wrap: Wrap) -> HeightField {
    let turn = std::f32::consts::TAU;
    from_fn(w, h, wrap, |i, j| {
        let (u, v) = ((i as f32 + 0.5) / w as f32, (j as f32 + 0.5) / h as f32);
        0.5 + 0.24 * (turn * u).sin() + 0.24 * (turn * (2.0 * v + u)).cos()
    })
}

/// Rough, smooth, thin, stepped, and one lonely peak.
pub fn maps(w: usize, h: usize, wrap: Wrap) -> Vec<(&'static str, HeightField)> {
    vec![
        ("noise", noise(w, h, wrap, 7)),
        ("waves", waves(w, h, wrap)),
        ("ridges", from_fn(w, h, wrap, |i, j| if i % 13 == 3 || j % 17 == 5 { 1.0 } else { 0.0 })),
        ("terraces", from_fn(w, h, wrap, |i, j| ((i / 4 + 2 * (j / 4)) % 5) as f32 / 4.0)),
        ("peak", from_fn(w, h, wrap, |i, j| if (i, j) == (w / 2, h / 3) { 1.0 } else { 0.0 })),
    ]
}

/// The bilinear surface at `(u, v)`.
pub fn height(field: &HeightField, at: [f64; 2]) -> f64 {
    field.height_at(at[0], at[1])
}

/// Values of one a texel as a surface, to interpolate between them as the field does.
pub fn of(field: &HeightField, values: &[f32]) -> HeightField {
    HeightField::new(values, field.width(), field.height(), field.wrap()).unwrap()
}

/// Rays from the lid at 90 to 2 degrees, some along the axes and diagonals.
pub fn rays(field: &HeightField, count: usize, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut random = Random(seed);
    let extent = field.extent();
    let (mut origins, mut directions) = (Vec::new(), Vec::new());
    for i in 0..count {
        let elevation = [90.0_f64, 60.0, 45.0, 20.0, 10.0, 5.0, 2.0][i % 7].to_radians();
        let turn = match i % 5 {
            0 => std::f64::consts::FRAC_PI_4 * (i % 8) as f64,
            _ => random.range(0.0, std::f64::consts::TAU),
        };
        let run = f64::from(extent.scale) * elevation.cos() / elevation.sin();
        origins.extend([random.range(-1.0, 2.0), random.range(-1.0, 2.0), 1.0]);
        directions.extend([run * turn.cos(), run * turn.sin(), -1.0]);
    }
    let single = |values: Vec<f64>| values.into_iter().map(|x| f64::from(x as f32)).collect();
    (single(origins), single(directions))
}

/// How many of `count` rays from the surface to a light are judged otherwise than by the exact search in `f64`.
pub fn light_faults(field: &HeightField, technique: &Technique, count: usize) -> usize {
    let mut random = Random(9);
    let period = heightfield::march::period(field.wrap());
    let mut differing = 0;
    for _ in 0..count {
        let (u, v) = (random.range(0.0, 1.0), random.range(0.0, 1.0));
        let z = field.height_at(u, v);
        let towards = [random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(0.05, 3.0)];
        let truth = oracle::occluded(field, [u, v, z], towards);
        let segment = Segment::clip([u, v, z], towards, 1.0, period);
        let found = segment.is_some_and(|s| technique.occluded(field, s.start, s.delta, 1.0));
        differing += usize::from(truth != found);
    }
    differing
}
