//! Charts in odd places: edges, overlaps, other tiles, no area.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::bakes::{Map, UnitSheet, angle, bake, sheet, texel_centre};
use glam::{DVec2, DVec3, Vec3};
use mesh::{DetailMaps, DetailOptions, Mesh, tangent_map};

/// The height of the detailed surface: a slope, so that every place has a height of its own.
fn slope() -> Mesh {
    sheet(4, |i, j| Vec3::new(i as f32, j as f32, 0.25 * i as f32 + 0.05 * j as f32) / 4.0)
}

fn options(size: usize) -> DetailOptions {
    DetailOptions {
        width: size,
        height: size,
        front: Some(1.0),
        rear: Some(1.0),
        heights: true,
        ..DetailOptions::default()
    }
}

/// The unit square with other UVs.
fn with_uvs(make: impl Fn(DVec2) -> DVec2) -> Mesh {
    let mut mesh = Mesh::unit_sheet();
    for uv in &mut mesh.uvs {
        *uv = make(uv.as_dvec2()).as_vec2();
    }
    mesh
}

/// The height that a place (x, y) of the square has in the map.
fn expected(x: f64, y: f64) -> f64 {
    (0.25 * x + 0.05 * y + 1.0) / 2.0
}

fn heights(maps: &DetailMaps) -> &[f32] {
    maps.heights.as_ref().unwrap()
}

#[test]
fn texels_that_a_chart_only_touches_hold_its_nearest_point() {
    // They look a thousandth of a texel inwards, which is up to a 300th of the smaller chart.
    // A chart of 10.2 x 10.2 texels that begins in the middle of texel 3, and one between centres.
    for (start, side) in [(3.55, 10.2), (3.6, 0.3)] {
        let chart = with_uvs(|p| (p * side + start) / 32.0);
        let maps = bake(&chart, &slope(), &DetailOptions { padding: 0, ..options(32) });
        let mut touched = 0;
        for at in 0..32 * 32 {
            let [u, v] = texel_centre(at, 32).map(|x| (x * 32.0 - start) / side);
            let half = 0.5 / side;
            let meets = |x: f64| x + half > 0.0 && x - half < 1.0;
            let place = [u, v].map(|x| x.clamp(0.0, 1.0));
            let found = f64::from(heights(&maps)[at]);
            if meets(u) && meets(v) {
                let off = (found - expected(place[0], 1.0 - place[1])).abs();
                assert!(off < if side > 1.0 { 2e-5 } else { 1e-3 }, "texel {at}: {off}");
                touched += 1;
            } else {
                assert_eq!(found, 0.5, "texel {at}");
            }
        }
        assert_eq!(maps.report.texels, touched);
        assert_eq!(touched, if side > 1.0 { 121 } else { 1 });
    }
}

#[test]
fn padding_repeats_the_nearest_texel_of_the_chart() {
    let chart = with_uvs(|p| (p * 8.0 + 12.0) / 32.0);
    let maps = bake(&chart, &slope(), &DetailOptions { padding: 5, ..options(32) });
    for at in 0..32 * 32 {
        let [x, y] = [at % 32, at / 32].map(|i| i as i64);
        let [cx, cy] = [x, y].map(|i| i.clamp(12, 19));
        let far = (x - cx).pow(2) + (y - cy).pow(2);
        let found = heights(&maps)[at];
        let nearest = heights(&maps)[(cy * 32 + cx) as usize];
        assert_eq!(found, if far <= 25 { nearest } else { 0.5 }, "texel {at}");
    }
    assert_eq!(maps.report.texels, 64);
}

#[test]
fn overlapping_charts_are_told_and_the_first_one_is_baked() {
    // Two squares, one above the other, on the same UVs.
    let square = Mesh::unit_sheet();
    let mut positions: Vec<[f32; 3]> = square.positions.iter().map(|p| p.to_array()).collect();
    positions.extend(square.positions.iter().map(|p| (*p + Vec3::new(0.0, 0.0, 0.5)).to_array()));
    let uvs: Vec<[f32; 2]> = square.uvs.iter().chain(&square.uvs).map(|t| t.to_array()).collect();
    let second = square.indices.iter().map(|t| t.map(|i| i + 4));
    let indices: Vec<[u32; 3]> = square.indices.iter().copied().chain(second).collect();
    let both = Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap();
    let maps = bake(&both, &slope(), &options(16));
    assert_eq!(maps.report.overlapping, 256);
    assert!(maps.report.warnings.iter().any(|w| w.contains("overlap on 100.0 %")));
    assert_eq!(maps.heights, bake(&square, &slope(), &options(16)).heights);
    // Negative control: charts that only share an edge do not overlap.
    assert_eq!(bake(&square, &slope(), &options(16)).report.overlapping, 0);
}

#[test]
fn charts_of_other_tiles_are_moved_in() {
    let usual = bake(&Mesh::unit_sheet(), &slope(), &options(16));
    assert!(usual.report.warnings.is_empty(), "{:?}", usual.report.warnings);
    for tile in [DVec2::new(1.0, 0.0), DVec2::new(-3.0, 2.0)] {
        let moved = bake(&with_uvs(|p| p + tile), &slope(), &options(16));
        assert_eq!(moved.heights, usual.heights);
        assert!(moved.report.warnings.iter().any(|w| w.contains("2 triangles reach beyond UV 0..1")));
    }
    // Across a border: what leaves on the right comes in on the left.
    let across = bake(&with_uvs(|p| DVec2::new(p.x + 0.5, p.y)), &slope(), &options(16));
    for at in 0..256 {
        let [u, v] = texel_centre(at, 16);
        let x = (u + 0.5).fract();
        assert!((f64::from(heights(&across)[at]) - expected(x, 1.0 - v)).abs() < 1e-6, "texel {at}");
    }
}

#[test]
fn a_copy_moved_away_does_not_cover_the_original() {
    // The same chart twice, the first copy one tile to the right and elsewhere in space.
    let square = Mesh::unit_sheet();
    let far = square.positions.iter().map(|p| (*p + Vec3::new(0.0, 0.0, 0.5)).to_array());
    let positions: Vec<[f32; 3]> = far.chain(square.positions.iter().map(|p| p.to_array())).collect();
    let moved = square.uvs.iter().map(|t| [t.x + 1.0, t.y]);
    let uvs: Vec<[f32; 2]> = moved.chain(square.uvs.iter().map(|t| t.to_array())).collect();
    let second = square.indices.iter().map(|t| t.map(|i| i + 4));
    let indices: Vec<[u32; 3]> = square.indices.iter().copied().chain(second).collect();
    let both = Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap();
    let maps = bake(&both, &slope(), &options(16));
    assert_eq!(maps.heights, bake(&square, &slope(), &options(16)).heights);
    assert_eq!(maps.report.overlapping, 0);
}

#[test]
fn uvs_a_hair_beyond_the_border_lie_inside() {
    let maps = bake(&with_uvs(|p| p * 1.000_004 - 0.000_002), &slope(), &options(16));
    assert!(maps.report.warnings.is_empty(), "{:?}", maps.report.warnings);
}

#[test]
fn triangles_without_an_area_on_the_map_are_left_out() {
    let line = with_uvs(|p| DVec2::splat(p.x));
    let maps = bake(&line, &slope(), &options(16));
    assert_eq!((maps.report.texels, maps.report.rays), (0, 0));
    let told = |text: &str| maps.report.warnings.iter().any(|w| w.contains(text));
    assert!(told("2 triangles have UVs without area") && told("the maps hold nothing"));
    assert!(heights(&maps).iter().all(|&h| h == 0.5));
}

#[test]
fn triangles_over_many_tiles_are_left_out() {
    for scale in [9.0, 1e6, 1e30] {
        let maps = bake(&with_uvs(|p| p * scale), &slope(), &options(8));
        assert_eq!(maps.report.texels, 0, "{scale}");
        assert!(maps.report.warnings.iter().any(|w| w.contains("more than 64 tiles")));
    }
}

#[test]
fn mirrored_uvs_are_baked_as_they_lie() {
    let maps = bake(&with_uvs(|p| DVec2::new(1.0 - p.x, p.y)), &slope(), &options(16));
    for at in 0..256 {
        let [u, v] = texel_centre(at, 16);
        assert!((f64::from(heights(&maps)[at]) - expected(1.0 - u, 1.0 - v)).abs() < 1e-6, "texel {at}");
    }
}

#[test]
fn nothing_but_the_plain_surface_is_left_between_charts() {
    let chart = with_uvs(|p| p * 0.25);
    let tangent = bake(&chart, &slope(), &DetailOptions { padding: 0, ..options(16) });
    assert_eq!(Map(tangent.normal.as_ref().unwrap(), 3).vector(255), DVec3::Z);
    let object = DetailOptions { padding: 0, space: mesh::NormalSpace::Object, ..options(16) };
    let object = bake(&chart, &slope(), &object);
    assert_eq!(Map(object.normal.as_ref().unwrap(), 3).vector(255), DVec3::ZERO);
    assert!(angle(Map(object.normal.as_ref().unwrap(), 3).vector(0), DVec3::new(-0.25, -0.05, 1.0)) < 0.01);
    let frames = tangent_map(&chart, 16, 16, 0, &mut |_, _| true).unwrap();
    assert_eq!(&frames[255 * 4..], [0.0; 4]);
    assert_eq!(&frames[..4], [1.0, 0.0, 0.0, 1.0]);
}
