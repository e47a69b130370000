//! dot3 against a model of the fixed-function pipeline, step by step and in 8 bits.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::sync::Arc;

use bake::{Convention, Kernel, Progress};
use common::{field, front};
use glam::{DVec3, Vec2, Vec3};
use heightfield::{Extent, Wrap};
use mesh::Mesh;
use render::{AovSet, Draw, Light, Material, Request, Scene, TechniqueChoice};

/// The direction of a point of a cube face.
type Direction = Box<dyn Fn(f32, f32) -> Vec3>;

const TEXELS: usize = 16;
const FACE: usize = 64;

fn bytes(v: Vec3) -> Vec3 {
    ((0.5 * v + 0.5) * 255.0).round() / 255.0
}

/// Four neighbours of `place` (in texels, centres at halves) with their shares.
fn bilinear(place: Vec2, read: impl Fn(i64, i64) -> Vec3) -> Vec3 {
    let place = place - 0.5;
    let (cell, within) = (place.floor(), place - place.floor());
    let (x, y) = (cell.x as i64, cell.y as i64);
    let top = read(x, y).lerp(read(x + 1, y), within.x);
    let bottom = read(x, y + 1).lerp(read(x + 1, y + 1), within.x);
    top.lerp(bottom, within.y)
}

/// What a cube map of 8-bit unit vectors answers, by the face of the longest component.
fn cube(direction: Vec3) -> Vec3 {
    let size = direction.abs();
    let longest = size.max_element();
    let at = direction / longest;
    // Right and down on the face, and back, as cube maps are laid out.
    let (s, t, back): (f32, f32, Direction) = if size.x == longest {
        let sign = at.x.signum();
        (-at.z * sign, -at.y, Box::new(move |s, t| Vec3::new(sign, -t, -s * sign)))
    } else if size.y == longest {
        let sign = at.y.signum();
        (at.x, at.z * sign, Box::new(move |s, t| Vec3::new(s, sign, t * sign)))
    } else {
        let sign = at.z.signum();
        (at.x * sign, -at.y, Box::new(move |s, t| Vec3::new(s * sign, -t, sign)))
    };
    let last = FACE as i64 - 1;
    bilinear(Vec2::new(s + 1.0, t + 1.0) * 0.5 * FACE as f32, |x, y| {
        let centre = |i: i64| (2 * i.clamp(0, last) + 1) as f32 / FACE as f32 - 1.0;
        bytes(back(centre(x), centre(y)).normalize())
    })
}

#[test]
fn every_step_is_that_of_the_hardware() {
    let Some(device) = common::device() else { return };
    let mesh = Mesh::quad(1.4).unwrap();
    let extent = Extent { scale: 0.05, base: 1.0, tile_size: [1.4; 2] };
    let waves = |u: f64, v: f64| 0.5 + 0.4 * (12.0 * u).sin() * (9.0 * v).cos();
    let field = Arc::new(field(waves, [TEXELS; 2], Wrap::Clamp, extent));
    let stored: Vec<Vec3> = bake::normal_map(&field, Kernel::Central, Convention::OpenGl, Progress::none())
        .unwrap()
        .chunks_exact(3)
        .map(|n| bytes(Vec3::from_slice(n)))
        .collect();
    let material = Material::new(Arc::clone(&field));
    for lamp in [DVec3::new(0.1, 0.2, 1.5), DVec3::new(-0.3, 0.25, 0.12)] {
        let scene = Scene {
            draws: vec![Draw::new(&mesh, &material)],
            camera: front(),
            lights: vec![Light::Point { position: lamp, color: [1.0; 3], intensity: 0.5 }],
            ambient: [0.0; 3],
            background: [0.0; 4],
        };
        let request = Request {
            aovs: AovSet::UV | AovSet::MASK | AovSet::POSITION,
            ..Request::new(TechniqueChoice::named("dot3").unwrap(), 200, 200)
        };
        let frame = render::render(&device, &scene, &request).unwrap();
        let (uvs, mask) = (frame.aovs.uv.unwrap(), frame.aovs.mask.unwrap());
        let positions = frame.aovs.position.unwrap();
        // 1. At each vertex the unit vector to the light, in the tangent frame: +X, +Y, +Z here.
        let corner = |u: f32, v: f32| {
            let position = DVec3::new(1.4 * f64::from(u - 0.5), 1.4 * f64::from(0.5 - v), 0.0);
            (lamp - position).normalize().as_vec3()
        };
        let (a, b, c, d) = (corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0));
        let (mut off, mut faces) = (Vec::new(), [0usize; 3]);
        let mut told = [0usize; 2];
        for at in (0..mask.len()).filter(|&at| mask[at] == 1) {
            let uv = Vec2::from_slice(&uvs[2 * at..]);
            // 2. Interpolated over the triangle dcb or dba as it is: shorter than 1 between the corners.
            let light = if uv.x + uv.y > 1.0 {
                c + (1.0 - uv.x) * (d - c) + (1.0 - uv.y) * (b - c)
            } else {
                a + uv.x * (b - a) + uv.y * (d - a)
            };
            // 3. Normalised by the cube map, in 8 bits.
            let size = light.abs();
            let axis = (0..3).find(|&i| size[i] == size.max_element()).unwrap();
            faces[axis] += 1;
            let light_8 = cube(light);
            // 4. The 8-bit normal, filtered.
            let last = TEXELS as i64 - 1;
            let normal_8 = bilinear(uv * TEXELS as f32, |x, y| {
                stored[(y.clamp(0, last) * TEXELS as i64 + x.clamp(0, last)) as usize]
            });
            // 5. Both expanded, their product clamped and stored in 8 bits; 6. modulated.
            let dot = (4.0 * (normal_8 - 0.5).dot(light_8 - 0.5)).clamp(0.0, 1.0);
            let diffuse = (dot * 255.0).round() / 255.0;
            let offset = lamp.as_vec3() - Vec3::from_slice(&positions[3 * at..]);
            let expected = (0.5 * diffuse / offset.length_squared()).min(1.0);
            let shown = render::texture::linear_from_srgb(f32::from(frame.color[4 * at]) / 255.0);
            off.push((shown - expected).abs() / (0.5 / offset.length_squared()).max(1.0));
            // Negative controls: step 3 left out, and the light found at the pixel instead of step 2.
            let other = |light: Vec3| (normal_8 * 2.0 - 1.0).dot(light).clamp(0.0, 1.0);
            for (count, light) in told.iter_mut().zip([light, offset.normalize()]) {
                *count += usize::from((other(light) - diffuse).abs() > 6.0 / 255.0);
            }
        }
        off.sort_by(f32::total_cmp);
        let (p99, worst) = (off[off.len() * 99 / 100], off[off.len() - 1]);
        println!(
            "light at {lamp}: {} pixels, p99 {p99}, worst {worst}, faces {faces:?}, {told:?}",
            off.len()
        );
        assert!(off.len() > 10_000);
        let used = faces.iter().filter(|&&count| count > 500).count();
        assert_eq!(used, if lamp.z > 1.0 { 1 } else { 3 }, "pairs of faces: {faces:?}");
        // Measured 0.6 and 2.0 steps of 8 bits, 2.9 at most: software devices filter with 8-bit weights.
        assert!(p99 < 2.5 / 255.0, "p99 {p99}");
        assert!(worst < 4.0 / 255.0, "worst {worst}");
        // From far off the light at the pixel is nearly the interpolated one.
        assert!(told[0] > 1000 && (lamp.z > 1.0 || told[1] > 1000), "shortcuts are told apart: {told:?}");
    }
}
