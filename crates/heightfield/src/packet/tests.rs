//! Every instruction set against the search for one ray, which the oracle is.

use super::Exact;
use crate::chunk::Chunk;
use crate::lanes::{Level, dispatch_at};
use crate::{HeightField, RayArray, Status, Wrap, oracle};

/// Whole numbers in no order, from 0 up to 997.
fn number(i: usize, k: usize) -> f64 {
    ((i * k + i / 7) % 997) as f64
}

fn fields() -> Vec<HeightField> {
    let mut fields = Vec::new();
    for (w, h) in [(1, 1), (1, 40), (64, 48), (61, 130)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let rough: Vec<f32> = (0..w * h).map(|i| (number(i, 7919) / 997.0) as f32).collect();
            let spikes: Vec<f32> = (0..w * h).map(|i| if i % 53 == 7 { 0.95 } else { 0.05 }).collect();
            fields.push(HeightField::new(&rough, w, h, wrap).unwrap());
            fields.push(HeightField::new(&spikes, w, h, wrap).unwrap());
        }
    }
    fields
}

/// Neighbouring rays as in a picture, rays in disorder, and among them some that rise, are level, are
/// vertical, are parallel to an axis, pass corners, start low or a million tiles away.
fn rays(n: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut origins, mut directions) = (Vec::new(), Vec::new());
    for i in 0..n {
        let (a, b) = (number(i, 31) / 997.0, number(i, 57) / 997.0);
        let (mut o, mut d) = if i < n / 2 {
            let (x, y) = ((i % 61) as f64, (i / 61) as f64);
            ([x / 64.0 + 0.003, y / 64.0 + 0.001, 1.0], [0.4 + 0.01 * x / 61.0, -0.3, -1.0])
        } else {
            ([3.0 * a - 1.0, 2.0 * b, 1.5], [4.0 * b - 2.0, 1.0 - 2.0 * a, -0.7])
        };
        match i % 29 {
            3 => d[2] = 0.4,
            5 => d[2] = 0.0,
            7 => d = [0.0, 0.0, -2.0],
            11 => d[1] = 0.0,
            13 => (o, d) = ([0.5, 0.5, 1.0], [-0.25, 0.25, -0.5]),
            17 => o[2] = a,
            19 => o[2] = -0.5,
            23 => o[0] += 1e6,
            25 => d[2] = -1e-3,
            // Hardly off the vertical.
            27 => d = [1e-25 * (a - 0.5), -1e-31 * b, -0.6],
            _ => {}
        }
        origins.extend(o);
        directions.extend(d);
    }
    (origins, directions)
}

#[test]
fn every_level_finds_what_the_search_for_one_ray_finds() {
    let n = 1301;
    let (origins, directions) = rays(n);
    for field in fields() {
        let truth: Vec<_> = (0..n)
            .map(|i| {
                let get = |a: &[f64]| [a[3 * i], a[3 * i + 1], a[3 * i + 2]];
                oracle::exact(&field, get(&origins), get(&directions))
            })
            .collect();
        for &level in Level::available() {
            let (mut t, mut status) = (vec![f32::NAN; n], vec![9; n]);
            let mut chunk = Chunk {
                origins: RayArray::F64(&origins),
                directions: RayArray::F64(&directions),
                order: &[],
                from_surface: false,
                cancel: None,
                t: Some(&mut t),
                uv: None,
                z: None,
                normal: None,
                steps: None,
                status: Some(&mut status),
            };
            dispatch_at(level, Exact { field: &field, chunk: &mut chunk });
            for i in 0..n {
                let what = || {
                    let size = [field.width(), field.height()];
                    format!("{} ray {i} of {size:?} {:?}: {}", level.name(), field.wrap(), t[i])
                };
                assert_eq!(status[i], truth[i].status as u8, "{}", what());
                if truth[i].status == Status::Hit {
                    let (off, scale) = ((f64::from(t[i]) - truth[i].t).abs(), truth[i].t.abs());
                    assert!(off <= 6e-8 * scale + 1e-9, "{} {}", what(), truth[i].t);
                }
            }
        }
    }
}
