//! Occlusion from a detailed mesh, against closed forms.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::bakes::{UnitSheet, bake, sheet, texel_centre};
use glam::Vec3;
use mesh::{DetailOptions, Mesh, SkyOptions};

fn ao(plain: &Mesh, detail: &Mesh, sky: SkyOptions) -> Vec<f32> {
    let options = DetailOptions {
        width: 16,
        height: 16,
        front: Some(0.2),
        rear: Some(0.2),
        normal: false,
        sky: Some(sky),
        ..DetailOptions::default()
    };
    bake(plain, detail, &options).ao.unwrap()
}

fn rays(rays: u32) -> SkyOptions {
    SkyOptions { rays, ..SkyOptions::default() }
}

/// Several meshes as one; UVs do not matter to a detailed mesh.
fn together(meshes: &[Mesh]) -> Mesh {
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = positions.len() as u32;
        positions.extend(mesh.positions.iter().map(|p| p.to_array()));
        indices.extend(mesh.indices.iter().map(|t| t.map(|i| i + first)));
    }
    let uvs = vec![[0.0; 2]; positions.len()];
    Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap()
}

/// The floor, and a wall along its left edge, `height` high and nearly endless along y.
fn walled(height: f32) -> Mesh {
    let wall = sheet(1, |i, j| Vec3::new(0.0, 400.0 - 800.0 * i as f32, height * j as f32));
    together(&[Mesh::unit_sheet(), wall])
}

/// What a wall at distance `x` leaves open: the form factor of an endless strip, from the horizon up
/// to the elevation `e` of its edge, is (1 - cos e) / 2.
fn open_beside_a_wall(x: f64, height: f64) -> f64 {
    1.0 - (1.0 - x / x.hypot(height)) / 2.0
}

#[test]
fn a_plane_sees_the_whole_sky() {
    let open = ao(&Mesh::unit_sheet(), &Mesh::unit_sheet(), rays(33));
    assert!(open.iter().all(|&a| a == 1.0), "{open:?}");
}

#[test]
fn beside_a_wall_the_form_factor_is_missing() {
    let plain = Mesh::unit_sheet();
    for height in [0.3, 3.0] {
        let detail = walled(height);
        let found = ao(&plain, &detail, rays(1024));
        let worst = |height: f64| {
            (0..256)
                .map(|at| {
                    let [x, _] = texel_centre(at, 16);
                    (f64::from(found[at]) - open_beside_a_wall(x, height)).abs()
                })
                .fold(0.0, f64::max)
        };
        assert!(worst(f64::from(height)) < 0.01, "{height}: {}", worst(f64::from(height)));
        assert!(worst(f64::from(height) * 1.5) > 0.02, "negative control");
    }
}

#[test]
fn few_rays_are_right_on_the_average() {
    let (plain, detail) = (Mesh::unit_sheet(), walled(1.0));
    let found = ao(&plain, &detail, rays(16));
    // Columns of 16 texels at one distance from the wall; each texel has rays of its own.
    for column in 0..16 {
        let mean = (0..16).map(|row| f64::from(found[row * 16 + column])).sum::<f64>() / 16.0;
        let x = (column as f64 + 0.5) / 16.0;
        assert!((mean - open_beside_a_wall(x, 1.0)).abs() < 0.03, "column {column}: {mean}");
    }
}

#[test]
fn inside_a_closed_box_there_is_no_sky_but_far_walls_do_not_count() {
    let mut shell = Mesh::cube(4.0).unwrap();
    shell.indices.iter_mut().for_each(|t| t.swap(1, 2));
    let detail = together(&[Mesh::unit_sheet(), shell]);
    let closed = ao(&Mesh::unit_sheet(), &detail, rays(64));
    assert!(closed.iter().all(|&a| a == 0.0), "{closed:?}");
    let near = SkyOptions { distance: Some(0.9), ..rays(64) };
    assert!(ao(&Mesh::unit_sheet(), &detail, near).iter().all(|&a| a == 1.0));
}

#[test]
fn a_ball_sees_all_of_the_sky_around_it() {
    // Smooth normals lean over flat facets; rays into the facet itself do not count.
    let ball = Mesh::sphere(0.5, 24).unwrap();
    let open = ao(&ball, &ball, rays(64));
    assert!(open.iter().all(|&a| a == 1.0), "{:?}", open.iter().fold(1.0, |a: f32, b| a.min(*b)));
}
