//! Faces, the triangles they are made of, and the direction of the texture on each.

use glam::{Vec2, Vec3};

use super::super::{Surface, convention};

/// Corners of a quad among those of its given triangles, `abc` and `acd`: the diagonal's stand in both.
const QUAD: [[usize; 2]; 4] = [[0, 3], [1, 1], [2, 4], [5, 5]];

/// A triangle, or the quad it makes with the next one.
#[derive(Clone, Copy)]
pub(super) struct Face {
    pub triangle: u32,
    pub quad: bool,
}

/// A triangle with area: a whole face, or half of a quad along the diagonal that the rules choose.
pub(super) struct Half {
    /// First given triangle of the face.
    pub triangle: u32,
    /// Its corners among those of the face.
    pub corners: [u8; 3],
    /// Where they stand among the corners of all given triangles.
    pub places: [u32; 3],
    /// Their welded vertices.
    pub vertices: [u32; 3],
    /// Unit `dP/du` and `dP/dv`, `v` up; zero where the UVs give none.
    pub along: [Vec3; 2],
    /// Whether the map is unmirrored.
    pub upright: bool,
    /// Whether its UVs give no direction: then it joins whatever group finds it.
    pub any: bool,
}

impl Face {
    pub fn triangles(self) -> usize {
        1 + usize::from(self.quad)
    }

    pub fn corners(self) -> usize {
        2 + self.triangles()
    }

    /// Where a corner stands among the corners of all given triangles, once or twice.
    pub fn places(self, corner: usize) -> [usize; 2] {
        let within = if self.quad { QUAD[corner] } else { [corner; 2] };
        within.map(|place| self.triangle as usize * 3 + place)
    }

    pub fn vertex(self, surface: Surface<'_>, corner: usize) -> usize {
        let [place, _] = self.places(corner);
        surface.indices[place / 3][place % 3] as usize
    }

    /// The corners of its triangles: of a quad, split along the shorter diagonal of the UVs or, when
    /// those are equal, of the positions.
    fn split(self, surface: Surface<'_>) -> [[u8; 3]; 2] {
        let vertex = |corner| self.vertex(surface, corner);
        let [a, b, c, d] =
            [0, 1, 2, 3].map(|corner| Vec2::from(convention::v_up(surface.uvs[vertex(corner)])));
        let (ac, bd) = ((c - a).length_squared(), (d - b).length_squared());
        let first = if ac == bd || ac.is_nan() || bd.is_nan() {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| surface.positions[vertex(corner)]);
            (d - b).length_squared() >= (c - a).length_squared()
        } else {
            ac < bd
        };
        if first { [[0, 1, 2], [0, 2, 3]] } else { [[0, 1, 3], [1, 2, 3]] }
    }

    /// Whether no two of these corners are at one place.
    fn has_area(self, surface: Surface<'_>, corners: [u8; 3]) -> bool {
        let [a, b, c] = corners.map(|corner| surface.positions[self.vertex(surface, usize::from(corner))]);
        a != b && b != c && c != a
    }

    /// The triangles with area of the face, in the order of the reference.
    pub fn halves(self, surface: Surface<'_>, welded: &[u32]) -> [Option<Half>; 2] {
        let make = |corners: [u8; 3]| self.half(surface, welded, corners);
        if !self.quad {
            return [make([0, 1, 2]), None];
        }
        let mut halves = self.split(surface).map(make);
        if let [Some(a), Some(b)] = &mut halves
            && a.upright != b.upright
        {
            // A badly folded map: the half with the larger UV area has the say.
            let area = |half: &Half| uv_area(surface, half).abs();
            if b.any || area(a) >= area(b) {
                b.upright = a.upright;
            } else {
                a.upright = b.upright;
            }
        }
        halves
    }

    fn half(self, surface: Surface<'_>, welded: &[u32], corners: [u8; 3]) -> Option<Half> {
        if !self.has_area(surface, corners) {
            return None;
        }
        let given = corners.map(|corner| self.vertex(surface, usize::from(corner)));
        let [a, b, c] = given.map(|vertex| surface.positions[vertex]);
        let mut half = Half {
            triangle: self.triangle,
            corners,
            places: corners.map(|corner| self.places(usize::from(corner))[0] as u32),
            vertices: given.map(|vertex| welded[vertex]),
            along: [Vec3::ZERO; 2],
            upright: false,
            any: true,
        };
        let [r, s, t] = half.uvs(surface);
        let (uv1, uv2) = (s - r, t - r);
        let (e1, e2) = (b - a, c - a);
        let area = uv1.perp_dot(uv2);
        half.upright = area > 0.0;
        if counts(area) {
            let sign = if half.upright { 1.0 } else { -1.0 };
            let along = [uv2.y * e1 - uv1.y * e2, uv1.x * e2 - uv2.x * e1];
            half.along = along.map(|v| sign * unit(v));
            half.any = !along.iter().all(|v| counts(v.length() / area.abs()));
        }
        Some(half)
    }
}

impl Half {
    fn uvs(&self, surface: Surface<'_>) -> [Vec2; 3] {
        let vertex = |place: u32| surface.indices[place as usize / 3][place as usize % 3] as usize;
        self.places.map(|place| Vec2::from(convention::v_up(surface.uvs[vertex(place)])))
    }
}

/// Twice the signed UV area, `v` up.
fn uv_area(surface: Surface<'_>, half: &Half) -> f32 {
    let [a, b, c] = half.uvs(surface);
    (b - a).perp_dot(c - a)
}

/// Whether a number counts as more than zero, as the reference has it.
fn counts(value: f32) -> bool {
    value.abs() > f32::MIN_POSITIVE
}

/// At unit length, or zero.
pub(super) fn unit(v: Vec3) -> Vec3 {
    if v.abs().max_element() > f32::MIN_POSITIVE { v * v.length().recip() } else { v }
}

/// The given triangles and quads that have area, in order.
pub(super) fn faces(surface: Surface<'_>) -> Vec<Face> {
    let mut faces = Vec::with_capacity(surface.indices.len());
    let mut quads = surface.quads.iter().peekable();
    let mut triangle = 0;
    while triangle < surface.indices.len() {
        while quads.next_if(|&&quad| (quad as usize) < triangle).is_some() {}
        let [first, _, third] = surface.indices[triangle];
        // Triangles with different normals along the diagonal do not share both vertices.
        let quad = quads.peek().is_some_and(|&&quad| quad as usize == triangle)
            && surface.indices.get(triangle + 1).is_some_and(|next| next[..2] == [first, third]);
        let face = Face { triangle: triangle as u32, quad };
        let sound = if quad {
            face.split(surface).into_iter().any(|half| face.has_area(surface, half))
        } else {
            face.has_area(surface, [0, 1, 2])
        };
        if sound {
            faces.push(face);
        }
        triangle += face.triangles();
    }
    faces
}
