//! Baked maps against those of other tools. Skipped, saying so, where the data is absent.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use bake::{Convention, Image, Kernel, Progress, normal_map, slopes};
use common::{angle, data_image};
use heightfield::{Extent, HeightField, Wrap};

/// `maketx --bumpslopes --slopefilter centraldiff`: central differences, edges clamped, as half floats.
#[test]
fn slopes_equal_those_of_openimageio() {
    let Some(golden) = data_image("oiio_golden/bumpslope-central.exr") else { return };
    let names = ["b0_h", "b1_dhds", "b2_dhdt", "b3_dhds2", "b4_dhdt2", "b5_dh2dsdt"];
    assert_eq!(golden.names, names);
    let channel = |name| golden.channel_f32(golden.channel_named(name).unwrap()).unwrap();
    let (w, h) = (golden.width, golden.height);
    let field = HeightField::new(&channel("b0_h"), w, h, Wrap::Clamp).unwrap();
    let (s, t) = (channel("b1_dhds"), channel("b2_dhdt"));
    let worst = |kernel, flip: f32| {
        let found = slopes(&field, kernel, Progress::none()).unwrap();
        let error = |at: usize| {
            let [u, v] = found[at];
            (u / w as f32 - s[at]).abs().max((flip * v / h as f32 - t[at]).abs())
        };
        (0..w * h).map(error).fold(0.0, f32::max)
    };
    // Half floats up to 0.5 are 2^-12 apart at most; measured 2.1e-4.
    assert!(worst(Kernel::Central, 1.0) < 2.5e-4, "{}", worst(Kernel::Central, 1.0));
    assert!(worst(Kernel::Central, -1.0) > 0.1, "a flipped v must show");
    assert!(worst(Kernel::Sobel3, 1.0) > 0.1, "another kernel must show");
    assert!(worst(Kernel::Forward, 1.0) > 0.1, "another kernel must show");
}

/// One height map with the normal map that its makers ship, and what a plain bake reaches.
struct Pair {
    height: &'static str,
    channel: usize,
    /// White is low.
    depth: bool,
    normal: &'static str,
    convention: Convention,
    /// Height range in texels, to be fitted nearby.
    texels: f32,
    /// Mean error in degrees that a plain Sobel bake reaches, and that of a flat map.
    reached: f64,
    flat: f64,
}

const PAIRS: [Pair; 7] = [
    Pair {
        height: "godot/texture_cheese_depth.png",
        channel: 0,
        depth: true,
        normal: "godot/texture_cheese_normal.png",
        convention: Convention::OpenGl,
        texels: 7.5,
        reached: 0.39,
        flat: 2.05,
    },
    Pair {
        height: "bevy/parallax_example/cube_depth.png",
        channel: 0,
        depth: true,
        normal: "bevy/parallax_example/cube_normal.png",
        convention: Convention::OpenGl,
        texels: 29.9,
        reached: 6.4,
        flat: 15.6,
    },
    Pair {
        height: "playcanvas/seaside-rocks01-height.jpg",
        channel: 0,
        depth: false,
        normal: "playcanvas/seaside-rocks01-normal.jpg",
        convention: Convention::DirectX,
        texels: 13.4,
        reached: 2.93,
        flat: 6.88,
    },
    Pair {
        height: "ambientcg/rock058/displacement.jpg",
        channel: 0,
        depth: false,
        normal: "ambientcg/rock058/normal.jpg",
        convention: Convention::OpenGl,
        texels: 57.8,
        reached: 4.57,
        flat: 15.5,
    },
    Pair {
        height: "terrain3d/rock023_alb_ht.png",
        channel: 3,
        depth: false,
        normal: "terrain3d/rock023_nrm_rgh.png",
        convention: Convention::OpenGl,
        texels: 40.1,
        reached: 5.74,
        flat: 16.8,
    },
    Pair {
        height: "ambientcg/facade005/displacement.jpg",
        channel: 0,
        depth: false,
        normal: "ambientcg/facade005/normal.jpg",
        convention: Convention::OpenGl,
        texels: 1.1,
        reached: 3.64,
        flat: 5.30,
    },
    Pair {
        height: "panda3d/layingrock-h.jpg",
        channel: 0,
        depth: true,
        normal: "panda3d/layingrock-n.jpg",
        convention: Convention::DirectX,
        texels: 34.6,
        reached: 9.8,
        flat: 51.2,
    },
];

/// The shipped normals at the size of the height map; a map of twice that size is averaged.
fn shipped(image: &Image, width: usize, height: usize) -> Vec<[f64; 3]> {
    let texels = image.to_f32();
    let step = image.width / width;
    assert_eq!((step * width, step * height), (image.width, image.height));
    let decoded = |x: usize, y: usize, c: usize| {
        2.0 * f64::from(texels[(y * image.width + x) * image.channels + c]) - 1.0
    };
    (0..width * height)
        .map(|at| {
            let mut sum = [0.0; 3];
            for k in 0..step * step {
                let (x, y) = (at % width * step + k % step, at / width * step + k / step);
                (0..3).for_each(|c| sum[c] += decoded(x, y, c));
            }
            sum
        })
        .collect()
}

#[test]
fn bakes_come_as_close_to_shipped_normal_maps_as_they_can() {
    for pair in &PAIRS {
        let (Some(heights), Some(normals)) = (data_image(pair.height), data_image(pair.normal)) else {
            continue;
        };
        let (w, h) = (heights.width, heights.height);
        let mut texels = heights.channel_f32(pair.channel).unwrap();
        if pair.depth {
            texels.iter_mut().for_each(|h| *h = 1.0 - *h);
        }
        let shipped = shipped(&normals, w, h);
        let extent = |texels: f32| Extent {
            scale: texels / w as f32,
            base: 1.0,
            tile_size: [1.0, h as f32 / w as f32],
        };
        let mean_error = |texels: &[f32], convention, extent: &Extent| {
            let field = HeightField::new(texels, w, h, Wrap::Repeat).unwrap();
            let field = field.with_extent(*extent).unwrap();
            let map = normal_map(&field, Kernel::Sobel3, convention, Progress::none()).unwrap();
            let error = |(found, &shipped): (&[f32], &[f64; 3])| {
                angle([found[0], found[1], found[2]].map(f64::from), shipped)
            };
            map.chunks_exact(3).zip(&shipped).map(error).sum::<f64>() / (w * h) as f64
        };
        let other = match pair.convention {
            Convention::OpenGl => Convention::DirectX,
            Convention::DirectX => Convention::OpenGl,
        };
        let fit = |best: (f64, f32), step: i32| {
            let texels_high = pair.texels * (1.0 + 0.02 * step as f32);
            let error = mean_error(&texels, pair.convention, &extent(texels_high));
            if error < best.0 { (error, texels_high) } else { best }
        };
        let (reached, texels_high) = (-3..=3).fold((f64::INFINITY, 0.0), fit);
        let extent = extent(texels_high);
        let swapped = mean_error(&texels, other, &extent);
        let inverted: Vec<f32> = texels.iter().map(|h| 1.0 - h).collect();
        let inverted = mean_error(&inverted, pair.convention, &extent);
        let flat = mean_error(&texels, pair.convention, &Extent { scale: 0.0, ..extent });
        println!(
            "{}: {reached:.3} degrees with {texels_high:.1} texels (flat {flat:.2}, green swapped {swapped:.2}, inverted {inverted:.2})",
            pair.height
        );
        // The figures have two decimals and another JPEG decoder behind them.
        assert!(reached < pair.reached * 1.02 + 0.005, "{}: {reached}", pair.height);
        assert!((flat - pair.flat).abs() < pair.flat * 0.02, "{}: flat {flat}", pair.height);
        assert!(swapped > reached * 1.25 && swapped > reached + 0.8, "{}: swapped {swapped}", pair.height);
        assert!(inverted > reached * 1.25 && inverted > flat, "{}: inverted {inverted}", pair.height);
    }
}
