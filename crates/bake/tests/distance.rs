//! Distance maps: never more than the true distance, and not much less.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use bake::{BakeError, Progress, distance_map};
use heightfield::{Extent, HeightField, Wrap};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

fn field(texels: &[f32], [w, h]: [usize; 2], wrap: Wrap, scale: f32, tile: [f32; 2]) -> HeightField {
    let extent = Extent { scale, tile_size: tile, ..Extent::default() };
    HeightField::new(texels, w, h, wrap).unwrap().with_extent(extent).unwrap()
}

/// Points of the surface, several to a texel, in mesh units, over the map and one map more all round.
fn surface(field: &HeightField, samples: usize) -> Vec<[f64; 3]> {
    let extent = field.extent();
    let n = [field.width(), field.height()].map(|n| (n * samples) as i64);
    let mut points = Vec::new();
    for j in -n[1]..2 * n[1] {
        for i in -n[0]..2 * n[0] {
            let (u, v) = (i as f64 / n[0] as f64, j as f64 / n[1] as f64);
            points.push([
                u * f64::from(extent.tile_size[0]),
                v * f64::from(extent.tile_size[1]),
                field.height_at(u, v) * f64::from(extent.scale),
            ]);
        }
    }
    points
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Random points `(u, v, z)` of the slab.
fn points(count: usize, seed: u64) -> Vec<[f64; 3]> {
    common::noise(3 * count, seed).chunks(3).map(|p| [p[0], p[1], p[2]].map(f64::from)).collect()
}

/// The value that a look-up without filtering gives.
fn look_up(map: &[f32], [w, h, d]: [usize; 3], [u, v, z]: [f64; 3]) -> f64 {
    let at = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    f64::from(map[(at(z, d) * h + at(v, h)) * w + at(u, w)])
}

#[test]
fn no_distance_is_more_than_the_true_one() {
    let cases =
        [([9, 7], 5, 0.3, [1.0, 0.6]), ([12, 12], 16, 0.1, [1.0, 1.0]), ([1, 13], 8, 1.0, [0.1, 1.0])];
    for (size, depth, scale, tile) in cases {
        for wrap in WRAPS {
            let texels: Vec<f32> =
                common::noise(size[0] * size[1], 4).into_iter().map(|h| h * h * h).collect();
            let field = field(&texels, size, wrap, scale, tile);
            let map = distance_map(&field, depth, Progress::none()).unwrap();
            let surface = surface(&field, 8);
            let (mut bounds, mut distances, mut too_far) = (0.0, 0.0, 0);
            for [u, v, z] in points(300, 8) {
                if z < field.height_at(u, v) {
                    continue;
                }
                let place = [u * f64::from(tile[0]), v * f64::from(tile[1]), z * f64::from(scale)];
                // Sampled points are no nearer than the surface itself.
                let true_distance =
                    surface.iter().map(|&point| apart(point, place)).fold(f64::INFINITY, f64::min);
                let bound = look_up(&map, [size[0], size[1], depth], [u, v, z]);
                assert!(bound <= true_distance, "{wrap:?} {u} {v} {z}: {bound} > {true_distance}");
                bounds += bound;
                distances += true_distance;
                // What reading the next slice up would give must fail the same test.
                let above = look_up(&map, [size[0], size[1], depth], [u, v, (z + 1.0).min(1.0)]);
                too_far += usize::from(above > true_distance);
            }
            assert!(bounds > 0.04 * distances, "{size:?} {wrap:?}: {}", bounds / distances);
            assert!(too_far > 0, "{size:?} {wrap:?}");
        }
    }
}

#[test]
fn over_a_plain_it_is_the_height_above_it() {
    for wrap in WRAPS {
        let field = field(&[0.25; 12], [4, 3], wrap, 2.0, [1.0, 1.0]);
        let map = distance_map(&field, 8, Progress::none()).unwrap();
        for (k, slice) in map.chunks(12).enumerate() {
            let expected = (k as f32 / 8.0 - 0.25).max(0.0) * 2.0;
            assert!(slice.iter().all(|&d| d <= expected && d >= expected - 1e-5), "{k}: {slice:?}");
        }
    }
}

/// Beside a wall as high as the slab it is the way to the wall, across the border of a tile as well.
#[test]
fn beside_a_wall_it_is_the_way_to_it() {
    let (w, h) = (32, 4);
    let texels: Vec<f32> = (0..w * h).map(|at| if at % w == 2 { 1.0 } else { 0.0 }).collect();
    for (wrap, copies) in [(Wrap::Repeat, vec![2, 34]), (Wrap::Clamp, vec![2]), (Wrap::Mirror, vec![2, 61])] {
        let field = field(&texels, [w, h], wrap, 10.0, [1.0, 0.125]);
        let map = distance_map(&field, 4, Progress::none()).unwrap();
        for i in 0..w {
            // The ramps of the wall reach one texel to either side; a voxel and the wall's own texel are
            // as wide as one.
            let gap = copies.iter().map(|&at: &usize| at.abs_diff(i)).min().unwrap().saturating_sub(2);
            let top = map[3 * w * h + i];
            let expected = gap as f32 / 32.0;
            assert!((top - expected).abs() <= 1.0 / 32.0 + 1e-5, "{wrap:?} {i}: {top} for {expected}");
        }
    }
}

#[test]
fn a_shift_of_a_tiled_map_shifts_the_distances() {
    let (w, h) = (11, 8);
    let texels = common::noise(w * h, 6);
    let shift = |values: &[f32]| -> Vec<f32> {
        values
            .chunks(w * h)
            .flat_map(|s| (0..w * h).map(move |at| s[(at / w + 3) % h * w + (at % w + 7) % w]))
            .collect()
    };
    let bake = |texels: &[f32]| {
        let field = field(texels, [w, h], Wrap::Repeat, 0.4, [1.0, 1.0]);
        distance_map(&field, 6, Progress::none()).unwrap()
    };
    let (shifted, expected) = (bake(&shift(&texels)), shift(&bake(&texels)));
    for (a, b) in shifted.iter().zip(&expected) {
        assert!((a - b).abs() <= 1e-6 * b.max(1e-3), "{a} {b}");
    }
}

#[test]
fn senseless_depths_are_refused_and_a_stop_is_heard() {
    let field = field(&[0.5; 16], [4, 4], Wrap::Repeat, 0.1, [1.0, 1.0]);
    for depth in [0, 5000] {
        let error = distance_map(&field, depth, Progress::none()).unwrap_err();
        assert!(matches!(error, BakeError::Option { .. }), "{error}");
    }
    let mut stop = |_, _| false;
    let stopped = distance_map(&field, 8, Progress::new(&mut stop));
    assert!(matches!(stopped, Err(BakeError::Interrupted)));
}

#[test]
fn what_does_not_fit_is_said_in_bytes_before_it_is_allocated() {
    let field = field(&vec![0.5; 4 << 20], [2048, 2048], Wrap::Repeat, 0.1, [1.0, 1.0]);
    let map = bake::Map::named("distance").unwrap();
    let plan = (map.plan)(bake::Grid::of(&field), &map.info.defaults());
    assert_eq!(plan.bytes(1), 2048 * 2048 * 32 * 4);
    // 16 GiB: refused on the machines that run tests, or merely planned on larger ones.
    let deep = map.info.defaults().with("depth", bake::Value::Whole(1024)).unwrap();
    assert_eq!((map.plan)(bake::Grid::of(&field), &deep).bytes(1), 1 << 34);
}
