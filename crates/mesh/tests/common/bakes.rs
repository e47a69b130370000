//! What the tests of baking share: sheets, a lumpy ball, and plain readings of maps and frames.

use glam::{DVec2, DVec3, Vec3};
use mesh::{DetailMaps, DetailOptions, Mesh, bake_detail};

/// A map with its number of channels.
pub struct Map<'a>(pub &'a [f32], pub usize);

impl Map<'_> {
    /// The first three channels of a texel.
    pub fn vector(&self, at: usize) -> DVec3 {
        let texel = &self.0[at * self.1..];
        DVec3::new(f64::from(texel[0]), f64::from(texel[1]), f64::from(texel[2]))
    }
}

/// Angle between two vectors of any length, degrees.
pub fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Bakes, or fails the test.
pub fn bake(plain: &Mesh, detail: &Mesh, options: &DetailOptions) -> DetailMaps {
    bake_detail(plain, detail, None, options, &mut |_, _| true).unwrap()
}

/// The UV of a texel's centre.
pub fn texel_centre(at: usize, width: usize) -> [f64; 2] {
    [(at % width) as f64, (at / width) as f64].map(|i| (i + 0.5) / width as f64)
}

/// A grid of `n` x `n` squares, counter-clockwise where `i` runs right and `j` up, or the reverse of
/// both; smooth normals, UVs upright.
pub fn sheet(n: usize, place: impl Fn(usize, usize) -> Vec3) -> Mesh {
    let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
    let corners: Vec<(usize, usize)> = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).collect();
    let positions: Vec<[f32; 3]> = corners.iter().map(|&(i, j)| place(i, j).to_array()).collect();
    let uvs: Vec<[f32; 2]> =
        corners.iter().map(|&(i, j)| [i as f32 / n as f32, 1.0 - j as f32 / n as f32]).collect();
    let mut indices = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            indices.extend([[a, b, c], [a, c, d]]);
        }
    }
    let up = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| Vec3::from(positions[i as usize]));
        (b - a).cross(c - a).z > 0.0
    };
    if !up(&indices[0]) {
        indices.iter_mut().for_each(|t| t.swap(1, 2));
    }
    Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap()
}

/// The unit square with its image upright, in the plane z = 0.
pub trait UnitSheet {
    fn unit_sheet() -> Mesh;
}

impl UnitSheet for Mesh {
    fn unit_sheet() -> Mesh {
        sheet(1, |i, j| Vec3::new(i as f32, j as f32, 0.0))
    }
}

/// A ball with lumps around the origin.
pub fn object(radius: f32) -> Mesh {
    let mut ball = Mesh::sphere(radius, 128).unwrap();
    for p in &mut ball.positions {
        let lump = 1.0 + 0.05 * (p.x * 20.0).sin() * (p.y * 17.0).cos() * (p.z * 13.0).cos();
        *p *= lump;
    }
    let positions: Vec<[f32; 3]> = ball.positions.iter().map(|p| p.to_array()).collect();
    let uvs: Vec<[f32; 2]> = ball.uvs.iter().map(|t| t.to_array()).collect();
    Mesh::from_arrays(&positions, &ball.indices, &uvs, None, None).unwrap()
}

/// A tangent frame read off a mesh in f64.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub tangent: DVec3,
    pub normal: DVec3,
    pub w: f64,
}

/// What a renderer makes of a texel: `x T + y w (N x T) + z N`.
pub fn decoded(frame: &Frame, texel: DVec3) -> DVec3 {
    let bitangent = frame.normal.cross(frame.tangent) * frame.w;
    frame.tangent * texel.x + bitangent * texel.y + frame.normal * texel.z
}

/// A mesh that can be asked what lies at a UV, triangle by triangle.
pub struct Sheet {
    pub mesh: Mesh,
}

impl Sheet {
    /// The rectangle -1..1 x 0..1 in the plane z = 0 in two charts: its left half with the UVs that
    /// `left` makes of a point's place in it, its right half likewise. Points count 0..1 along x over
    /// each half, and v down; the halves lie side by side on the map with a gap.
    pub fn halves(left: impl Fn(DVec2) -> DVec2, right: impl Fn(DVec2) -> DVec2) -> Self {
        let mut positions = Vec::new();
        let mut uvs = Vec::new();
        for half in 0..2 {
            for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                positions.push([(x + f64::from(half) - 1.0) as f32, y as f32, 0.0]);
                let p = DVec2::new(x, 1.0 - y);
                let q = if half == 0 { left(p) } else { right(p) };
                uvs.push([(0.5 * f64::from(half) + 0.02 + 0.46 * q.x) as f32, (0.02 + 0.96 * q.y) as f32]);
            }
        }
        let indices = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        Self { mesh: Mesh::from_arrays(&positions, &indices, &uvs, None, None).unwrap() }
    }

    /// The place and the frame at a UV, or `None` outside the charts.
    pub fn at(&self, [u, v]: [f64; 2]) -> Option<(DVec3, Frame)> {
        let p = DVec2::new(u, v);
        self.mesh.indices.iter().find_map(|t| {
            let at = t.map(|i| i as usize);
            let [a, b, c] = at.map(|i| self.mesh.uvs[i].as_dvec2());
            let area = (b - a).perp_dot(c - a);
            let (wb, wc) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
            let weights = [1.0 - wb - wc, wb, wc];
            let mix = |v: &[Vec3]| (0..3).map(|k| v[at[k]].as_dvec3() * weights[k]).sum::<DVec3>();
            let tangents: Vec<Vec3> = self.mesh.tangents.iter().map(|t| t.truncate()).collect();
            let frame = Frame {
                tangent: mix(&tangents),
                normal: mix(&self.mesh.normals),
                w: f64::from(self.mesh.tangents[at[0]].w),
            };
            (weights.iter().all(|&w| w > 0.0)).then(|| (mix(&self.mesh.positions), frame))
        })
    }
}
