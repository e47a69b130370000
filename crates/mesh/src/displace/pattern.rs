//! How one triangle is cut into micro-triangles when each of its edges asks for a number of pieces of its own.
//!
//! An even grid fills the inside; between its rim and each edge runs a strip that joins the two numbers of
//! pieces. An edge's own points are all that the neighbour across it sees, so equal numbers leave no gap.

/// Micro-vertices as barycentric coordinates, and the micro-triangles between them.
#[derive(Debug, Clone, Default)]
pub(super) struct Pattern {
    /// The three corners, the points inside edges 0, 1 and 2 from their start on, then the inside.
    pub points: Vec<[f64; 3]>,
    /// Counter-clockwise as the triangle itself.
    pub triangles: Vec<[u32; 3]>,
}

/// Micro-triangles of a pattern, and points. Edge `e` runs from corner `e` to the next one.
pub(super) fn size(pieces: [u32; 3]) -> (u64, u64) {
    let pieces = pieces.map(u64::from);
    let rim: u64 = pieces.iter().sum();
    if rim == 3 {
        return (1, 3);
    }
    let inner = level(pieces) - 3;
    (rim + 3 * inner + inner * inner, rim + (inner + 1) * (inner + 2) / 2)
}

/// Pieces along the edges of the even grid of which the inside is taken.
fn level(pieces: [u64; 3]) -> u64 {
    pieces.into_iter().max().unwrap_or(1).max(3)
}

/// The pattern for at least one piece an edge.
pub(super) fn pattern(pieces: [u32; 3]) -> Pattern {
    let mut points = vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    if pieces == [1; 3] {
        return Pattern { points, triangles: vec![[0, 1, 2]] };
    }
    let mut first = [0; 3];
    for edge in 0..3 {
        first[edge] = points.len() as u32;
        for k in 1..pieces[edge] {
            let share = f64::from(k) / f64::from(pieces[edge]);
            let mut point = [0.0; 3];
            point[edge] = 1.0 - share;
            point[(edge + 1) % 3] = share;
            points.push(point);
        }
    }
    let level = level(pieces.map(u64::from)) as u32;
    let inner = level - 3;
    let inside = points.len() as u32;
    for i in 0..=inner {
        for j in 0..=inner - i {
            points.push([1 + inner - i - j, 1 + i, 1 + j].map(|b| f64::from(b) / f64::from(level)));
        }
    }
    // Rows get shorter by one point each.
    let at = |i: u32, j: u32| inside + i * (inner + 1) - i * (i.max(1) - 1) / 2 + j;
    let mut triangles = Vec::with_capacity(size(pieces).0 as usize);
    for i in 0..inner {
        for j in 0..inner - i {
            triangles.push([at(i, j), at(i + 1, j), at(i, j + 1)]);
            if i + j + 2 <= inner {
                triangles.push([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    for edge in 0..3 {
        let outer = |k: u32| match k {
            0 => edge as u32,
            k if k == pieces[edge] => (edge as u32 + 1) % 3,
            k => first[edge] + k - 1,
        };
        let rim = |k: u32| match edge {
            0 => at(k, 0),
            1 => at(inner - k, k),
            _ => at(0, inner - k),
        };
        let (mut o, mut r) = (0, 0);
        while o < pieces[edge] || r < inner {
            // Whichever side's next point comes first along the edge.
            let outer_next = u64::from(o + 1) * u64::from(level);
            let rim_next = u64::from(r + 2) * u64::from(pieces[edge]);
            if r == inner || (o < pieces[edge] && outer_next <= rim_next) {
                triangles.push([outer(o), outer(o + 1), rim(r)]);
                o += 1;
            } else {
                triangles.push([outer(o), rim(r + 1), rim(r)]);
                r += 1;
            }
        }
    }
    Pattern { points, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 3]], triangle: [u32; 3]) -> f64 {
        let [a, b, c] = triangle.map(|at| points[at as usize]);
        // Barycentric coordinates 1 and 2 as the axes of a plane.
        (b[1] - a[1]) * (c[2] - a[2]) - (c[1] - a[1]) * (b[2] - a[2])
    }

    #[test]
    fn a_pattern_covers_its_triangle_once() {
        for a in 1..9 {
            for b in 1..9 {
                for c in [1, 2, 3, 5, 17] {
                    let pieces = [a, b, c];
                    let pattern = pattern(pieces);
                    let count = (pattern.triangles.len() as u64, pattern.points.len() as u64);
                    assert_eq!(size(pieces), count, "{pieces:?}");
                    let areas: Vec<f64> =
                        pattern.triangles.iter().map(|&triangle| area(&pattern.points, triangle)).collect();
                    // No triangle turned over, and together the whole: so nothing is covered twice.
                    assert!(areas.iter().all(|&area| area > 1e-9), "{pieces:?} {areas:?}");
                    assert!((areas.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{pieces:?}");
                }
            }
        }
    }

    #[test]
    fn edges_have_the_pieces_they_ask_for() {
        let pieces = [4, 1, 7];
        let pattern = pattern(pieces);
        for edge in 0..3 {
            let on_edge = pattern.points.iter().filter(|point| point[(edge + 2) % 3] == 0.0).count();
            assert_eq!(on_edge, pieces[edge] as usize + 1);
        }
    }
}
