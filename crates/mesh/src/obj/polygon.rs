//! Splits polygons into triangles.

use glam::{DVec2, DVec3};

/// Corners tested for lying inside an ear, over a whole file, before further concave polygons are
/// split as fans. Ear clipping takes up to cubic time; real models need a few tests a corner.
pub(super) const EAR_TESTS: u64 = 1_000_000_000;

/// Triangles over the corners of a polygon: a fan from the first corner when it is convex, as other
/// readers do, else by clipping ears (Meisters 1975) while `tests` last. Those of a quad `abcd` are
/// `abc` and `acd`, counting from one corner or another.
pub(super) fn triangulate(outline: &[DVec3], tests: &mut u64) -> Vec<[usize; 3]> {
    let fan = || (2..outline.len()).map(|i| [0, i - 1, i]).collect();
    if outline.len() <= 3 {
        return fan();
    }
    let flat = project(outline);
    let count = flat.len();
    if (0..count).all(|i| turn(flat[i], flat[(i + 1) % count], flat[(i + 2) % count]) >= 0.0) {
        return fan();
    }
    let mut left: Vec<usize> = (0..count).collect();
    let mut triangles = Vec::with_capacity(count - 2);
    while left.len() > 3 {
        let ear = |&at: &usize| {
            *tests = tests.saturating_sub(left.len() as u64);
            *tests > 0 && is_ear(&flat, &left, at)
        };
        let Some(at) = (0..left.len()).find(ear) else { break };
        let n = left.len();
        triangles.push([left[(at + n - 1) % n], left[at], left[(at + 1) % n]]);
        left.remove(at);
        if n == 4 {
            // The rest starts where the ear did.
            left.rotate_left((at + 2) % 3);
        }
    }
    // Outlines that cross themselves run out of ears: the rest becomes a fan.
    triangles.extend((2..left.len()).map(|i| [left[0], left[i - 1], left[i]]));
    triangles
}

/// The outline in the plane of its area vector (Newell), counter-clockwise.
fn project(outline: &[DVec3]) -> Vec<DVec2> {
    let next = outline.iter().cycle().skip(1);
    let area: DVec3 = outline.iter().zip(next).map(|(a, b)| (a - outline[0]).cross(b - outline[0])).sum();
    let normal = area.try_normalize().unwrap_or(DVec3::Z);
    let (x, y) = normal.any_orthonormal_pair();
    outline.iter().map(|p| DVec2::new((p - outline[0]).dot(x), (p - outline[0]).dot(y))).collect()
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

/// Whether the corner at `at` sticks out and no other corner lies in its triangle.
fn is_ear(flat: &[DVec2], left: &[usize], at: usize) -> bool {
    let n = left.len();
    let [a, b, c] = [left[(at + n - 1) % n], left[at], left[(at + 1) % n]].map(|i| flat[i]);
    let inside = |p: DVec2| {
        p != a && p != b && p != c && turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0
    };
    turn(a, b, c) > 0.0 && !left.iter().any(|&i| inside(flat[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(outline: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let half = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| outline[i]);
            (b - a).cross(c - a).z / 2.0
        };
        assert!(triangles.iter().all(|t| half(t) > -1e-12), "{triangles:?}");
        triangles.iter().map(half).sum()
    }

    #[test]
    fn convex_polygons_are_fans() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        assert_eq!(triangulate(&square, &mut 9), vec![[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn quads_are_fans_from_one_corner_or_another() {
        let arrow = [[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        for shift in 0..4 {
            let mut turned = arrow;
            turned.rotate_left(shift);
            let triangles = triangulate(&turned, &mut 99);
            let [[a, _, c], [d, e, _]] = triangles[..] else { panic!("{triangles:?}") };
            assert_eq!((a, c), (d, e), "{triangles:?}");
            // Two triangles of 4 x 1 on the axes.
            assert!((area(&turned, &triangles) - 4.0).abs() < 1e-12, "{triangles:?}");
        }
    }

    #[test]
    fn concave_polygons_cover_their_area_once() {
        let points = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        let outline = points.map(|[x, y]| DVec3::new(x, y, 0.0));
        // Shoelace by hand: the 4 x 4 square less the notch of 4 * 3 / 2.
        for shift in 0..5 {
            let mut turned = outline;
            turned.rotate_left(shift);
            assert!((area(&turned, &triangulate(&turned, &mut 999)) - 10.0).abs() < 1e-12, "shift {shift}");
        }
    }

    #[test]
    fn senseless_polygons_still_end() {
        for outline in [vec![DVec3::ZERO; 9], (0..9).map(|i| DVec3::X * f64::from(i % 3)).collect()] {
            assert_eq!(triangulate(&outline, &mut 999).len(), 7);
            assert_eq!(triangulate(&outline, &mut 5).len(), 7);
        }
    }
}
