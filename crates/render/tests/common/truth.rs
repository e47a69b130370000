//! Rays against a displaced mesh in double precision: the judge of displacement and of relief in the shell.
//!
//! Knows nothing of tessellation in pixels nor of shells. Each triangle is cut into a tree of micro-triangles a
//! quarter of a texel wide, with a box around each branch; what a ray meets there is polished by Newton's
//! method on the surface itself, P + scale (h - base) N / |N|. What stands out of micro-triangles, crests between texels, is
//! met by rays that look more finely. Where triangles along an edge differ in UVs or normals,
//! strips close what lies between them (`bridges.rs`).
#![allow(dead_code)]

use glam::{DMat2, DMat3, DVec2, DVec3};
use heightfield::HeightField;
use mesh::Mesh;
use rayon::prelude::*;
use render::Camera;

use super::bridges::Bridges;

pub struct Truth<'a> {
    field: &'a HeightField,
    faces: Vec<Face>,
    bridges: Bridges,
}

/// Where a ray meets the surface first, from outside.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    pub t: f64,
    pub position: DVec3,
    pub uv: DVec2,
    pub height: f64,
}

struct Face {
    positions: [DVec3; 3],
    normals: [DVec3; 3],
    uvs: [DVec2; 3],
    depth: u32,
    /// The largest box around a micro-triangle, corner to corner: the surface stands out of them by less.
    largest: f64,
    /// Low and high corner of each branch; children of `i` are `4 i + 1` to `4 i + 4`.
    boxes: Vec<[DVec3; 2]>,
}

type Weights = DVec3;

fn children([a, b, c]: [Weights; 3]) -> [[Weights; 3]; 4] {
    let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

fn mix<T: std::ops::Mul<f64, Output = T> + std::ops::Add<Output = T> + Copy>(v: &[T; 3], w: Weights) -> T {
    v[0] * w.x + v[1] * w.y + v[2] * w.z
}

/// How far along the second and third side of a micro-triangle.
fn shares([a, b, c]: [Weights; 3], w: Weights) -> (f64, f64) {
    let flat = |w: Weights| DVec2::new(w.y, w.z);
    let shares = DMat2::from_cols(flat(b - a), flat(c - a)).inverse() * flat(w - a);
    (shares.x, shares.y)
}

impl Face {
    fn uv(&self, w: Weights) -> DVec2 {
        mix(&self.uvs, w)
    }

    fn point(&self, field: &HeightField, w: Weights) -> DVec3 {
        let extent = field.extent();
        let uv = self.uv(w);
        let rise = f64::from(extent.scale) * (field.height_at(uv.x, uv.y) - f64::from(extent.base));
        mix(&self.positions, w) + rise * mix(&self.normals, w).normalize()
    }

    fn build(&mut self, field: &HeightField, at: usize, corners: [Weights; 3], depth: u32) -> [DVec3; 2] {
        let mut around = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let mut add = |[low, high]: [DVec3; 2]| {
            around = [around[0].min(low), around[1].max(high)];
        };
        if depth == 0 {
            for corner in corners {
                let point = self.point(field, corner);
                add([point, point]);
            }
        } else {
            for (child, corners) in children(corners).into_iter().enumerate() {
                add(self.build(field, 4 * at + 1 + child, corners, depth - 1));
            }
        }
        if depth == 0 {
            self.largest = self.largest.max((around[1] - around[0]).length());
        }
        let slack = DVec3::splat(1e-12);
        self.boxes[at] = [around[0] - slack, around[1] + slack];
        self.boxes[at]
    }
}

fn enters([low, high]: [DVec3; 2], origin: DVec3, inverse: DVec3, nearest: f64) -> bool {
    let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
    let (enter, leave) = (a.min(b).max_element().max(0.0), a.max(b).min_element().min(nearest));
    enter <= leave
}

impl<'a> Truth<'a> {
    pub fn new(mesh: &Mesh, field: &'a HeightField) -> Self {
        let texels = DVec2::new(field.width() as f64, field.height() as f64);
        let faces = mesh
            .indices
            .par_iter()
            .map(|triangle| {
                let corners = triangle.map(|at| at as usize);
                let uvs = corners.map(|at| mesh.uvs[at].as_dvec2());
                let longest =
                    (0..3).map(|e| ((uvs[(e + 1) % 3] - uvs[e]) * texels).length()).fold(0.0, f64::max);
                let depth = (longest * 4.0).max(1.0).log2().ceil() as u32;
                let mut face = Face {
                    positions: corners.map(|at| mesh.positions[at].as_dvec3()),
                    normals: corners.map(|at| mesh.normals[at].as_dvec3()),
                    uvs,
                    depth,
                    largest: 0.0,
                    boxes: vec![[DVec3::ZERO; 2]; ((4_usize << (2 * depth)) - 1) / 3],
                };
                face.build(field, 0, [DVec3::X, DVec3::Y, DVec3::Z], depth);
                face
            })
            .collect();
        Self { field, faces, bridges: Bridges::new(mesh, field) }
    }

    /// The nearest place where the ray comes down through the surface.
    pub fn first_hit(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        self.first(origin, direction, false, 0)
    }

    /// `halvings`: how often the sides of micro-triangles are halved, which is done for the ray alone.
    fn first(&self, origin: DVec3, direction: DVec3, to_light: bool, halvings: u32) -> Option<Hit> {
        let inverse = direction.recip();
        let mut nearest: Option<Hit> = None;
        let mut stack = Vec::new();
        for face in &self.faces {
            let wider = if halvings > 0 { DVec3::splat(face.largest) } else { DVec3::ZERO };
            stack.push((0, [DVec3::X, DVec3::Y, DVec3::Z], face.depth + halvings));
            while let Some((at, corners, depth)) = stack.pop() {
                let around = face.boxes.get(at).map(|[low, high]| [*low - wider, *high + wider]);
                let last = nearest.map_or(f64::INFINITY, |hit| hit.t);
                if around.is_some_and(|around| !enters(around, origin, inverse, last)) {
                    continue;
                }
                if depth > 0 {
                    for (child, corners) in children(corners).into_iter().enumerate() {
                        stack.push((4 * at + 1 + child, corners, depth - 1));
                    }
                } else if let Some(hit) = self.leaf(face, corners, origin, direction, to_light)
                    && nearest.is_none_or(|known| hit.t < known.t)
                {
                    nearest = Some(hit);
                }
            }
        }
        let last = nearest.map_or(f64::INFINITY, |hit| hit.t);
        if let Some((t, uv)) = self.bridges.first(origin, direction, to_light, last) {
            let height = self.field.height_at(uv.x, uv.y);
            nearest = Some(Hit { t, position: origin + direction * t, uv, height });
        }
        nearest
    }

    /// Whether the surface is in the way from a point of it, `clear` of itself.
    pub fn blocked(&self, from: DVec3, direction: DVec3, clear: f64) -> bool {
        self.first(from + direction.normalize() * clear, direction, true, 0).is_some()
    }

    fn leaf(
        &self,
        face: &Face,
        corners: [Weights; 3],
        origin: DVec3,
        direction: DVec3,
        from_either_side: bool,
    ) -> Option<Hit> {
        let [a, b, c] = corners.map(|corner| face.point(self.field, corner));
        let normal = (b - a).cross(c - a);
        if normal.dot(direction) >= 0.0 && !from_either_side {
            return None;
        }
        let solved = DMat3::from_cols(b - a, c - a, -direction).inverse() * (origin - a);
        let (x, y) = (solved.x, solved.y);
        // What misses the flat triangle by little may still meet the surface over it.
        let reach = (b - a).length().max((c - a).length()) / direction.length();
        let within = |x: f64, y: f64, slack: f64| x >= -slack && y >= -slack && x + y <= 1.0 + slack;
        if !(within(x, y, 0.25) && solved.z > -reach) {
            return None;
        }
        let mut polished = true;
        let (mut w, mut t) =
            (corners[0] + (corners[1] - corners[0]) * x + (corners[2] - corners[0]) * y, solved.z);
        for _ in 0..6 {
            let off = origin + direction * t - face.point(self.field, w);
            let small = 1e-7;
            let along = |step: Weights| {
                (face.point(self.field, w + step * small) - face.point(self.field, w)) / small
            };
            let jacobian = DMat3::from_cols(
                along(DVec3::new(-1.0, 1.0, 0.0)),
                along(DVec3::new(-1.0, 0.0, 1.0)),
                -direction,
            );
            let step = jacobian.inverse() * off;
            let moved = DVec3::new(-step.x - step.y, step.x, step.y);
            // Across a crease it may swing: the micro-triangle's own answer is good enough there.
            if !step.is_finite() || moved.length() > (corners[1] - corners[0]).length() {
                polished = false;
                break;
            }
            w += moved;
            t += step.z;
        }
        let meets_flat = within(x, y, 1e-9) && solved.z > 0.0;
        let (x, y) = shares(corners, w);
        if !(meets_flat || polished && within(x, y, 1e-9)) || t <= 0.0 {
            return None;
        }
        let uv = face.uv(w);
        Some(Hit { t, position: origin + direction * t, uv, height: self.field.height_at(uv.x, uv.y) })
    }

    /// What a camera sees in a direction that is 1 along its view axis.
    pub fn seen(&self, camera: &Camera, direction: DVec3) -> Option<Hit> {
        self.first_hit(camera.eye + direction * camera.near(), direction)
    }

    /// The same with micro-triangles a thirty-second of a texel wide.
    pub fn seen_finely(&self, camera: &Camera, direction: DVec3) -> Option<Hit> {
        self.first(camera.eye + direction * camera.near(), direction, false, 3)
    }

    /// The whole picture, row by row from the top.
    pub fn picture(&self, camera: &Camera, size: [u32; 2]) -> Vec<Option<Hit>> {
        let [corner, right, down] = camera.pixel_directions(size, 0);
        (0..size[0] * size[1])
            .into_par_iter()
            .map(|at| {
                let (x, y) = (f64::from(at % size[0]) + 0.5, f64::from(at / size[0]) + 0.5);
                self.seen(camera, corner + right * x + down * y)
            })
            .collect()
    }
}
