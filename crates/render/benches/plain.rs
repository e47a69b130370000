//! A scene without relief against a renderer that has never heard of any, and a wall of relief with skipping and
//! without. `cargo bench -p render --bench plain`.
//!
//! The other renderer is in `common/bare.rs`: the same meshes, light, culling of backs and way back of the picture, one
//! program, and nothing that the picture does not need. Both draw in turn, round after round; the best round of each
//! counts, in time and in time that the processors worked (Linux). `ROUNDS` sets the number of rounds.
#![allow(clippy::unwrap_used, missing_docs)]

use std::sync::Arc;
use std::time::Instant;

use glam::{DMat4, DVec3, Vec3};
use heightfield::{Extent, HeightField, Wrap};
use mesh::Mesh;
use render::{Camera, Device, Draw, Light, Material, Renderer, Request, Scene, Skips, TechniqueChoice};

#[path = "common/bare.rs"]
mod bare;
#[path = "common/fractal.rs"]
mod fractal;
#[path = "common/worked.rs"]
mod worked;

use bare::Bare;
use fractal::{SIZE, fractal};
use worked::worked;

const PICTURE: [u32; 2] = [1920, 1080];

/// Best milliseconds by the clock and of the processors.
type Best = [f64; 2];

/// Runs all in turn and keeps the best of each; the first round, which compiles, does not count.
fn in_turn(rounds: usize, ways: &mut [Box<dyn FnMut() + '_>]) -> Vec<Best> {
    let mut best = vec![[f64::INFINITY; 2]; ways.len()];
    for round in 0..=rounds {
        for (way, best) in ways.iter_mut().zip(&mut best) {
            let (worked_before, before) = (worked(), Instant::now());
            way();
            let took = [before.elapsed().as_secs_f64() * 1e3, worked() - worked_before];
            if round > 0 {
                *best = [0, 1].map(|unit| best[unit].min(took[unit]));
            }
        }
    }
    best
}

fn scene(draws: Vec<Draw<'_>>, camera: Camera) -> Scene<'_> {
    let sun = Light::Directional { direction: Vec3::new(-0.6, -0.5, -0.6), color: [1.0; 3], intensity: 0.9 };
    Scene { draws, camera, lights: vec![sun], ambient: [0.1; 3], background: [0.0; 4] }
}

fn print(name: &str, against: Best, best: Best) {
    let [clock, work] = [0, 1].map(|unit| best[unit] / against[unit]);
    println!("{name:44} {:8.1} ms  worked {:8.1} ms   {clock:5.2} and {work:5.2} times", best[0], best[1]);
}

fn plain(device: &Device, name: &str, scene: &Scene<'_>, rounds: usize) {
    let bare = Bare::new(scene, PICTURE);
    let request =
        |technique: &str| Request::new(TechniqueChoice::named(technique).unwrap(), PICTURE[0], PICTURE[1]);
    let techniques = ["flat", "relief", "exact"];
    let mut renderers =
        techniques.map(|technique| Renderer::new(device, scene.clone(), request(technique)).unwrap());
    let expected = bare.render();
    for renderer in &mut renderers {
        let frame = renderer.render(scene.camera).unwrap();
        let off = frame.color.iter().zip(&expected).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert!(off * 1000 < expected.len(), "{name}: {off} of {} bytes differ", expected.len());
    }
    let mut ways: Vec<Box<dyn FnMut()>> = vec![Box::new(|| drop(bare.render()))];
    for renderer in &mut renderers {
        ways.push(Box::new(|| drop(renderer.render(scene.camera).unwrap())));
    }
    let best = in_turn(rounds, &mut ways);
    print(&format!("{name}: a renderer without relief"), best[0], best[0]);
    for (technique, &took) in techniques.iter().zip(&best[1..]) {
        print(&format!("{name}: {technique}, no height map"), best[0], took);
    }
}

fn wall(device: &Device, scene: &Scene<'_>, technique: &str, rounds: usize) {
    let mut renderers = [Skips::NONE, Skips::ALL].map(|skips| {
        let technique = TechniqueChoice::named(technique).unwrap();
        let request = Request { skips, ..Request::new(technique, PICTURE[0], PICTURE[1]) };
        Renderer::new(device, scene.clone(), request).unwrap()
    });
    let mut ways: Vec<Box<dyn FnMut()>> = Vec::new();
    for renderer in &mut renderers {
        ways.push(Box::new(|| drop(renderer.render(scene.camera).unwrap())));
    }
    let best = in_turn(rounds, &mut ways);
    print(&format!("a wall of relief: {technique}, skip=False"), best[0], best[0]);
    print(&format!("a wall of relief: {technique}, skip=True"), best[0], best[1]);
}

fn main() {
    let device = render::device().unwrap();
    let rounds: usize = std::env::var("ROUNDS").map_or(6, |n| n.parse().unwrap());
    let extent = Extent { scale: 0.0, base: 1.0, tile_size: [1.0; 2] };
    let none = HeightField::new(&[1.0], 1, 1, Wrap::Repeat).unwrap().with_extent(extent).unwrap();
    let blank = Material::new(Arc::new(none));
    let quad = Mesh::quad(8.0).unwrap();
    let ball = Mesh::sphere(0.5, 64).unwrap();
    let front = Camera::look_at(DVec3::new(0.1, -0.2, 0.5), DVec3::new(0.15, 0.05, 0.0));
    plain(&device, "a wall", &scene(vec![Draw::new(&quad, &blank)], front), rounds);
    let balls = (0..20).map(|at| {
        let place = DVec3::new(f64::from(at % 5) - 2.0, f64::from(at / 5) - 1.5, -0.3 * f64::from(at % 3));
        Draw { world_from_object: DMat4::from_translation(place), ..Draw::new(&ball, &blank) }
    });
    let camera = Camera::look_at(DVec3::new(0.3, 0.5, 4.0), DVec3::ZERO);
    plain(&device, "twenty balls", &scene(balls.collect(), camera), rounds);
    let extent = Extent { scale: 0.1, base: 1.0, tile_size: [1.0; 2] };
    let rough = HeightField::new(&fractal(), SIZE, SIZE, Wrap::Repeat).unwrap().with_extent(extent).unwrap();
    let rough = Material::new(Arc::new(rough));
    for technique in ["relief", "exact", "steep", "cone"] {
        wall(&device, &scene(vec![Draw::new(&quad, &rough)], front), technique, rounds);
    }
}
