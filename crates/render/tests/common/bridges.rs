//! What lies between triangles that are displaced each for itself, in double precision: along each edge whose sides
//! differ, strips from where a side goes to where all of them meet, by the mean of their heights along the mean of
//! their normals.
#![allow(dead_code)]

use std::collections::HashMap;

use glam::{DMat3, DVec2, DVec3};
use heightfield::HeightField;
use mesh::Mesh;

/// Pieces along a texel.
const PIECES: f64 = 4.0;

type Place = [u32; 3];
/// UV and normal.
type Seen = (DVec2, DVec3);
/// Places and UVs of its corners.
type Triangle = ([DVec3; 3], [DVec2; 3]);
/// How the sides of an edge see its ends, and which of them run along it backwards.
type Sides = (Vec<[Seen; 2]>, Vec<bool>);

#[derive(Default)]
pub struct Bridges {
    /// Triangles of one strip with the box around them.
    strips: Vec<([DVec3; 2], Vec<Triangle>)>,
}

fn meeting(field: &HeightField, position: DVec3, seen: &[Seen]) -> DVec3 {
    let extent = field.extent();
    let count = seen.len() as f64;
    let height = seen.iter().map(|(uv, _)| field.height_at(uv.x, uv.y)).sum::<f64>() / count;
    let normal: DVec3 = seen.iter().map(|(_, normal)| normal.normalize()).sum();
    position + f64::from(extent.scale) * (height - f64::from(extent.base)) * normal.normalize_or_zero()
}

fn push(known: &mut Vec<[Seen; 2]>, ends: [Seen; 2]) -> bool {
    let new = !known.contains(&ends);
    if new {
        known.push(ends);
    }
    new
}

impl Bridges {
    pub fn new(mesh: &Mesh, field: &HeightField) -> Self {
        let place = |at: u32| -> Place { (mesh.positions[at as usize] + 0.0).to_array().map(f32::to_bits) };
        let seen = |at: u32| (mesh.uvs[at as usize].as_dvec2(), mesh.normals[at as usize].as_dvec3());
        let mut around: HashMap<Place, Vec<Seen>> = HashMap::new();
        let mut edges: HashMap<[Place; 2], Sides> = HashMap::new();
        for triangle in &mesh.indices {
            for k in 0..3 {
                let (mut a, mut b) = (triangle[k], triangle[(k + 1) % 3]);
                let here = around.entry(place(a)).or_default();
                if !here.contains(&seen(a)) {
                    here.push(seen(a));
                }
                let backwards = place(a) > place(b);
                if backwards {
                    (a, b) = (b, a);
                }
                let (sides, turned) = edges.entry([place(a), place(b)]).or_default();
                if push(sides, [seen(a), seen(b)]) {
                    turned.push(backwards);
                }
            }
        }
        let mut strips = Vec::new();
        for (ends, (sides, turned)) in edges.iter().filter(|(_, (sides, _))| sides.len() > 1) {
            let [a, b] = ends.map(|end| glam::Vec3::from(end.map(f32::from_bits)).as_dvec3());
            let at = |side: &[Seen; 2], s: f64| (side[0].0.lerp(side[1].0, s), side[0].1.lerp(side[1].1, s));
            let texels = DVec2::new(field.width() as f64, field.height() as f64);
            let longest = sides.iter().map(|s| ((s[1].0 - s[0].0) * texels).length()).fold(1.0, f64::max);
            let pieces = (longest * PIECES).ceil() as u32;
            for (side, &backwards) in sides.iter().zip(turned) {
                let points = |k: u32| {
                    let s = f64::from(k) / f64::from(pieces);
                    let position = a.lerp(b, s);
                    let all: Vec<Seen> = match k {
                        0 => around[&ends[0]].clone(),
                        k if k == pieces => around[&ends[1]].clone(),
                        _ => sides.iter().map(|side| at(side, s)).collect(),
                    };
                    let own = at(side, s);
                    (meeting(field, position, &[own]), meeting(field, position, &all), own.0)
                };
                let mut triangles = Vec::new();
                let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
                for k in 0..pieces {
                    let (own, meets, uv) = points(k);
                    let (own_next, meets_next, uv_next) = points(k + 1);
                    for point in [own, meets, own_next, meets_next] {
                        bounds = [bounds[0].min(point), bounds[1].max(point)];
                    }
                    let mut both = [
                        ([own_next, own, meets], [uv_next, uv, uv]),
                        ([own_next, meets, meets_next], [uv_next, uv, uv_next]),
                    ];
                    if backwards {
                        both.iter_mut().for_each(|(places, uvs)| {
                            places.swap(0, 1);
                            uvs.swap(0, 1);
                        });
                    }
                    triangles.extend(both);
                }
                strips.push((bounds, triangles));
            }
        }
        Self { strips }
    }

    /// The nearest hit before `last`: how far, and the UV there. Strips are there from in front only: for the
    /// eye, and `to_light`, for the light at the end of the ray.
    pub fn first(&self, origin: DVec3, direction: DVec3, to_light: bool, last: f64) -> Option<(f64, DVec2)> {
        let inverse = direction.recip();
        let mut nearest = None;
        let mut last = last;
        for ([low, high], triangles) in &self.strips {
            let (a, b) = ((*low - 1e-9 - origin) * inverse, (*high + 1e-9 - origin) * inverse);
            if a.min(b).max_element().max(0.0) > a.max(b).min_element().min(last) {
                continue;
            }
            for ([a, b, c], uvs) in triangles {
                let normal = (*b - *a).cross(*c - *a);
                let narrow = normal.length() < 1e-12;
                if narrow || (normal.dot(direction) < 0.0) == to_light {
                    continue;
                }
                let s = DMat3::from_cols(*b - *a, *c - *a, -direction).inverse() * (origin - *a);
                if s.x >= -1e-9 && s.y >= -1e-9 && s.x + s.y <= 1.0 + 1e-9 && s.z > 0.0 && s.z < last {
                    last = s.z;
                    nearest = Some((s.z, uvs[0] * (1.0 - s.x - s.y) + uvs[1] * s.x + uvs[2] * s.y));
                }
            }
        }
        nearest
    }
}
