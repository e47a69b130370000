//! A rendered relief against the same surface truly displaced.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::{field, mesh_of, sun};
use glam::{DVec3, Vec2, Vec3};
use heightfield::{Extent, HeightField, Wrap};
use mesh::Mesh;
use render::{AovSet, Camera, Draw, Frame, Material, Request, Scene, TechniqueChoice};

const TEXELS: usize = 64;

fn hills(u: f64, v: f64) -> f64 {
    let wave = |x: f64| (std::f64::consts::TAU * x).sin();
    0.5 + 0.25 * wave(2.0 * u) * wave(v) + 0.2 * wave(u + 2.0 * v)
}

/// The surface as triangles: 4 x 4 vertices a texel, on the bilinear surface.
fn displaced(field: &HeightField) -> Mesh {
    let n = 4 * TEXELS;
    let extent = field.extent();
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for j in 0..=n {
        for i in 0..=n {
            let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
            let z = f64::from(extent.scale) * (field.height_at(u, v) - f64::from(extent.base));
            positions.push(DVec3::new(u - 0.5, 0.5 - v, z).as_vec3());
            normals.push(Vec3::Z);
            uvs.push(DVec3::new(u, v, 0.0).as_vec3().truncate());
        }
    }
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    for j in 0..n {
        for i in 0..n {
            indices.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            indices.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    mesh_of(&positions, &normals, &uvs, &indices)
}

fn picture(
    device: &render::Device,
    mesh: &Mesh,
    material: &Material,
    camera: Camera,
    technique: &str,
) -> Frame {
    let scene = Scene {
        draws: vec![Draw::new(mesh, material)],
        camera,
        lights: vec![sun(Vec3::new(0.3, -0.4, -1.0))],
        ambient: [0.1; 3],
        background: [0.0; 4],
    };
    let aovs = AovSet::UV | AovSet::POSITION | AovSet::MASK | AovSet::DEPTH;
    let request = Request {
        aovs,
        // Nothing is left out: compared more closely than what skipping may be off.
        skips: render::Skips::NONE,
        ..Request::new(TechniqueChoice::named(technique).unwrap(), 160, 120)
    };
    render::render(device, &scene, &request).unwrap()
}

#[test]
fn a_relief_is_the_displaced_surface() {
    let Some(device) = common::device() else { return };
    let quad = Mesh::quad(1.0).unwrap();
    for base in [1.0, 0.4] {
        let extent = Extent { scale: 0.1, base, tile_size: [1.0; 2] };
        let field = Arc::new(field(hills, [TEXELS; 2], Wrap::Repeat, extent));
        let triangles = displaced(&field);
        let material = Material::new(field);
        for eye in [DVec3::new(0.3, -0.2, 1.5), DVec3::new(-0.6, -1.0, 0.9), DVec3::new(0.2, 1.3, 0.5)] {
            let camera = Camera::look_at(eye, DVec3::ZERO);
            let truth = picture(&device, &triangles, &material, camera, "flat");
            for (technique, tolerance) in [("exact", 0.05), ("relief", 0.5)] {
                let relief = picture(&device, &quad, &material, camera, technique);
                let uv =
                    |frame: &Frame, at: usize| Vec2::from_slice(&frame.aovs.uv.as_ref().unwrap()[2 * at..]);
                let both = (0..160 * 120).filter(|&at| {
                    truth.aovs.mask.as_ref().unwrap()[at] == 1 && relief.aovs.mask.as_ref().unwrap()[at] == 1
                });
                // Away from the rim, where the quad ends and the relief goes on.
                let inside = both.filter(|&at| {
                    let uv = uv(&truth, at);
                    uv.min_element() > 0.05 && uv.max_element() < 0.95
                });
                let mut errors: Vec<f32> =
                    inside.map(|at| uv(&truth, at).distance(uv(&relief, at)) * TEXELS as f32).collect();
                errors.sort_by(f32::total_cmp);
                let p99 = errors[errors.len() * 99 / 100];
                println!("{technique} base {base} from {eye}: {} pixels, p99 {p99} texels", errors.len());
                assert!(errors.len() > 2000, "{} pixels", errors.len());
                assert!(p99 < tolerance, "{technique} base {base} from {eye}: p99 {p99} texels");
            }
            // A technique that does not displace must be found out.
            let bump = picture(&device, &quad, &material, camera, "bump");
            let apart = (0..160 * 120).filter(|&at| {
                let place =
                    |frame: &Frame| Vec3::from_slice(&frame.aovs.position.as_ref().unwrap()[3 * at..]);
                truth.aovs.mask.as_ref().unwrap()[at] == 1 && place(&truth).distance(place(&bump)) > 0.005
            });
            assert!(apart.count() > 1000);
        }
    }
}
