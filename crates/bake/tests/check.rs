//! What is said of normal maps: baked ones read every way, damaged ones, and real pairs of heights and normals.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use bake::repair::{Axes, Check, check_normals};
use bake::{BakeError, Convention, Kernel, Progress, normal_map};
use common::{data_image, noise};
use heightfield::{Extent, HeightField, Wrap};

use Convention::{DirectX, OpenGl};

fn field(w: usize, h: usize, scale: f32) -> HeightField {
    // Blobs: relief in all directions.
    let spots = noise(60, 5);
    let texels: Vec<f32> = (0..w * h)
        .map(|at| {
            let (u, v) = ((at % w) as f32 / w as f32, (at / w) as f32 / h as f32);
            let sum: f32 = spots
                .chunks_exact(3)
                .map(|s| {
                    let apart = |a: f32, b: f32| (a - b).abs().min(1.0 - (a - b).abs());
                    let square = apart(u, s[0]).powi(2) + apart(v, s[1]).powi(2);
                    (s[2] - 0.4) * (-square / 0.006).exp()
                })
                .sum();
            (0.5 + 0.4 * sum).clamp(0.0, 1.0)
        })
        .collect();
    let extent = Extent { scale, base: 0.0, tile_size: [2.0, 1.0] };
    HeightField::new(&texels, w, h, Wrap::Repeat).unwrap().with_extent(extent).unwrap()
}

fn normals(field: &HeightField) -> Vec<f32> {
    normal_map(field, Kernel::Sobel3, OpenGl, Progress::none()).unwrap()
}

/// The normals as another reading stores them.
fn stored(normals: &[f32], axes: Axes) -> Vec<f32> {
    let store = |n: &[f32]| {
        let y = if axes.convention == OpenGl { n[1] } else { -n[1] };
        if axes.swapped { [y, n[0], n[2]] } else { [n[0], y, n[2]] }
    };
    normals.chunks_exact(3).flat_map(store).collect()
}

fn checked(normals: &[f32], [w, h]: [usize; 2], heights: Option<&HeightField>) -> Check {
    check_normals(normals, w, h, Wrap::Repeat, heights, Progress::none()).unwrap()
}

#[test]
fn every_reading_is_told_with_heights_and_without() {
    let [w, h] = [160, 96];
    let field = field(w, h, 0.2);
    for axes in Axes::ALL {
        let map = stored(&normals(&field), axes);
        let alone = checked(&map, [w, h], None);
        assert_eq!(alone.curl.unwrap().best, axes);
        assert!(alone.curl.unwrap().confidence > 0.8 && alone.curl.unwrap().votes > 0.9, "{:?}", alone.curl);
        assert_eq!(alone.axes().unwrap().0, axes);
        let with = checked(&map, [w, h], Some(&field)).against.unwrap();
        assert_eq!((with.best, with.inverted), (axes, false));
        assert!(with.confidence > 0.99 && (with.scale / 0.2 - 1.0).abs() < 1e-3, "{with:?}");
        assert!(with.mean_error < 0.02 && with.flat_error > 2.0, "{with:?}");
    }
}

#[test]
fn heights_upside_down_are_seen() {
    let [w, h] = [96, 96];
    let field = field(w, h, 0.1);
    let depths: Vec<f32> = field.texels().iter().map(|t| 1.0 - t).collect();
    let depths = HeightField::new(&depths, w, h, Wrap::Repeat).unwrap().with_extent(*field.extent()).unwrap();
    let with = checked(&normals(&field), [w, h], Some(&depths)).against.unwrap();
    assert!(with.inverted && with.best == Axes::ALL[0] && with.mean_error < 0.02);
    // Both axes turned round look the same, as the docs say.
    let turned: Vec<f32> = normals(&field).chunks_exact(3).flat_map(|n| [-n[0], -n[1], n[2]]).collect();
    assert!(checked(&turned, [w, h], Some(&field)).against.unwrap().inverted);
}

#[test]
fn heights_of_another_size_will_do() {
    let fine = field(192, 128, 0.1);
    let coarse = field(96, 64, 0.1);
    for (map, size, heights) in [(normals(&fine), [192, 128], &coarse), (normals(&coarse), [96, 64], &fine)] {
        let with = checked(&map, size, Some(heights)).against.unwrap();
        assert_eq!((with.best, with.inverted), (Axes::ALL[0], false));
        assert!(with.confidence > 0.97 && (with.scale / 0.1 - 1.0).abs() < 0.06, "{with:?}");
    }
}

#[test]
fn what_has_no_evidence_gets_no_verdict() {
    // Noise in both channels is no surface.
    let [w, h] = [128, 128];
    let random: Vec<f32> =
        noise(w * h * 2, 7).chunks_exact(2).flat_map(|c| [c[0] - 0.5, c[1] - 0.5, 1.0]).collect();
    let check = checked(&random, [w, h], Some(&field(w, h, 0.1)));
    assert_eq!(check.axes(), None);
    assert!(check.curl.unwrap().share.iter().all(|s| (0.9..1.1).contains(s)));
    assert!(check.against.unwrap().confidence < 0.1);
    // A flat map has none at all, nor has a single texel.
    let flat: Vec<f32> = (0..w * h).flat_map(|_| [0.0, 0.0, 1.0]).collect();
    assert_eq!(checked(&flat, [w, h], Some(&field(w, h, 0.1))).curl, None);
    assert_eq!(checked(&flat[..3], [1, 1], None).axes(), None);
    // Waves along one axis fit any green channel.
    let ridges = (0..w * h).map(|at| 0.5 + 0.4 * ((at % w) as f32 * 0.3).sin()).collect::<Vec<_>>();
    let ridges = HeightField::new(&ridges, w, h, Wrap::Clamp).unwrap();
    assert_eq!(checked(&normals(&ridges), [w, h], Some(&ridges)).axes(), None);
}

#[test]
fn lengths_are_told() {
    let map = [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [0.0, 0.0, 0.5], [0.0, 0.6, -0.8]].concat();
    let lengths = checked(&map, [2, 2], None).lengths;
    assert!((lengths.mean - 0.875).abs() < 1e-7 && lengths.least == 0.5 && (lengths.most - 1.0).abs() < 1e-7);
    assert_eq!((lengths.off, lengths.inward), (0.25, 0.25));
}

#[test]
fn wrong_shapes_are_refused() {
    for (w, h, n) in [(2, 2, 11), (0, 1, 0), (usize::MAX, 2, 6)] {
        let refused = check_normals(&vec![0.5; n], w, h, Wrap::Clamp, None, Progress::none());
        assert!(matches!(refused, Err(BakeError::Shape { .. })));
    }
}

#[test]
fn real_pairs_are_judged_as_measured_elsewhere() {
    // Folder, heights and their channel, normals, green, depth map?, fitted k in texels and mean error.
    let pairs = [
        ("godot/texture_cheese_depth.png", 0, "godot/texture_cheese_normal.png", OpenGl, true, 7.5, 0.39),
        (
            "bevy/parallax_example/cube_depth.png",
            0,
            "bevy/parallax_example/cube_normal.png",
            OpenGl,
            true,
            29.9,
            6.4,
        ),
        (
            "playcanvas/seaside-rocks01-height.jpg",
            0,
            "playcanvas/seaside-rocks01-normal.jpg",
            DirectX,
            false,
            13.4,
            2.93,
        ),
        ("ambientcg/rock058/displacement.jpg", 0, "ambientcg/rock058/normal.jpg", OpenGl, false, 57.8, 4.57),
        ("terrain3d/rock023_alb_ht.png", 3, "terrain3d/rock023_nrm_rgh.png", OpenGl, false, 40.1, 5.74),
        (
            "ambientcg/facade005/displacement.jpg",
            0,
            "ambientcg/facade005/normal.jpg",
            OpenGl,
            false,
            1.1,
            3.64,
        ),
        ("panda3d/layingrock-h.jpg", 0, "panda3d/layingrock-n.jpg", DirectX, true, 34.6, 9.8),
        ("godot/texture_bricks_depth.jpg", 0, "godot/texture_bricks_normal.jpg", OpenGl, true, 0.0, 0.0),
    ];
    for (heights, channel, normals, green, depth, k, degrees) in pairs {
        let (Some(h), Some(n)) = (data_image(heights), data_image(normals)) else { continue };
        // Texels as the unit of length: the scale is in texels.
        let extent = Extent { tile_size: [h.width as f32, h.height as f32], ..Extent::default() };
        let field = HeightField::new(&h.channel_f32(channel).unwrap(), h.width, h.height, Wrap::Repeat);
        let field = field.unwrap().with_extent(extent).unwrap();
        let map: Vec<f32> = n
            .to_f32()
            .chunks_exact(n.channels)
            .flat_map(|t| [t[0], t[1], t[2]].map(|c| 2.0 * c - 1.0))
            .collect();
        let check = checked(&map, [n.width, n.height], Some(&field));
        let (curl, with) = (check.curl.unwrap(), check.against.unwrap());
        println!(
            "{normals}: curl {:.3?} {:.2} {:.2}; heights {:.2?} {:.2}, k {:.1}, {:.2} of {:.2} degrees; length {:.3}",
            curl.share,
            curl.confidence,
            curl.votes,
            with.correlation,
            with.confidence,
            with.scale,
            with.mean_error,
            with.flat_error,
            check.lengths.mean,
        );
        let axes = Axes { convention: green, swapped: false };
        assert_eq!((curl.best, curl.decides()), (axes, true), "{normals}: {curl:?}");
        assert_eq!((with.best, with.inverted, with.decides()), (axes, depth, true), "{normals}: {with:?}");
        if k > 0.0 {
            // Ribs with vertical walls fit many scales about as badly.
            let slack = if k < 2.0 { 0.3 } else { 0.1 };
            assert!((with.scale / k - 1.0).abs() < slack, "{normals}: {} not {k}", with.scale);
            assert!(
                (with.mean_error / degrees - 1.0).abs() < 0.1,
                "{normals}: {} not {degrees}",
                with.mean_error
            );
        }
        // Negative control: the same map with its green channel turned.
        let other = if green == OpenGl { DirectX } else { OpenGl };
        let turned: Vec<f32> = map.chunks_exact(3).flat_map(|t| [t[0], -t[1], t[2]]).collect();
        let small = (n.width < 600).then_some(&field);
        let check = checked(&turned, [n.width, n.height], small);
        assert_eq!(check.curl.unwrap().best.convention, other, "{normals}");
        assert!(check.against.is_none_or(|with| with.best.convention == other), "{normals}");
    }
    // The cobbles of this set were made from something else.
    let (Some(h), Some(n)) =
        (data_image("godot/texture_rock_depth.png"), data_image("godot/texture_rock_normal.png"))
    else {
        return;
    };
    let field = HeightField::new(&h.channel_f32(0).unwrap(), h.width, h.height, Wrap::Repeat).unwrap();
    let map: Vec<f32> =
        n.to_f32().chunks_exact(n.channels).flat_map(|t| [t[0], t[1], t[2]].map(|c| 2.0 * c - 1.0)).collect();
    let check = checked(&map, [n.width, n.height], Some(&field));
    assert!(!check.against.unwrap().decides(), "{:?}", check.against);
    assert!(!check.curl.unwrap().decides(), "{:?}", check.curl);
}
