//! Stair steps to slopes: the bound, what is smoothed, what is kept, and how close to the truth it gets.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::f64::consts::TAU;

use bake::repair::{dequantise, quantum};
use bake::{BakeError, Kernel, Progress, normal_map};
use common::{angle, data_image, noise};
use heightfield::{Extent, HeightField, Wrap};
use proptest::prelude::*;

const EIGHT: f64 = 1.0 / 255.0;
const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];

fn field(texels: &[f32], w: usize, h: usize, wrap: Wrap) -> HeightField {
    HeightField::new(texels, w, h, wrap).unwrap()
}

fn smoothed(texels: &[f32], w: usize, h: usize, wrap: Wrap, quantum: f64) -> Vec<f32> {
    dequantise(&field(texels, w, h, wrap), quantum, Progress::none()).unwrap()
}

/// Rounded to `levels` steps, as an image of few bits holds it.
fn rounded(truth: &[f64], levels: f64) -> Vec<f32> {
    truth.iter().map(|h| ((h * levels).round() / levels) as f32).collect()
}

/// Worst and root-mean-square distance, in units of `quantum`.
fn distance(a: &[f32], b: &[f64], quantum: f64) -> (f64, f64) {
    let errors = || a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).abs() / quantum);
    (errors().fold(0.0, f64::max), (errors().map(|e| e * e).sum::<f64>() / a.len() as f64).sqrt())
}

fn wide(texels: &[f32]) -> Vec<f64> {
    texels.iter().map(|&h| f64::from(h)).collect()
}

fn assert_bound(input: &[f32], output: &[f32], levels: f64) {
    for (at, (a, b)) in input.iter().zip(output).enumerate() {
        let (a, b) = (f64::from(*a), f64::from(*b));
        assert!((a - b).abs() <= 0.5 / levels, "texel {at}: {a} became {b}");
        assert!((0.0..=1.0).contains(&b));
        let stored = (b * 65535.0).round() / 65535.0;
        for b in [b, stored] {
            assert_eq!((a * levels).round(), (b * levels).round(), "texel {at}: {a} became {b}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn it_stays_within_half_a_quantum_and_rounds_back(
        w in 1_usize..70,
        h in 1_usize..50,
        seed: u64,
        wrap in prop::sample::select(WRAPS.to_vec()),
        bits in 1_u32..=12,
        smooth in 0.0_f64..1.0,
    ) {
        let levels = f64::from((1_u32 << bits) - 1);
        let rough = noise(w * h, seed);
        let truth: Vec<f64> = rough.iter().enumerate().map(|(at, &n)| {
            let (x, y) = ((at % w) as f64 / w as f64, (at / w) as f64 / h as f64);
            smooth * (0.5 + 0.25 * (TAU * x).sin() + 0.25 * (TAU * y).cos()) + (1.0 - smooth) * f64::from(n)
        }).collect();
        let input = rounded(&truth, levels);
        let output = smoothed(&input, w, h, wrap, 1.0 / levels);
        assert_bound(&input, &output, levels);
    }
}

#[test]
fn terraces_become_slopes() {
    // Ramps whose terraces are 2 to 40 texels wide, across the grid; the map repeats, up and down.
    for (terrace, limit) in [(2.0, 0.12), (7.3, 0.12), (20.0, 0.16), (40.0, 0.16)] {
        let (w, h) = (512, 96);
        let ramp = |at: usize| {
            let x = (at % w) as f64 + 0.5;
            let up = x.min(w as f64 - x);
            0.3 + EIGHT * up / terrace
        };
        let truth: Vec<f64> = (0..w * h).map(ramp).collect();
        let input = rounded(&truth, 255.0);
        let (_, before) = distance(&input, &truth, EIGHT);
        let output = smoothed(&input, w, h, Wrap::Repeat, EIGHT);
        let (_, after) = distance(&output, &truth, EIGHT);
        println!("terraces of {terrace}: {before:.4} to {after:.4}");
        assert!(before > 0.25 && after < limit, "terraces of {terrace}: {before} to {after}");
    }
}

#[test]
fn steps_and_flat_ground_stay() {
    // A block of 40 levels on flat ground, and a pit of 5: nothing here was a slope.
    let (w, h) = (160, 120);
    let texels: Vec<f32> = (0..w * h)
        .map(|at| {
            let (i, j) = (at % w, at / w);
            let block = (30..90).contains(&i) && (20..70).contains(&j);
            let pit = (110..140).contains(&i) && (60..100).contains(&j);
            (100.0 + 40.0 * f32::from(u8::from(block)) - 5.0 * f32::from(u8::from(pit))) / 255.0
        })
        .collect();
    for wrap in WRAPS {
        let (worst, _) = distance(&smoothed(&texels, w, h, wrap, EIGHT), &wide(&texels), EIGHT);
        assert!(worst < 1e-2, "{wrap:?}: {worst} quanta");
    }
    // Black stays black.
    let black = smoothed(&vec![0.0; 64 * 64], 64, 64, Wrap::Repeat, EIGHT);
    assert!(black.iter().all(|&h| h == 0.0));
}

#[test]
fn the_edge_is_no_edge_when_the_map_repeats() {
    // Moved by whole blocks of the coarsest resolution the map gives the same result, moved.
    let (w, h) = (256, 128);
    let wave = |i: usize, j: usize| {
        let (x, y) = (i as f64 / w as f64, j as f64 / h as f64);
        0.5 + 0.06 * (TAU * (x + y)).sin() + 0.03 * (TAU * 2.0 * y).cos()
    };
    let truth = |moved: usize| -> Vec<f64> {
        (0..w * h).map(|at| wave((at % w + moved) % w, (at / w + moved) % h)).collect()
    };
    let (still, moved) = (truth(0), truth(64));
    let one = smoothed(&rounded(&still, 255.0), w, h, Wrap::Repeat, EIGHT);
    let two = smoothed(&rounded(&moved, 255.0), w, h, Wrap::Repeat, EIGHT);
    for (at, two) in two.iter().enumerate() {
        let from = (at / w + 64) % h * w + (at % w + 64) % w;
        assert!((two - one[from]).abs() < 1e-5);
    }
    let (_, error) = distance(&one, &still, EIGHT);
    assert!(error < 0.12, "{error}");
    // Negative control: taken for a map that ends, the seam is worse than the middle.
    let seam = |heights: &[f32]| {
        (0..h).map(|j| (f64::from(heights[j * w]) - still[j * w]).abs() / EIGHT).sum::<f64>() / h as f64
    };
    let ended = smoothed(&rounded(&still, 255.0), w, h, Wrap::Clamp, EIGHT);
    assert!(seam(&ended) > 1.3 * seam(&one), "{} {}", seam(&ended), seam(&one));
}

#[test]
fn threads_do_not_change_a_bit() {
    let texels = rounded(&wide(&noise(90 * 70, 4)), 31.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| smoothed(&texels, 90, 70, Wrap::Repeat, 1.0 / 31.0))
    };
    assert_eq!(run(1), run(3));
}

#[test]
fn quanta_are_found() {
    let quantised = |levels: f64| rounded(&wide(&noise(4000, 2)), levels);
    for levels in [1.0, 3.0, 200.0, 255.0, 256.0, 1023.0, 65535.0] {
        let found = quantum(&quantised(levels)).unwrap();
        assert!((found * levels - 1.0).abs() < 1e-3, "{levels}: {found}");
    }
    // Metres stretched to 0..1, some missing.
    let metres: Vec<f32> = (0..1000_u32).map(|i| (i * i % 840) as f32 / 839.0).collect();
    assert!((quantum(&metres).unwrap() * 839.0 - 1.0).abs() < 1e-3);
    assert_eq!(quantum(&noise(4000, 2)), None);
    assert_eq!(quantum(&[0.25; 9]), None);
    assert_eq!(quantum(&[0.0, 0.1, 0.15, 0.37]), None);
    assert_eq!(quantum(&[0.0, -0.0, 0.5]), Some(0.5));
}

#[test]
fn what_cannot_be_split_stays() {
    let texels = rounded(&wide(&noise(64, 8)), 65535.0);
    assert_eq!(smoothed(&texels, 8, 8, Wrap::Repeat, 1.0 / 65535.0), texels);
    assert_eq!(smoothed(&texels, 8, 8, Wrap::Repeat, f64::NAN), texels);
}

#[test]
fn it_can_be_stopped_and_counts_up() {
    let field = field(&rounded(&wide(&noise(64 * 64, 8)), 255.0), 64, 64, Wrap::Repeat);
    let mut seen = Vec::new();
    let mut note = |done, total| {
        seen.push((done, total));
        true
    };
    dequantise(&field, EIGHT, Progress::new(&mut note)).unwrap();
    assert!(seen.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    assert_eq!(seen.last(), Some(&(64, 64)));
    let mut stop = |done: usize, _: usize| done < 10;
    let stopped = dequantise(&field, EIGHT, Progress::new(&mut stop));
    assert!(matches!(stopped, Err(BakeError::Interrupted)));
}

/// A Gaussian of that many texels, cut off at half a quantum from the data.
fn bounded_gaussian(texels: &[f32], w: usize, h: usize, sigma: f64, half: f64) -> Vec<f32> {
    let reach = (4.0 * sigma).ceil() as i64;
    let taps: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let sum: f64 = taps.iter().sum();
    let blur = |from: &[f64], step: usize, n: usize, at: usize, along: usize| -> f64 {
        let tap = |k: i64| {
            let to = (along as i64 + k).clamp(0, n as i64 - 1) as usize;
            from[at - along * step + to * step]
        };
        (-reach..=reach).zip(&taps).map(|(k, weight)| weight * tap(k)).sum::<f64>() / sum
    };
    let from = wide(texels);
    let across: Vec<f64> = (0..w * h).map(|at| blur(&from, 1, w, at, at % w)).collect();
    let both = (0..w * h).map(|at| blur(&across, w, h, at, at / w));
    both.zip(&from).map(|(b, h)| b.clamp(h - half, h + half) as f32).collect()
}

/// Mean angle between the normals of two sets of heights, in degrees.
fn normal_error(a: &[f32], b: &[f32], w: usize, h: usize) -> f64 {
    let normals = |texels: &[f32]| {
        let extent = Extent { scale: 0.1, ..Extent::default() };
        let field = field(texels, w, h, Wrap::Clamp).with_extent(extent).unwrap();
        normal_map(&field, Kernel::Central, bake::Convention::OpenGl, Progress::none()).unwrap()
    };
    let (a, b) = (normals(a), normals(b));
    let vector = |n: &[f32]| [f64::from(n[0]), f64::from(n[1]), f64::from(n[2])];
    let sum: f64 = a.chunks_exact(3).zip(b.chunks_exact(3)).map(|(a, b)| angle(vector(a), vector(b))).sum();
    sum / (w * h) as f64
}

/// Rounds a terrain of 16 bits or more to 8 and asserts that it comes back better than from the best
/// of some bounded Gaussians, chosen with knowledge of the truth.
fn compare_with_truth(name: &str, channel: usize, most_rms: f64, most_degrees: f64) {
    let Some(image) = data_image(name) else { return };
    let (w, h) = (image.width, image.height);
    let truth: Vec<f32> = image.channel_f32(channel).unwrap().iter().map(|v| v.clamp(0.0, 1.0)).collect();
    let input = rounded(&wide(&truth), 255.0);
    let output = smoothed(&input, w, h, Wrap::Clamp, EIGHT);
    assert_bound(&input, &output, 255.0);
    let judge =
        |heights: &[f32]| (distance(heights, &wide(&truth), EIGHT).1, normal_error(heights, &truth, w, h));
    let (before, after) = (judge(&input), judge(&output));
    let blurred = [0.7, 1.0, 1.5, 2.0].map(|s| judge(&bounded_gaussian(&input, w, h, s, 0.5 * EIGHT)));
    let best = |pick: fn(&(f64, f64)) -> f64| blurred.iter().map(pick).fold(f64::INFINITY, f64::min);
    let best = (best(|b| b.0), best(|b| b.1));
    println!("{name}: quanta, degrees: {before:.4?} to {after:.4?}, best Gaussian {best:.4?}");
    assert!(after.0 < most_rms * before.0 && after.1 < most_degrees * before.1, "{name}");
    assert!(after.0 < 0.95 * best.0 && after.1 < 0.95 * best.1, "{name}: Gaussian {best:?}");
}

#[test]
fn a_terrain_of_16_bits_comes_back() {
    compare_with_truth("panda3d/heightfield.png", 0, 0.75, 0.6);
}

#[test]
fn a_terrain_of_half_floats_comes_back() {
    compare_with_truth("terrain3d/terrain2.exr", 0, 0.75, 0.6);
}

#[test]
fn a_mountain_of_floats_comes_back() {
    compare_with_truth("terrain3d/mountain1.exr", 0, 0.85, 0.85);
}
