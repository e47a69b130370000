//! Shadows that meshes throw on each other, against rays through the displaced surfaces in double precision.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use common::agree::{from, show};
use common::light::{TEXEL, certain};
use common::shapes::{LIGHT, SIZE, heights, scene_picture};
use common::truth::Truth;
use glam::{DMat4, DQuat, DVec3, Vec3};
use heightfield::HeightField;
use mesh::Mesh;
use rayon::prelude::*;
use render::{Draw, Material};

/// A mesh in the scene: how it looks, and where it stands.
struct Part {
    mesh: Mesh,
    field: Arc<HeightField>,
    place: DMat4,
}

/// A ball with bumps above a plate with bumps, pressed flat, turned and mirrored, and a bare block beside it.
fn parts() -> Vec<Part> {
    let pressed = DMat4::from_scale_rotation_translation(
        DVec3::new(1.1, -0.8, 0.9),
        DQuat::from_rotation_y(0.6),
        DVec3::new(-0.1, 0.1, 0.45),
    );
    let aside = DMat4::from_scale_rotation_translation(
        DVec3::new(0.5, 0.5, 1.5),
        DQuat::from_rotation_z(0.4),
        DVec3::new(0.45, -0.35, 0.2),
    );
    vec![
        Part { mesh: Mesh::quad(1.8).unwrap(), field: heights([48, 48], 0.06, 0.0), place: DMat4::IDENTITY },
        Part { mesh: Mesh::sphere(0.25, 24).unwrap(), field: heights([64, 32], 0.06, 0.5), place: pressed },
        Part { mesh: Mesh::cube(0.4).unwrap(), field: heights([8, 8], 0.0, 0.0), place: aside },
    ]
}

/// The scene in double precision.
struct Judge<'a> {
    parts: &'a [Part],
    truths: Vec<Truth<'a>>,
}

impl Judge<'_> {
    /// Which part a ray meets first, and where.
    fn first_hit(&self, origin: DVec3, direction: DVec3) -> Option<(usize, DVec3)> {
        let hits = self.parts.iter().zip(&self.truths).enumerate().filter_map(|(at, (part, truth))| {
            let inverse = part.place.inverse();
            let hit =
                truth.first_hit(inverse.transform_point3(origin), inverse.transform_vector3(direction))?;
            Some((at, hit.t))
        });
        let (at, t) = hits.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((at, origin + t * direction))
    }

    /// Whether a part is in the way, farther than `clear`.
    fn blocked_by(&self, part: usize, place: DVec3, to_light: DVec3, clear: f64) -> bool {
        let inverse = self.parts[part].place.inverse();
        let direction = inverse.transform_vector3(to_light);
        self.truths[part].blocked(
            inverse.transform_point3(place),
            direction,
            clear * direction.length() / to_light.length(),
        )
    }
}

#[test]
fn reliefs_and_bare_meshes_shade_each_other() {
    let Some(device) = common::device() else { return };
    let parts = parts();
    let materials: Vec<_> = parts.iter().map(|part| Material::new(Arc::clone(&part.field))).collect();
    let truths = parts.iter().map(|part| Truth::new(&part.mesh, &part.field)).collect();
    let judge = Judge { parts: &parts, truths };
    let camera = from([0.5, -1.2, 1.7]);
    let to_light = -LIGHT.as_dvec3().normalize();
    let [corner, right, down] = camera.pixel_directions(SIZE, 0);
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let truth: Vec<_> = (0..pixels)
        .into_par_iter()
        .map(|at| {
            let (x, y) = ((at % SIZE[0] as usize) as f64 + 0.5, (at / SIZE[0] as usize) as f64 + 0.5);
            judge.first_hit(camera.eye, corner + right * x + down * y)
        })
        .collect();
    for (technique, silhouettes) in [("exact", true), ("displacement", false)] {
        let draws = parts.iter().zip(&materials).map(|(part, material)| Draw {
            world_from_object: part.place,
            ..Draw::new(&part.mesh, material)
        });
        let frame = scene_picture(&device, draws.collect(), camera, technique, silhouettes);
        show(&frame, &format!("cast_{technique}"));
        let of = |values: &Option<Vec<f32>>, at: usize| {
            Vec3::from_slice(&values.as_ref().unwrap()[3 * at..]).as_dvec3()
        };
        let (mask, shadow) = (frame.aovs.mask.as_ref().unwrap(), frame.aovs.shadow.as_ref().unwrap());
        let (mut seen, mut by_others, mut alone, mut wrong) = (0, 0, 0, 0);
        for at in 0..pixels {
            let (Some((own, place)), normal) = (truth[at], of(&frame.aovs.normal, at)) else { continue };
            // Micro-polygons show another place where edges in depth are.
            let off = of(&frame.aovs.position, at).distance(place);
            if mask[at] == 0 || off > 0.5 * TEXEL || normal.dot(to_light) < 0.15 {
                continue;
            }
            let blocked = |way, clear| [0, 1, 2].map(|part| judge.blocked_by(part, place, way, clear));
            let by = blocked(to_light, 1e-5);
            let dark = by.contains(&true);
            seen += 1;
            by_others += usize::from(dark && !by[own]);
            // The plate stands first: without the others it would be lit.
            alone += usize::from(!by[0] && dark);
            let any = |way, clear| blocked(way, clear).contains(&true);
            wrong += usize::from(
                dark != (shadow[at] > 0.5) && certain(normal, to_light, off + 0.02 * TEXEL, any).is_some(),
            );
        }
        println!("{technique}: {seen} pixels, {by_others} in the shade of others, {wrong} wrong");
        assert!(seen > 3000 && by_others > 500 && alone > 300, "{technique}: {seen} {by_others} {alone}");
        assert_eq!(wrong, 0, "{technique}");
    }
}
