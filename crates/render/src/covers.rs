//! What the nearest meshes cover of a picture, and how far off at most: what stands wholly behind is not seen, and that
//! is told on the host before anything is drawn (Greene, Kass and Miller, "Hierarchical Z-buffer visibility", SIGGRAPH
//! 1993). Here the buffer holds the farthest depth that the relief of the meshes can show at a pixel.

use glam::DVec3;
use mesh::Mesh;

use crate::culling::{Culling, Outline, Stand};

/// Pixels along a side of a cell.
const CELL: usize = 8;
/// Meshes that are drawn here at most, and their vertices and triangles together.
const MOST_COVERS: usize = 16;
const MOST_PARTS: usize = 400_000;
/// Least share of the picture that is worth it.
const LEAST_SHARE: f64 = 1.0 / 1024.0;
/// Sine of the flattest view of a triangle that counts: below it rays run far along the relief.
const FLATTEST: f64 = 0.1;
/// Least cosine between two normals of a triangle that counts: 30 degrees apart.
const LEAST_COSINE: f32 = 0.866;
/// Pixels around what is tested, for what outlines are rounded by.
const MARGIN: f64 = 2.0;

/// A draw that may cover others, or be covered.
pub(crate) struct Candidate<'a> {
    pub mesh: &'a Mesh,
    pub triangles: std::ops::Range<u32>,
    pub middle: DVec3,
    pub stand: Stand,
    pub outline: Outline,
    /// How deep its relief goes below the mesh, mesh units.
    pub depth: f64,
}

/// The farthest depth in each pixel of a part of the picture, and in each cell of it.
#[derive(Debug)]
pub(crate) struct Covers {
    /// First pixel across and down, and pixels of the part; whole cells but for the picture's end.
    first: [usize; 2],
    size: [usize; 2],
    pixels: Vec<f32>,
    cells: Vec<f32>,
}

/// A corner in the picture: pixels across and down, depth, and the way that its relief adds to it, as a share.
type Corner = Option<[f64; 4]>;

impl Covers {
    /// What the largest of the draws cover, if there is anything behind one of them.
    pub fn of(draws: &[Candidate<'_>], culling: &Culling) -> Option<Self> {
        let picture = culling.size();
        let mut largest: Vec<&Candidate<'_>> = draws
            .iter()
            .filter(|draw| share(&draw.outline, picture) >= LEAST_SHARE)
            .filter(|draw| draws.iter().any(|other| may_hide(&draw.outline, &other.outline)))
            .collect();
        largest.sort_by(|a, b| share(&b.outline, picture).total_cmp(&share(&a.outline, picture)));
        let mut parts = 0;
        largest.retain(|draw| {
            let own = draw.mesh.positions.len() + draw.triangles.len();
            let fits = parts + own <= MOST_PARTS;
            parts += if fits { own } else { 0 };
            fits
        });
        largest.truncate(MOST_COVERS);
        let outlines = || largest.iter().map(|draw| &draw.outline);
        let low = [0, 1].map(|axis| outlines().map(|o| o.low[axis]).fold(f64::INFINITY, f64::min).max(0.0));
        let high = [0, 1].map(|axis| {
            outlines().map(|o| o.high[axis]).fold(f64::NEG_INFINITY, f64::max).min(picture[axis])
        });
        if largest.is_empty() || low[0] >= high[0] || low[1] >= high[1] {
            return None;
        }
        let first = low.map(|low| low as usize / CELL * CELL);
        let end = [0, 1]
            .map(|axis| (high[axis].ceil() as usize).next_multiple_of(CELL).min(picture[axis] as usize));
        let size = [0, 1].map(|axis| end[axis] - first[axis]);
        let mut covers =
            Self { first, size, pixels: vec![f32::INFINITY; size[0] * size[1]], cells: Vec::new() };
        for draw in largest {
            covers.draw(draw, culling);
        }
        covers.settle();
        Some(covers)
    }

    /// Draws the triangles of a mesh that face the eye.
    fn draw(&mut self, draw: &Candidate<'_>, culling: &Culling) {
        let corners: Vec<Corner> =
            (0..draw.mesh.positions.len()).map(|at| corner(draw, at, culling)).collect();
        let turned = if draw.stand.mirrored { -1.0 } else { 1.0 };
        for triangle in &draw.mesh.indices[draw.triangles.start as usize..draw.triangles.end as usize] {
            let [Some(a), Some(b), Some(c)] = triangle.map(|at| corners[at as usize]) else { continue };
            // Rows run down: what is wound counter-clockwise has a negative area.
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            let (least, most) = (a[3].min(b[3]).min(c[3]), a[3].max(b[3]).max(c[3]));
            // Where rays go as deep at all corners, and normals are nearly the same, they go no more than twice as deep
            // between them.
            let bounded = most <= 2.0 * least && (most == 0.0 || turns_little(draw.mesh, *triangle));
            if area * turned < 0.0 && bounded {
                self.fill([a, b, c], a[2].max(b[2]).max(c[2]) * (1.0 + 2.0 * most));
            }
        }
    }

    /// Fills the pixels whose middles are in a triangle. Triangles that share an edge leave no gap along it: both find
    /// its places by the same arithmetic.
    fn fill(&mut self, mut corners: [[f64; 4]; 3], depth: f64) {
        corners.sort_by(|a, b| a[1].total_cmp(&b[1]).then(a[0].total_cmp(&b[0])));
        let [a, b, c] = corners;
        let [left, top] = self.first.map(|first| first as f64);
        let rows = |axis: f64| axis - 0.5 - top;
        let last = rows(c[1]).floor().min(self.size[1] as f64 - 1.0);
        let depth = depth as f32;
        let mut row = rows(a[1]).ceil().max(0.0);
        while row <= last {
            let y = row + 0.5 + top;
            let long = across(&a, &c, y);
            let short = if y < b[1] { across(&a, &b, y) } else { across(&b, &c, y) };
            let (low, high) =
                if y == b[1] { (long.min(b[0]), long.max(b[0])) } else { (long.min(short), long.max(short)) };
            let from = (low - 0.5 - left).ceil().max(0.0) as usize;
            let end = ((high - 0.5 - left).floor() + 1.0).clamp(0.0, self.size[0] as f64) as usize;
            let start = row as usize * self.size[0];
            if from < end {
                for pixel in &mut self.pixels[start + from..start + end] {
                    *pixel = pixel.min(depth);
                }
            }
            row += 1.0;
        }
    }

    /// Finds the farthest pixel of each cell.
    fn settle(&mut self) {
        let across = self.size[0].div_ceil(CELL);
        self.cells = vec![0.0; across * self.size[1].div_ceil(CELL)];
        for (y, row) in self.pixels.chunks_exact(self.size[0]).enumerate() {
            for (x, part) in row.chunks(CELL).enumerate() {
                let cell = &mut self.cells[y / CELL * across + x];
                *cell = part.iter().copied().fold(*cell, f32::max);
            }
        }
    }

    /// Whether all that has this outline is behind. `size`: of the picture, pixels.
    pub fn hides(&self, outline: &Outline, size: [f64; 2]) -> bool {
        let mut cells = [[0; 2]; 2];
        for axis in 0..2 {
            let low = (outline.low[axis] - MARGIN).max(0.0);
            let high = (outline.high[axis] + MARGIN).min(size[axis]);
            let (first, end) = (self.first[axis] as f64, (self.first[axis] + self.size[axis]) as f64);
            if !(low >= first && high <= end && low < high) {
                return false;
            }
            cells[axis] = [(low - first) as usize / CELL, ((high - first).ceil() as usize).div_ceil(CELL)];
        }
        let across = self.size[0].div_ceil(CELL);
        let [[left, right], [top, bottom]] = cells;
        let near = outline.near * (1.0 - 1e-5);
        (top..bottom).all(|y| {
            self.cells[y * across + left..y * across + right].iter().all(|&far| f64::from(far) < near)
        })
    }
}

/// Whether the normals at the corners of a triangle are close together.
fn turns_little(mesh: &Mesh, triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|at| mesh.normals[at as usize].normalize_or_zero());
    a.dot(b).min(b.dot(c)).min(c.dot(a)) >= LEAST_COSINE
}

/// Where an edge crosses a row; the corners in the order of their rows.
fn across(from: &[f64; 4], to: &[f64; 4], y: f64) -> f64 {
    if to[1] == from[1] {
        return to[0];
    }
    from[0] + (to[0] - from[0]) * ((y - from[1]) / (to[1] - from[1]))
}

/// Share of the picture that a box around an outline takes.
fn share(outline: &Outline, picture: [f64; 2]) -> f64 {
    let side = |axis: usize| outline.high[axis].min(picture[axis]) - outline.low[axis].max(0.0);
    side(0).max(0.0) * side(1).max(0.0) / (picture[0] * picture[1])
}

/// Whether something of the other may be behind it.
fn may_hide(one: &Outline, other: &Outline) -> bool {
    let overlap =
        [0, 1].iter().all(|&axis| one.low[axis] < other.high[axis] && other.low[axis] < one.high[axis]);
    overlap && other.near > one.near
}

/// A vertex in the picture; `None` where it is before the near plane or seen too flat.
fn corner(draw: &Candidate<'_>, at: usize, culling: &Culling) -> Corner {
    let (mesh, stand) = (draw.mesh, &draw.stand);
    let object = mesh.positions[at].as_dvec3() - draw.middle;
    let [x, y, depth] = culling.in_picture(stand.relative_from_object.transform_point3(object))?;
    if draw.depth == 0.0 {
        return Some([x, y, depth, 0.0]);
    }
    // As `frame_coordinates` of lib/surface_frame.wgsl: how much of the ray goes along the normal.
    let direction = object - stand.eye;
    let normal = mesh.normals[at].as_dvec3().normalize_or_zero();
    let over = mesh.dpdu[at].as_dvec3().cross(mesh.dpdv[at].as_dvec3());
    let volume = over.dot(normal);
    // Nearly along the normal itself, or nothing that could be relied upon.
    let reliable = volume.abs() > 0.5 * over.length();
    let sink = -direction.dot(over) / volume;
    (reliable && sink >= FLATTEST * direction.length()).then(|| [x, y, depth, draw.depth / sink])
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::{Camera, Skips};

    const SIZE: [u32; 2] = [320, 200];

    fn candidate<'a>(mesh: &'a Mesh, relative: DMat4, depth: f64, culling: &Culling) -> Candidate<'a> {
        let stand = Stand::new(relative, 0.9, false);
        let outline = culling.outline(relative.w_axis.truncate(), stand.radius).unwrap();
        let triangles = 0..mesh.indices.len() as u32;
        Candidate { mesh, triangles, middle: DVec3::ZERO, stand, outline, depth }
    }

    /// Whether a small ball at a point is hidden behind a mesh of radius 0.5 in the middle.
    fn hidden(mesh: &Mesh, place: DMat4, depth: f64, ball: DVec3) -> bool {
        let camera = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO);
        let culling = Culling::new(&camera, SIZE, Skips::ALL);
        let away = DMat4::from_translation(-camera.eye);
        let far =
            candidate(mesh, away * DMat4::from_translation(DVec3::new(0.0, 0.0, -20.0)), depth, &culling);
        let near = candidate(mesh, away * place, depth, &culling);
        let Some(covers) = Covers::of(&[near, far], &culling) else { return false };
        let outline = culling.outline(ball - camera.eye, 0.03).unwrap();
        covers.hides(&outline, SIZE.map(f64::from))
    }

    #[test]
    fn only_what_is_behind_and_inside_is_hidden() {
        let (ball, still) = (Mesh::sphere(0.5, 48).unwrap(), DMat4::IDENTITY);
        let at = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        assert!(hidden(&ball, still, 0.0, at(0.0, -1.0)));
        assert!(hidden(&ball, still, 0.05, at(0.3, -2.0)));
        // Before it, within its relief, at its edge and beside it.
        assert!(!hidden(&ball, still, 0.0, at(0.0, 1.0)));
        assert!(!hidden(&ball, still, 0.3, at(0.0, 0.35)));
        assert!(hidden(&ball, still, 0.0, at(0.0, 0.35)));
        assert!(!hidden(&ball, still, 0.0, at(0.82, -2.0)));
        assert!(!hidden(&ball, still, 0.0, at(1.5, -2.0)));
        // Mirrored it is the same; a ring does not hide what its hole shows.
        assert!(hidden(&ball, DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0)), 0.0, at(0.0, -1.0)));
        let ring = Mesh::torus(0.5, 0.15, 64, 32).unwrap();
        let facing = DMat4::from_rotation_x(std::f64::consts::FRAC_PI_2);
        assert!(!hidden(&ring, facing, 0.0, at(0.0, -1.0)));
        assert!(hidden(&ring, facing, 0.0, at(0.62, -0.7)));
    }

    #[test]
    fn the_inside_of_a_mesh_hides_nothing() {
        let ball = Mesh::sphere(0.5, 48).unwrap();
        let mut inside_out = ball.clone();
        inside_out.indices.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        assert!(hidden(&ball, DMat4::IDENTITY, 0.0, DVec3::new(0.0, 0.0, -1.0)));
        // Its far side shows from within, and hides what is behind that.
        assert!(!hidden(&inside_out, DMat4::IDENTITY, 0.0, DVec3::new(0.0, 0.0, -0.3)));
    }
}
