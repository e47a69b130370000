//! Meshes with bumps, and pictures of them.
#![allow(dead_code)]

use std::sync::Arc;

use glam::Vec3;
use heightfield::{Extent, HeightField, Wrap};
use mesh::Mesh;
use render::{AovSet, Camera, Draw, Frame, Material, Request, Scene, TechniqueChoice};

use super::{field, sun};

pub const SIZE: [u32; 2] = [132, 108];

/// Bumps that tile, so that a chart may go around.
pub fn bumps(u: f64, v: f64) -> f64 {
    let wave = |x: f64| (std::f64::consts::TAU * x).sin();
    0.5 + 0.3 * wave(6.0 * u) * wave(4.0 * v) + 0.15 * wave(3.0 * u + 5.0 * v)
}

pub fn heights(texels: [usize; 2], scale: f32, base: f32) -> Arc<HeightField> {
    Arc::new(field(bumps, texels, Wrap::Repeat, Extent { scale, base, tile_size: [1.0; 2] }))
}

/// Name, mesh, texels of its map, eye.
pub fn shapes() -> [(&'static str, Mesh, [usize; 2], [f64; 3]); 4] {
    [
        ("quad", Mesh::quad(1.0).unwrap(), [48, 48], [0.7, -0.9, 0.6]),
        ("cube", Mesh::cube(0.8).unwrap(), [48, 48], [1.0, 0.9, 1.4]),
        ("sphere", Mesh::sphere(0.5, 48).unwrap(), [128, 64], [0.3, 0.6, 1.6]),
        ("torus", Mesh::torus(0.45, 0.2, 48, 24).unwrap(), [128, 64], [0.2, 1.1, 1.2]),
    ]
}

/// Where the light of all pictures goes that are not asked for another.
pub const LIGHT: Vec3 = Vec3::new(-0.5, -0.7, -0.6);
/// Light that grazes: 12 degrees above the quad and two sides of the cube.
pub const LOW_LIGHT: Vec3 = Vec3::new(-0.95, -0.25, -0.21);

/// A picture with mask, position, depth, uv, height, normal and shadow.
pub fn picture(
    device: &render::Device,
    mesh: &Mesh,
    field: &Arc<HeightField>,
    camera: Camera,
    technique: &str,
    silhouettes: bool,
) -> Frame {
    let material = Material::new(Arc::clone(field));
    scene_picture(device, vec![Draw::new(mesh, &material)], camera, technique, silhouettes)
}

/// The same of several draws.
pub fn scene_picture(
    device: &render::Device,
    draws: Vec<Draw<'_>>,
    camera: Camera,
    technique: &str,
    silhouettes: bool,
) -> Frame {
    picture_under(device, LIGHT, draws, camera, technique, silhouettes)
}

/// The same in light that goes in some direction.
pub fn picture_under(
    device: &render::Device,
    light: Vec3,
    draws: Vec<Draw<'_>>,
    camera: Camera,
    technique: &str,
    silhouettes: bool,
) -> Frame {
    let scene = Scene { draws, camera, lights: vec![sun(light)], ambient: [0.1; 3], background: [0.0; 4] };
    let places = AovSet::UV | AovSet::POSITION | AovSet::MASK | AovSet::DEPTH | AovSet::HEIGHT;
    let aovs = places | AovSet::NORMAL | AovSet::SHADOW;
    let technique = TechniqueChoice::named(technique).unwrap();
    let request = Request { aovs, silhouettes, ..Request::new(technique, SIZE[0], SIZE[1]) };
    render::render(device, &scene, &request).unwrap()
}
