//! From groups to one tangent for each corner.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::super::Surface;
use super::groups::Groups;
use super::halves::{Half, unit};

/// Triangles around one vertex that are still compared pair by pair when their directions differ by
/// half a turn or nearly; larger groups stay whole.
const MOST_COMPARED: usize = 1024;

/// What a group comes to.
enum Tangents {
    /// One tangent.
    Same(Vec3),
    /// One for each member: opposite directions part.
    Parted(Vec<Vec3>),
}

/// A tangent for each corner of each given triangle, where a group has one. Of the corners of a quad
/// only the first entry is filled in.
pub(super) fn tangents(surface: Surface<'_>, halves: &[Half], groups: &Groups) -> Vec<Option<Vec4>> {
    let found: Vec<Tangents> = (0..groups.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|group| of_group(surface, halves, groups.members(group)))
        .collect();
    let mut out: Vec<Option<Vec4>> = vec![None; 3 * surface.indices.len()];
    for (group, tangents) in found.iter().enumerate() {
        for (at, &member) in groups.members(group).iter().enumerate() {
            let half = &halves[member as usize / 3];
            let tangent = match tangents {
                Tangents::Same(tangent) => *tangent,
                Tangents::Parted(each) => each[at],
            };
            let slot = &mut out[half.places[member as usize % 3] as usize];
            let w = if half.upright { 1.0 } else { -1.0 };
            // Both halves of a quad have a say at the ends of its diagonal.
            let joined = slot.map_or(tangent, |other| unit(other.truncate() + tangent));
            *slot = Some(joined.extend(w));
        }
    }
    out.par_iter_mut().for_each(|slot| {
        // Huge or collapsed triangles leave a tangent of no length, or none at all.
        *slot = slot.filter(|t| t.is_finite() && (t.truncate().length_squared() - 1.0).abs() < 1e-3);
    });
    out
}

/// `v` without its part along a unit normal, at unit length or zero.
fn flat(v: Vec3, normal: Vec3) -> Vec3 {
    unit(v - normal.dot(v) * normal)
}

fn of_group(surface: Surface<'_>, halves: &[Half], members: &[u32]) -> Tangents {
    let half = |member: u32| &halves[member as usize / 3];
    let given = |member: u32| {
        let place = half(member).places[member as usize % 3] as usize;
        surface.indices[place / 3][place % 3] as usize
    };
    let normal = surface.normals[given(members[0])];
    let share = |member: u32| -> Vec3 {
        let half = half(member);
        if half.any {
            return Vec3::ZERO;
        }
        let position = |corner: u32| {
            let place = half.places[corner as usize % 3] as usize;
            surface.positions[surface.indices[place / 3][place % 3] as usize]
        };
        let corner = member % 3;
        let here = position(corner);
        let [e, f] = [corner + 1, corner + 2].map(|other| flat(position(other) - here, normal));
        e.dot(f).clamp(-1.0, 1.0).acos() * flat(half.along[0], normal)
    };
    let whole = || Tangents::Same(unit(members.iter().map(|&member| share(member)).sum()));

    // Nearly always all directions are within a quarter turn of the first: then no two are opposite.
    let first = members.iter().copied().find(|&member| !half(member).any).unwrap_or(members[0]);
    let first = half(first).along.map(|v| flat(v, normal));
    let near = |member: &u32| {
        let half = half(*member);
        half.any || (0..2).all(|k| flat(half.along[k], normal).dot(first[k]) > 0.01)
    };
    if members.len() == 1 || members.iter().all(near) || members.len() > MOST_COMPARED {
        return whole();
    }
    let flats: Vec<[Vec3; 2]> = members.iter().map(|&m| half(m).along.map(|v| flat(v, normal))).collect();
    let joined = |a: usize, b: usize| {
        let (one, other) = (half(members[a]), half(members[b]));
        one.any
            || other.any
            || one.triangle == other.triangle
            || (0..2).all(|k| flats[a][k].dot(flats[b][k]) > -1.0)
    };
    let count = members.len();
    if (0..count).all(|a| (0..a).all(|b| joined(a, b))) {
        return whole();
    }
    let shares: Vec<Vec3> = members.iter().map(|&member| share(member)).collect();
    let sum = |a: usize| unit((0..count).filter(|&b| joined(a, b)).map(|b| shares[b]).sum());
    Tangents::Parted((0..count).map(sum).collect())
}
