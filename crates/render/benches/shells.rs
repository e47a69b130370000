//! What ways to draw a displaced mesh cost, and how far from it they are. `cargo bench -p render --bench shells`.
//!
//! Times are of whole pictures of 512 x 512 pixels of scenes already on the device, the best of `ROUNDS` (3) that take
//! turns, and the time that processors worked for them (Linux), without shadows and with. Differences are to rays through
//! the displaced surface in double precision, on small pictures: "outline": pixels covered in only one of the two although
//! the outline is more than a pixel away; "place": distance between what is seen, pixels, ninety-ninth percentile away
//! from jumps in depth. `ONLY` names meshes.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs)]

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "common/worked.rs"]
mod worked;

use std::time::Instant;

use common::agree::{agreement, from};
use common::shapes::{LIGHT, heights, picture, shapes};
use common::sun;
use common::truth::Truth;
use render::{Draw, Material, Renderer, Request, Scene, TechniqueChoice};
use worked::worked;

/// Name, technique, and whether rays go through the shell.
const WAYS: [(&str, &str, bool); 4] = [
    ("displacement", "displacement", false),
    ("shell", "exact", true),
    ("straight rays", "exact", false),
    ("parallax occlusion", "pom", false),
];
const SIDE: u32 = 512;

fn main() {
    let device = render::device().unwrap();
    let rounds: usize = std::env::var("ROUNDS").map_or(3, |n| n.parse().unwrap());
    let only = std::env::var("ONLY").unwrap_or_default();
    println!("| mesh | base | way | ms | worked | with shadows, ms | worked | outline | place |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let wanted = |name: &str| only.is_empty() || only.split_whitespace().any(|only| only == name);
    for (name, mesh, texels, eye) in shapes().into_iter().filter(|(name, ..)| wanted(name)) {
        for base in [0.0, 1.0] {
            let (field, camera) = (heights(texels, 0.08, base), from(eye));
            let material = Material::new(std::sync::Arc::clone(&field));
            let truth = Truth::new(&mesh, &field).picture(&camera, common::shapes::SIZE);
            let mut pictures: Vec<_> = WAYS
                .iter()
                .flat_map(|way| [(way, false), (way, true)])
                .map(|((_, technique, silhouettes), shadows)| {
                    let scene = Scene {
                        draws: vec![Draw::new(&mesh, &material)],
                        camera,
                        lights: vec![sun(LIGHT)],
                        ambient: [0.1; 3],
                        background: [0.0; 4],
                    };
                    let request = Request {
                        silhouettes: *silhouettes,
                        shadows: Some(shadows),
                        ..Request::new(TechniqueChoice::named(technique).unwrap(), SIDE, SIDE)
                    };
                    (Renderer::new(&*device, scene, request).unwrap(), [f64::INFINITY; 2])
                })
                .collect();
            // The first round compiles and uploads.
            for round in 0..=rounds {
                for (renderer, best) in &mut pictures {
                    let (worked_before, before) = (worked(), Instant::now());
                    renderer.render(camera).unwrap();
                    let took = [before.elapsed().as_secs_f64() * 1e3, worked() - worked_before];
                    if round > 0 {
                        *best = [0, 1].map(|unit| best[unit].min(took[unit]));
                    }
                }
            }
            for ((way, technique, silhouettes), times) in WAYS.iter().zip(pictures.chunks(2)) {
                let frame = picture(&device, &mesh, &field, camera, technique, *silhouettes);
                let found = agreement(&frame, &truth, &camera, texels);
                let [[plain, worked], [shaded, worked_shaded]] = [times[0].1, times[1].1];
                println!(
                    "| {name} | {base} | {way} | {plain:.0} | {worked:.0} | {shaded:.0} | {worked_shaded:.0} | {} | {:.3} |",
                    found.outline_off.len(),
                    found.place_p99
                );
            }
        }
    }
}
