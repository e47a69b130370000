//! What skipping costs where there is nothing to skip, and saves where there is. `cargo bench -p render --bench skips`.
//!
//! All are drawn in turn, round after round, and the best round counts, of whole pictures of scenes
//! already on the device: in time, and in time that the
//! processors worked for this process (Linux), which on a software device other work on the machine hardly disturbs.
//! "none" is measured twice, first and last: what the two are apart is noise. `ROUNDS` sets the number of rounds, `ONLY`
//! names scenes, `TECHNIQUE` techniques.
#![allow(clippy::unwrap_used, missing_docs)]

use std::sync::Arc;
use std::time::Instant;

use glam::{DMat4, DVec3, Vec3};
use heightfield::{Extent, HeightField, Wrap};
use mesh::Mesh;
use render::{Camera, Device, Draw, Light, Material, Renderer, Request, Scene, Skips, TechniqueChoice};

#[path = "common/fractal.rs"]
mod fractal;
#[path = "common/worked.rs"]
mod worked;

use fractal::{SIZE, fractal};
use worked::worked;

/// Name, and what may be left out.
fn kinds() -> [(&'static str, Skips); 8] {
    [
        ("none", Skips::NONE),
        ("flat", Skips::FLAT),
        ("parallax", Skips::PARALLAX),
        ("range", Skips::RANGE),
        ("shadow", Skips::SHADOW),
        ("all", Skips::ALL),
        ("no flat", Skips::ALL - Skips::FLAT),
        ("none", Skips::NONE),
    ]
}

fn scene(draws: Vec<Draw<'_>>, camera: Camera) -> Scene<'_> {
    let sun = Light::Directional { direction: Vec3::new(-0.6, -0.5, -0.6), color: [1.0; 3], intensity: 0.9 };
    Scene { draws, camera, lights: vec![sun], ambient: [0.1; 3], background: [0.0; 4] }
}

fn row(device: &Device, name: &str, scene: &Scene<'_>, technique: &str, rounds: usize) {
    let kinds = kinds();
    let mut best = [[f64::INFINITY; 2]; 8];
    let mut counts = [""; 8].map(str::to_owned);
    let mut renderers = kinds.map(|(_, skips)| {
        let technique = TechniqueChoice::named(technique).unwrap();
        let request = Request { skips, ..Request::new(technique, 1920, 1080) };
        Renderer::new(device, scene.clone(), request).unwrap()
    });
    // The first round compiles and uploads.
    for round in 0..=rounds {
        for (at, renderer) in renderers.iter_mut().enumerate() {
            let (worked_before, before) = (worked(), Instant::now());
            let stats = renderer.render(scene.camera).unwrap().stats;
            let took = [before.elapsed().as_secs_f64() * 1e3, worked() - worked_before];
            if round > 0 {
                best[at] = [0, 1].map(|unit| best[at][unit].min(took[unit]));
            }
            counts[at] = format!(
                "{:.1} steps, {:.3} shadow rays a pixel, {:?}",
                stats.steps as f64 / stats.pixels_covered as f64,
                stats.shadow_rays as f64 / stats.pixels_covered as f64,
                stats.skipped.iter().filter(|(_, count)| *count > 0).collect::<Vec<_>>()
            );
        }
    }
    for (at, (kind, _)) in kinds.into_iter().enumerate() {
        let [ms, worked] = best[at];
        let less = [0, 1].map(|unit| 100.0 * (best[at][unit] / best[0][unit] - 1.0));
        println!(
            "{name:8} {technique:10} {kind:10} {ms:8.1} ms {:7.2} %   worked {worked:8.1} ms {:7.2} %  {}",
            less[0], less[1], counts[at]
        );
    }
}

fn main() {
    let device = render::device().unwrap();
    let extent = Extent { scale: 0.1, base: 1.0, tile_size: [1.0; 2] };
    let field = Arc::new(
        HeightField::new(&fractal(), SIZE, SIZE, Wrap::Repeat).unwrap().with_extent(extent).unwrap(),
    );
    let wall = Mesh::quad(8.0).unwrap();
    let material = Material::new(Arc::clone(&field));
    let rounds: usize = std::env::var("ROUNDS").map_or(5, |n| n.parse().unwrap());
    let only = std::env::var("ONLY").unwrap_or_default();
    let technique = std::env::var("TECHNIQUE").unwrap_or_else(|_| "relief exact".to_owned());
    let front = Camera::look_at(DVec3::new(0.1, -0.2, 0.5), DVec3::new(0.15, 0.05, 0.0));
    let near = scene(vec![Draw::new(&wall, &material)], front);
    // So low that every ray has to be followed.
    let low = Light::Directional { direction: Vec3::new(-0.9, -0.3, -0.12), color: [1.0; 3], intensity: 0.9 };
    let dusk = Scene { lights: vec![low], ..scene(vec![Draw::new(&wall, &material)], front) };
    // Three near balls, the others in rows behind them, most of them hidden in part.
    let ball = Mesh::sphere(0.5, 64).unwrap();
    let places = (0..20).map(|at| match at {
        0..3 => DVec3::new(f64::from(at - 1) * 1.1, 0.0, 0.0),
        _ => DVec3::new(f64::from(at % 6) * 0.7 - 2.0, 0.1, -14.0 - 6.0 * f64::from(at / 6)),
    });
    let balls = places
        .map(|place| {
            let world_from_object = DMat4::from_translation(place) * DMat4::from_scale(DVec3::splat(0.9));
            Draw { world_from_object, ..Draw::new(&ball, &material) }
        })
        .collect();
    let mixed = scene(balls, Camera::look_at(DVec3::new(0.3, 0.5, 2.6), DVec3::new(0.0, 0.0, -2.0)));
    // A floor to the horizon, with as many texels as there are in a tile.
    let plain = Mesh::quad(200.0).unwrap();
    let floor = scene(
        vec![Draw::new(&plain, &material)],
        Camera::look_at(DVec3::new(0.0, -90.0, 2.0), DVec3::new(0.0, 0.0, -4.0)),
    );
    for technique in technique.split_whitespace() {
        for (name, scene) in [("wall", &near), ("dusk", &dusk), ("floor", &floor), ("mixed", &mixed)] {
            if only.is_empty() || only.split_whitespace().any(|only| only == name) {
                row(&device, name, scene, technique, rounds);
            }
        }
    }
}
