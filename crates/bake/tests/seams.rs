//! The tiling check against closed forms, and against figures that another program measured.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::f64::consts::TAU;

use bake::repair::{Verdict, seam};
use common::{data_image, noise};
use heightfield::{HeightField, Wrap};

fn field(w: usize, h: usize, f: impl Fn(f64, f64) -> f64) -> HeightField {
    let texels: Vec<f32> = (0..w * h).map(|at| f((at % w) as f64, (at / w) as f64) as f32).collect();
    HeightField::new(&texels, w, h, Wrap::Repeat).unwrap()
}

#[test]
fn a_ramp_has_its_step() {
    // Rises by 1/64 a texel along x, is constant along y.
    let ramp = field(32, 20, |x, _| x / 64.0);
    let x = seam(&ramp, 0);
    assert_eq!((x.step, x.inner_step, x.ratio, x.local), (31.0 / 64.0, 1.0 / 64.0, 31.0, 31.0));
    assert_eq!((x.rank, x.verdict, x.worst), (1.0, Verdict::Seam, (0, 31.0 / 64.0)));
    assert_eq!((x.bend, x.inner_bend), (0.5, 0.0));
    let y = seam(&ramp, 1);
    assert_eq!((y.step, y.ratio, y.bend_ratio, y.verdict), (0.0, 0.0, 0.0, Verdict::Tiles));
}

#[test]
fn waves_tile_and_their_halves_crease() {
    let wave = |n: f64| {
        move |x: f64, y: f64| {
            0.5 + 0.2 * (TAU * n * (x + 0.5) / 64.0).sin() + 0.2 * (TAU * (y + 0.5) / 48.0).cos()
        }
    };
    for axis in [0, 1] {
        let whole = seam(&field(64, 48, wave(2.0)), axis);
        assert_eq!(whole.verdict, Verdict::Tiles);
        assert!(whole.ratio < 1.8 && whole.bend_ratio < 1.8);
    }
    // Half a wave meets itself at a height, not at a slope.
    let half = seam(&field(64, 48, wave(1.5)), 0);
    assert_eq!(half.verdict, Verdict::Crease);
    assert!(half.ratio < 2.0 && half.bend_ratio > 5.0);
    // A quarter too much, and not even the heights meet.
    assert_eq!(seam(&field(64, 48, wave(1.25)), 0).verdict, Verdict::Seam);
}

#[test]
fn a_joint_at_the_edge_is_no_seam() {
    // Bricks whose joint begins right at the edge: a large step, as large as at every joint.
    let bricks = field(64, 64, |x, y| if x % 16.0 < 2.0 || y % 16.0 < 2.0 { 0.2 } else { 0.8 });
    for axis in [0, 1] {
        let found = seam(&bricks, axis);
        assert!(found.ratio > 2.0, "{}", found.ratio);
        assert_eq!(found.verdict, Verdict::Tiles);
    }
}

#[test]
fn small_and_flat_maps_tile() {
    for (w, h) in [(1, 1), (1, 9), (2, 2), (3, 50)] {
        let field = HeightField::new(&noise(w * h, 4), w, h, Wrap::Clamp).unwrap();
        for axis in [0, 1] {
            let found = seam(&field, axis);
            let numbers = [found.ratio, found.local, found.rank, found.bend_ratio, found.bend_rank];
            assert!(numbers.iter().all(|v| !v.is_nan()));
        }
        assert_eq!(seam(&field, 0).verdict, Verdict::Tiles, "too few lines to judge");
    }
    let flat = field(8, 8, |_, _| 0.5);
    assert_eq!((seam(&flat, 0).ratio, seam(&flat, 0).verdict), (0.0, Verdict::Tiles));
    assert_eq!(Verdict::Tiles.name(), "tiles");
}

#[test]
fn real_maps_have_the_figures_measured_elsewhere() {
    use Verdict::{Crease, Seam, Tiles};
    // Ratios as the data's own list gives them, to its two digits.
    for (file, channel, x, y, verdicts) in [
        ("ambientcg/rock058/displacement.jpg", 0, 1.13, 1.30, [Tiles, Tiles]),
        ("ambientcg/facade005/displacement.jpg", 0, 0.00, 0.00, [Tiles, Tiles]),
        ("godot/texture_bricks_depth.jpg", 0, 2.21, 1.94, [Tiles, Tiles]),
        ("godot/texture_cheese_depth.png", 0, 2.79, 1.03, [Seam, Seam]),
        ("godot/texture_rock_depth.png", 0, 10.05, 9.14, [Seam, Seam]),
        ("terrain3d/rock023_alb_ht.png", 3, 1.59, 0.75, [Tiles, Tiles]),
        ("terrain3d/mountain1.exr", 0, 0.00, 0.00, [Tiles, Tiles]),
        ("panda3d/heightfield.png", 0, 55.28, 54.32, [Seam, Seam]),
        ("panda3d/layingrock-h.jpg", 0, 0.87, 0.71, [Crease, Crease]),
        ("bevy/parallax_example/cube_depth.png", 0, 0.00, 0.00, [Tiles, Tiles]),
        ("playcanvas/seaside-rocks01-height.jpg", 0, 0.98, 1.22, [Tiles, Tiles]),
        ("paramap_earth/elevation_surface.jpg", 0, 0.27, 137.25, [Tiles, Seam]),
        ("materialx/plain_heightmap.png", 0, 0.44, 0.48, [Tiles, Tiles]),
    ] {
        let Some(image) = data_image(file) else { continue };
        let texels: Vec<f32> =
            image.channel_f32(channel).unwrap().iter().map(|v| v.clamp(0.0, 1.0)).collect();
        let field = HeightField::new(&texels, image.width, image.height, Wrap::Repeat).unwrap();
        for (axis, expected) in [x, y].into_iter().enumerate() {
            let found = seam(&field, axis);
            // Decoders of JPEG files differ by a level here and there.
            let slack = 0.006 + if file.ends_with("jpg") { 0.02 * expected } else { 0.0 };
            assert!((found.ratio - expected).abs() < slack, "{file} {axis}: {} not {expected}", found.ratio);
            assert_eq!(found.verdict, verdicts[axis], "{file} {axis}: {found:?}");
        }
    }
}
