//! What the device tests share.
#![allow(dead_code, missing_docs)]

pub mod agree;
pub mod bridges;
pub mod light;
pub mod shapes;
pub mod truth;

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};
use heightfield::{Extent, HeightField, Wrap};
use mesh::Mesh;
use render::{Camera, Device, Light};

/// The device, or `None` where there is none and none is required.
pub fn device() -> Option<Arc<Device>> {
    match render::device() {
        Ok(device) => Some(device),
        Err(error) if std::env::var("BUMPWGPU_REQUIRE_GPU").is_ok_and(|value| value == "1") => {
            panic!("{error}")
        }
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

/// Random numbers in 0..1 that are the same everywhere (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A periodic sum of waves, rough at all scales.
pub fn fbm(u: f64, v: f64) -> f64 {
    let mut sum = 0.0;
    let mut share = 0.5;
    for octave in 0..5 {
        let f = f64::from(1 << octave) * std::f64::consts::TAU;
        sum += share * 0.5 * ((f * u + 1.3 * f64::from(octave)).sin() * (f * v + 0.7).cos() + 1.0);
        share *= 0.5;
    }
    sum.clamp(0.0, 1.0)
}

/// Thin walls on a plain.
pub fn ridges(u: f64, v: f64) -> f64 {
    let near = |x: f64| ((x * 4.0).fract() - 0.5).abs() < 0.04;
    if near(u) || near(v + 0.3 * u) { 0.95 } else { 0.1 + 0.05 * (9.0 * u).sin().abs() }
}

pub fn field(height: impl Fn(f64, f64) -> f64, size: [usize; 2], wrap: Wrap, extent: Extent) -> HeightField {
    let [w, h] = size;
    let texels: Vec<f32> = (0..w * h)
        .map(|at| height(((at % w) as f64 + 0.5) / w as f64, ((at / w) as f64 + 0.5) / h as f64) as f32)
        .collect();
    HeightField::new(&texels, w, h, wrap).unwrap().with_extent(extent).unwrap()
}

/// A camera in front of the origin that looks along -Z.
pub fn front() -> Camera {
    Camera::look_at(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO)
}

pub fn sun(direction: Vec3) -> Light {
    Light::Directional { direction, color: [1.0; 3], intensity: 0.8 }
}

/// A mesh with MikkTSpace tangents.
pub fn mesh_of(positions: &[Vec3], normals: &[Vec3], uvs: &[Vec2], indices: &[[u32; 3]]) -> Mesh {
    let normals = bytemuck::cast_slice(normals);
    Mesh::from_arrays(
        bytemuck::cast_slice(positions),
        indices,
        bytemuck::cast_slice(uvs),
        Some(normals),
        None,
    )
    .unwrap()
}
