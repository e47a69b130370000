//! MikkTSpace as its paper defines it, in f64 and written for clarity.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use mesh::Mesh;
use mesh::frame::face_frame;

/// For each corner of each face of 3 or 4 of the mesh's vertices, the tangent and `w`.
///
/// Quads are split along the shorter diagonal of their UVs, or of their positions when those are
/// equal. Corners at the same position, normal and UV, reached from each other over shared edges
/// between triangles of equal orientation, share the angle-weighted sum of the triangles' tangents
/// projected into the plane of the normal. Meant for quads whose halves have the same orientation.
pub fn plain_mikktspace(mesh: &Mesh, faces: &[Vec<u32>]) -> Vec<Vec<Option<(DVec3, f32)>>> {
    let place = |i: u32| mesh.positions[i as usize].as_dvec3();
    let image = |i: u32| mesh.uvs[i as usize].as_dvec2();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut owners: Vec<[(usize, usize); 3]> = Vec::new();
    for (face, corners) in faces.iter().enumerate() {
        for half in split(corners, place, image) {
            triangles.push(half.map(|c| corners[c]));
            owners.push(half.map(|c| (face, c)));
        }
    }

    let mut ids = HashMap::new();
    let weld: Vec<usize> = (0..mesh.positions.len())
        .map(|i| {
            let (p, n, t) = (mesh.positions[i] + 0.0, mesh.normals[i] + 0.0, mesh.uvs[i] + 0.0);
            let key = [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y].map(f32::to_bits);
            let next = ids.len();
            *ids.entry(key).or_insert(next)
        })
        .collect();
    let position = |triangle: usize, corner: usize| place(triangles[triangle][corner % 3]);
    let uv = |triangle: usize, corner: usize| image(triangles[triangle][corner % 3]);
    let area = |t| (uv(t, 1) - uv(t, 0)).perp_dot(uv(t, 2) - uv(t, 0));

    let mut parent: Vec<usize> = (0..triangles.len() * 3).collect();
    let mut edges: HashMap<(usize, usize), (usize, usize)> = HashMap::new();
    for (triangle, corners) in triangles.iter().enumerate() {
        let ids = corners.map(|i| weld[i as usize]);
        for c in 0..3 {
            edges.insert((ids[c], ids[(c + 1) % 3]), (triangle, c));
        }
    }
    for (&(a, b), &(triangle, c)) in &edges {
        let Some(&(other, d)) = edges.get(&(b, a)) else { continue };
        if (area(triangle) > 0.0) == (area(other) > 0.0) {
            for (mine, theirs) in [(c, (d + 1) % 3), ((c + 1) % 3, d)] {
                let (x, y) = (root(&parent, triangle * 3 + mine), root(&parent, other * 3 + theirs));
                parent[x] = y;
            }
        }
    }
    let mut sums = vec![DVec3::ZERO; parent.len()];
    for triangle in 0..triangles.len() {
        let of = |c| (position(triangle, c), uv(triangle, c));
        let [(p, r), (q, s), (o, t)] = [0, 1, 2].map(of);
        let Some(frame) = face_frame([p, q, o], [r, s, t]) else { continue };
        for c in 0..3 {
            let normal = mesh.normals[triangles[triangle][c] as usize].as_dvec3();
            let flat = |v: DVec3| (v - normal * normal.dot(v)).normalize_or_zero();
            let (e, f) = (
                flat(position(triangle, c + 1) - position(triangle, c)),
                flat(position(triangle, c + 2) - position(triangle, c)),
            );
            sums[root(&parent, triangle * 3 + c)] += flat(frame.dpdu) * e.dot(f).clamp(-1.0, 1.0).acos();
        }
    }
    let mut result: Vec<Vec<Option<(DVec3, f32)>>> = faces.iter().map(|f| vec![None; f.len()]).collect();
    for (triangle, owner) in owners.iter().enumerate() {
        // v is down, so a positive UV area is a mirrored image.
        let w = if area(triangle) < 0.0 { 1.0 } else { -1.0 };
        for (c, &(face, corner)) in owner.iter().enumerate() {
            let sum = sums[root(&parent, triangle * 3 + c)];
            result[face][corner] = (sum.length() > 1e-3).then(|| (sum.normalize(), w));
        }
    }
    result
}

fn root(parent: &[usize], mut i: usize) -> usize {
    while parent[i] != i {
        i = parent[i];
    }
    i
}

fn split(corners: &[u32], place: impl Fn(u32) -> DVec3, image: impl Fn(u32) -> DVec2) -> Vec<[usize; 3]> {
    let &[a, b, c, d] = corners else { return vec![[0, 1, 2]] };
    let uv = image(a).distance(image(c)) - image(b).distance(image(d));
    let position = place(a).distance(place(c)) - place(b).distance(place(d));
    if uv < 0.0 || (uv == 0.0 && position <= 0.0) {
        vec![[0, 1, 2], [0, 2, 3]]
    } else {
        vec![[0, 1, 3], [1, 2, 3]]
    }
}
