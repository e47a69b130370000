//! Every instruction set against the search for one ray, which the oracle is.

use super::Exact;
use crate::chunk::Chunk;
use crate::lanes::{Level, dispatch_at};
use crate::order::{RUN, squares};
use crate::{HeightField, RayArray, Status, Wrap, oracle};

/// Whole numbers in no order, from 0 up to 997.
fn number(i: usize, k: usize) -> f64 {
    ((i * k + i / 7) % 997) as f64
}

fn fields() -> Vec<HeightField> {
    let mut fields = Vec::new();
    for (w, h) in [(1, 1), (1, 40), (64, 48), (61, 130), (64, 64)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let rough: Vec<f32> = (0..w * h).map(|i| (number(i, 7919) / 997.0) as f32).collect();
            let spikes: Vec<f32> = (0..w * h).map(|i| if i % 53 == 7 { 0.95 } else { 0.05 }).collect();
            fields.push(HeightField::new(&rough, w, h, wrap).unwrap());
            // Walls of which one is behind the other, for rays that come down between them.
            let walls: Vec<f32> =
                (0..w * h).map(|i| if (i % w + 3 * (i / w)) % 32 < 4 { 1.0 } else { 0.0 }).collect();
            fields.push(HeightField::new(&spikes, w, h, wrap).unwrap());
            fields.push(HeightField::new(&walls, w, h, wrap).unwrap());
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

/// Marches at every level and holds the hits against those of the search for one ray.
fn agrees_at_every_level(field: &HeightField, origins: &[f64], directions: &[f64], order: &[u32]) {
    let n = origins.len() / 3;
    let get = |a: &[f64], i: usize| [a[3 * i], a[3 * i + 1], a[3 * i + 2]];
    let truth: Vec<_> = (0..n).map(|i| oracle::exact(field, get(origins, i), get(directions, i))).collect();
    for &level in Level::available() {
        let (mut t, mut status) = (vec![f32::NAN; n], vec![9; n]);
        let mut chunk = Chunk {
            origins: RayArray::F64(origins),
            directions: RayArray::F64(directions),
            order,
            from_surface: false,
            cancel: None,
            t: Some(&mut t),
            uv: None,
            z: None,
            normal: None,
            steps: None,
            status: Some(&mut status),
        };
        dispatch_at(level, Exact { field, chunk: &mut chunk });
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

#[test]
fn every_level_finds_what_the_search_for_one_ray_finds() {
    let (origins, directions) = rays(1301);
    for field in fields() {
        agrees_at_every_level(&field, &origins, &directions, &[]);
    }
}

/// Eight rows of a picture, so far apart in tiles, that begin at a place, cut into squares. With a ray here
/// and there that rises, so that some squares are whole and others are not. With 1.49 cells a margin is used up.
#[test]
fn so_does_every_level_in_squares_of_a_picture() {
    let (width, height) = (200, RUN);
    for (k, (apart, [left, top])) in
        [(0.3, [0.0, 0.0]), (1.0, [0.003, 0.001]), (1.49, [-0.5, 40.0]), (9.0, [1e3, -2e3])]
            .into_iter()
            .enumerate()
    {
        let (mut origins, mut directions) = (Vec::new(), Vec::new());
        for i in 0..width * height {
            let (x, y) = ((i % width) as f64, (i / width) as f64);
            origins.extend([left + apart * x / 64.0, top + apart * y / 64.0, 1.0]);
            directions.extend([0.9 + 0.001 * x, 0.4 - 0.002 * y, -1.0]);
        }
        for field in fields() {
            // Wide enough apart over few texels, they are no rows.
            let (o, d) = (RayArray::F64(&origins), RayArray::F64(&directions));
            let order = squares(&field, o, d).map_or(Vec::new(), |squares| squares.runs);
            assert!(!order.is_empty() || field.width() == 1 || k == 3, "{k} {}", field.width());
            let mut directions = directions.clone();
            directions.chunks_exact_mut(3).skip(13).step_by(97).for_each(|d| d[2] = 0.5);
            agrees_at_every_level(&field, &origins, &directions, &order);
        }
    }
}
