//! Self-shadows of pictures against the f64 oracle.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::{fbm, field, ridges, sun};
use glam::{DVec3, Vec3};
use heightfield::{Extent, Wrap, oracle};
use mesh::Mesh;
use render::{AovSet, Camera, Draw, Material, Request, Scene, TechniqueChoice};

/// Share of pixels whose shadow bit differs from the oracle's; measured: 0 and 0.012 at most.
const TOLERANCE: [(&str, f64); 2] = [("exact", 0.0005), ("relief", 0.03)];

#[test]
fn shadow_bits_agree_with_the_oracle() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.0).unwrap();
    let plateau = |u: f64, v: f64| if (u - 0.5).abs() < 0.2 && (v - 0.4).abs() < 0.1 { 1.0 } else { 0.2 };
    type Map = fn(f64, f64) -> f64;
    let maps: [(&str, Map); 3] = [("fbm", fbm), ("ridges", ridges), ("plateau", plateau)];
    for (name, map) in maps {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let extent = Extent { scale: 0.15, base: 1.0, tile_size: [1.0; 2] };
            let field = Arc::new(field(map, [128, 128], wrap, extent));
            let material = Material::new(Arc::clone(&field));
            for light in [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, 0.2, -0.3)] {
                let scene = Scene {
                    draws: vec![Draw::new(&mesh, &material)],
                    camera: Camera::look_at(DVec3::new(0.2, -0.9, 1.0), DVec3::ZERO),
                    lights: vec![sun(light)],
                    ambient: [0.1; 3],
                    background: [0.0; 4],
                };
                for (technique, tolerance) in TOLERANCE {
                    let aovs = AovSet::UV | AovSet::HEIGHT | AovSet::SHADOW | AovSet::NORMAL | AovSet::MASK;
                    let request = Request {
                        aovs,
                        ..Request::new(TechniqueChoice::named(technique).unwrap(), 200, 160)
                    };
                    let aovs = render::render(&device, &scene, &request).unwrap().aovs;
                    let (uv, shadow, mask) = (aovs.uv.unwrap(), aovs.shadow.unwrap(), aovs.mask.unwrap());
                    let normal = aovs.normal.unwrap();
                    let to_light = [-light.x, light.y, -light.z / 0.15].map(f64::from);
                    let (mut tested, mut differing) = (0.0, 0.0);
                    for at in (0..mask.len()).filter(|&at| mask[at] == 1) {
                        if Vec3::from_slice(&normal[3 * at..]).dot(-light) <= 0.0 {
                            continue;
                        }
                        let (u, v) = (f64::from(uv[2 * at]), f64::from(uv[2 * at + 1]));
                        let blocked = oracle::occluded(&field, [u, v, field.height_at(u, v)], to_light);
                        tested += 1.0;
                        differing += f64::from(u8::from(blocked != (shadow[at] > 0.0)));
                    }
                    let share = differing / tested;
                    println!("{technique} on {name} {wrap:?}: {differing} of {tested} differ, {share:.5}");
                    assert!(tested > 5000.0 && share < tolerance, "{technique} on {name} {wrap:?}: {share}");
                }
            }
        }
    }
}
