//! Relief traced through the shell on models that other people made, against rays through the displaced surface in double
//! precision. They are not part of the project.
//!
//! `cargo test -p render --release --test models -- --ignored --nocapture`

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::path::Path;

use common::agree::{agreement, disproved, row};
use common::shapes::{SIZE, heights, picture};
use common::truth::Truth;
use glam::{DVec3, Vec3};
use mesh::Mesh;
use render::Camera;

/// Height of the relief in shares of the model's size, and pixels that are wrong in all views: one of fuze, raised, goes
/// between a strip, which is straight from cut to cut, and the curve that is its rim, 2e-4 of the relief apart.
const MODELS: [(&str, f64, usize); 5] = [
    ("mikktspace/doomcone_smooth", 0.02, 0),
    ("mikktspace/rancid_geometry", 0.01, 0),
    ("meshoptimizer/pirate", 0.01, 0),
    ("tinyobjloader/map-bump", 0.02, 0),
    ("trimesh/fuze", 0.02, 1),
];

#[test]
#[ignore = "half a minute, and needs real assets"]
fn relief_on_models_of_others_is_the_displaced_surface() {
    let Some(device) = common::device() else { return };
    for (name, share, known) in MODELS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/obj");
        let path = folder.join(format!("{name}.obj"));
        if !path.exists() {
            eprintln!("skipped: {} is not there", path.display());
            continue;
        }
        let mesh = Mesh::open(path).unwrap();
        let low = mesh.positions.iter().fold(Vec3::INFINITY, |low, &place| low.min(place)).as_dvec3();
        let high = mesh.positions.iter().fold(Vec3::NEG_INFINITY, |high, &place| high.max(place)).as_dvec3();
        let (middle, size) = (0.5 * (low + high), (high - low).length());
        let mut wrong = 0;
        for base in [0.0, 1.0] {
            let texels = [64, 64];
            let field = heights(texels, (share * size) as f32, base);
            let judge = Truth::new(&mesh, &field);
            for way in [DVec3::new(0.5, 0.4, 0.9), DVec3::new(-0.8, 0.3, -0.5)] {
                let camera = Camera::look_at(middle + size * 1.1 * way.normalize(), middle);
                let truth = judge.picture(&camera, SIZE);
                let frame = picture(&device, &mesh, &field, camera, "exact", true);
                let found = agreement(&frame, &truth, &camera, texels);
                row(name, base, &found);
                let odd = [found.outline_off.as_slice(), &found.astray].concat();
                assert!(found.both > 500 && found.place_p99 < 0.06, "{name} {base}: {found:?}");
                assert!(found.far < 0.003, "{name} {base}: {found:?}");
                wrong += disproved(&odd, &frame, &judge, &camera);
            }
        }
        assert!(wrong <= known, "{name}: {wrong}");
    }
}
