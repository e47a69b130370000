//! Which chart owns which sample, and which texels a chart merely touches.

use std::ops::Range;

use glam::DVec2;

/// How far from its centre a texel can be touched, along each axis: a hair less than its edge, so
/// that charts that end on the edge stay on their side.
const HALF: f64 = 0.5 - 1e-4;

/// How far inside the triangle a touched texel looks, texels: a ray from the very border of the plain
/// mesh may miss the border of the detailed one by rounding.
const INWARD: f64 = 1e-3;

/// No chart.
pub(super) const NONE: u32 = u32::MAX;

/// An edge as a function of the plane that is positive inside.
///
/// It is always computed from the same end, whichever triangle asks, so two triangles on either side
/// get the same number but for the sign and never both miss or both own a point.
#[derive(Debug, Clone, Copy)]
struct Edge {
    start: DVec2,
    along: DVec2,
    sign: f64,
}

impl Edge {
    fn new(a: DVec2, b: DVec2, sign: f64) -> Self {
        let swap = (b.x, b.y) < (a.x, a.y);
        let (start, end) = if swap { (b, a) } else { (a, b) };
        Self { start, along: end - start, sign: if swap { -sign } else { sign } }
    }

    #[inline(always)]
    fn value(&self, p: DVec2) -> f64 {
        self.sign * (self.along.x * (p.y - self.start.y) - self.along.y * (p.x - self.start.x))
    }

    /// Whether a point is inside; on the edge, one of its two sides is.
    #[inline(always)]
    fn holds(&self, p: DVec2) -> bool {
        let value = self.value(p);
        value > 0.0 || (value == 0.0 && self.sign > 0.0)
    }

    /// Moves the ends of an interval of x, at height y, to where the value passes `-margin`.
    #[inline(always)]
    fn narrow(&self, y: f64, margin: f64, low: &mut f64, high: &mut f64) {
        let slope = -self.sign * self.along.y;
        let offset = self.sign * (self.along.x * (y - self.start.y) + self.along.y * self.start.x) + margin;
        if slope > 0.0 {
            *low = low.max(-offset / slope);
        } else if slope < 0.0 {
            *high = high.min(-offset / slope);
        }
    }
}

/// A triangle on the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    corners: [DVec2; 3],
    edges: [Edge; 3],
    low: DVec2,
    high: DVec2,
    /// Twice the area, signed, and its inverse.
    area: f64,
    inverse: f64,
}

impl Triangle {
    pub(super) fn new(corners: [DVec2; 3]) -> Self {
        let [a, b, c] = corners;
        let area = (b - a).perp_dot(c - a);
        let sign = if area < 0.0 { -1.0 } else { 1.0 };
        let edges = [Edge::new(a, b, sign), Edge::new(b, c, sign), Edge::new(c, a, sign)];
        Self { corners, edges, low: a.min(b).min(c), high: a.max(b).max(c), area, inverse: 1.0 / area }
    }

    /// Twice the area, square texels.
    pub(super) fn area(&self) -> f64 {
        self.area.abs()
    }

    /// Weights of the corners at a point; their sum is 1.
    #[inline(always)]
    pub(super) fn weights(&self, p: DVec2) -> [f32; 3] {
        let [a, b, c] = self.corners;
        let second = (p - a).perp_dot(c - a) * self.inverse;
        let third = (b - a).perp_dot(p - a) * self.inverse;
        [(1.0 - second - third) as f32, second as f32, third as f32]
    }

    /// Columns whose centres at height `y` the triangle holds; column `i` is at `(i + 0.5) / grid`.
    #[inline(always)]
    fn columns(&self, y: f64, grid: f64, width: usize) -> Range<usize> {
        let (mut low, mut high) = (self.low.x, self.high.x);
        self.edges.iter().for_each(|edge| edge.narrow(y, 0.0, &mut low, &mut high));
        // The division is only a guess to within a column; the edges decide, and along a row each of
        // them changes its mind only once.
        let column = |x: f64| (x * grid - 0.5).clamp(-2.0, width as f64 + 1.0) as i64;
        let mut first = (column(low) - 1).max(0) as usize;
        let mut end = ((column(high) + 3).max(0) as usize).min(width);
        let inside = |i: usize| {
            let p = DVec2::new((i as f64 + 0.5) / grid, y);
            self.edges.iter().all(|edge| edge.holds(p))
        };
        first = first.min(end);
        while first < end && !inside(first) {
            first += 1;
        }
        while end > first && !inside(end - 1) {
            end -= 1;
        }
        first..end
    }

    /// A point of the outline, moved a little towards the middle.
    fn inward(&self, p: DVec2) -> DVec2 {
        let [a, b, c] = self.corners;
        let way = (a + b + c) / 3.0 - p;
        p + way * (INWARD / way.length()).min(0.5)
    }

    /// The nearest point of the triangle to a point outside.
    fn nearest(&self, p: DVec2) -> DVec2 {
        let along = |a: DVec2, b: DVec2| {
            let length = (b - a).length_squared();
            let t = if length > 0.0 { ((p - a).dot(b - a) / length).clamp(0.0, 1.0) } else { 0.0 };
            a + (b - a) * t
        };
        let [a, b, c] = self.corners;
        let ends = [along(a, b), along(b, c), along(c, a)];
        ends.into_iter()
            .fold(ends[0], |best, q| if q.distance_squared(p) < best.distance_squared(p) { q } else { best })
    }
}

/// Rows of samples or texels of one band.
#[derive(Debug, Clone)]
pub(super) struct Window {
    /// The first row, and the one past the last.
    pub rows: Range<usize>,
    /// Samples across.
    pub width: usize,
    /// Samples a texel and axis.
    pub grid: usize,
}

impl Window {
    /// Where sample `column` of row `row` of the window lies, in texels.
    #[inline(always)]
    pub(super) fn centre(&self, row: usize, column: usize) -> DVec2 {
        let grid = self.grid as f64;
        DVec2::new((column as f64 + 0.5) / grid, ((self.rows.start + row) as f64 + 0.5) / grid)
    }

    /// The window's rows between two heights in texels.
    fn between(&self, low: f64, high: f64) -> Range<usize> {
        let row =
            |y: f64| (y * self.grid as f64).clamp(self.rows.start as f64, self.rows.end as f64) as usize;
        let (first, end) = (row(low.floor()), row(high.ceil()));
        first - self.rows.start..end - self.rows.start
    }

    /// Gives the samples inside a triangle that nobody owns to `chart`; returns how many had an owner.
    pub(super) fn cover(&self, triangle: &Triangle, chart: u32, owners: &mut [u32]) -> usize {
        let mut taken = 0;
        for row in self.between(triangle.low.y, triangle.high.y) {
            let y = self.centre(row, 0).y;
            let columns = triangle.columns(y, self.grid as f64, self.width);
            let line = row * self.width;
            for owner in &mut owners[line + columns.start..line + columns.end] {
                if *owner == NONE {
                    *owner = chart;
                } else {
                    taken += 1;
                }
            }
        }
        taken
    }

    /// For texels that own no sample (`grid` is 1 here), the nearest triangle that touches them.
    pub(super) fn touch(&self, triangle: &Triangle, chart: u32, free: &[bool], found: &mut [Touch]) {
        for row in self.between(triangle.low.y - 1.0, triangle.high.y + 1.0) {
            let y = self.centre(row, 0).y;
            if triangle.low.y > y + HALF || triangle.high.y < y - HALF {
                continue;
            }
            let (mut low, mut high) = (triangle.low.x - HALF, triangle.high.x + HALF);
            for edge in &triangle.edges {
                // How far the function falls from a texel's centre to its corner.
                let margin = HALF * (edge.along.x.abs() + edge.along.y.abs());
                if edge.along.y == 0.0 && edge.value(DVec2::new(0.0, y)) < -margin {
                    high = f64::NEG_INFINITY;
                }
                edge.narrow(y, margin, &mut low, &mut high);
            }
            let first = (low - 0.5).ceil().max(0.0);
            let end = ((high - 0.5).floor() + 1.0).min(self.width as f64);
            if first >= end {
                continue;
            }
            let line = row * self.width;
            for column in first as usize..end as usize {
                if free[line + column] {
                    let centre = self.centre(row, column);
                    let point = triangle.nearest(centre);
                    let distance = point.distance_squared(centre);
                    let best = &mut found[line + column];
                    if distance < best.distance {
                        *best = Touch { chart, distance, point: triangle.inward(point) };
                    }
                }
            }
        }
    }
}

/// The chart nearest to a texel's centre, and where.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    pub chart: u32,
    /// Squared, texels.
    pub distance: f64,
    pub point: DVec2,
}

impl Touch {
    /// No chart at all.
    pub(super) const NEVER: Self = Self { chart: NONE, distance: f64::INFINITY, point: DVec2::ZERO };
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 12;

    fn window(grid: usize) -> Window {
        Window { rows: 0..WIDTH * grid, width: WIDTH * grid, grid }
    }

    fn points(seed: u32, count: usize) -> Vec<DVec2> {
        let mut state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // Quarter texels, so that samples fall on edges and corners often.
            f64::from(state >> 26) / 4.0 - 2.0
        };
        (0..count).map(|_| DVec2::new(next(), next())).collect()
    }

    #[test]
    fn a_fan_owns_each_sample_once() {
        for grid in [1, 2, 3] {
            for seed in 0..200 {
                // A convex outline around a centre, so that the triangles do not overlap.
                let centre = points(seed, 1)[0];
                let outline: Vec<DVec2> = (0..7)
                    .map(|i| centre + DVec2::from_angle(f64::from(i) * 0.9 + f64::from(seed)) * 5.0)
                    .map(|p| (p * 4.0).round() / 4.0)
                    .collect();
                let mut owners = vec![NONE; window(grid).width.pow(2)];
                let mut taken = 0;
                for i in 0..6 {
                    let corners = [centre, outline[i], outline[i + 1]];
                    if (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) > 0.0 {
                        taken += window(grid).cover(&Triangle::new(corners), i as u32, &mut owners);
                    }
                }
                assert_eq!(taken, 0, "seed {seed}");
            }
        }
    }

    #[test]
    fn a_square_of_two_triangles_owns_all_its_samples() {
        let [a, b, c, d] = [(1.5, 1.5), (9.5, 1.5), (9.5, 9.5), (1.5, 9.5)].map(|(x, y)| DVec2::new(x, y));
        for corners in [[a, b, c], [c, b, a]] {
            let mut owners = vec![NONE; WIDTH * WIDTH];
            window(1).cover(&Triangle::new(corners), 0, &mut owners);
            window(1).cover(&Triangle::new([a, c, d]), 1, &mut owners);
            // Of the samples on the outline, each pair of opposite sides owns one.
            let owned = owners.iter().filter(|&&o| o != NONE).count();
            assert_eq!(owned, 64, "{corners:?}");
        }
    }

    #[test]
    fn samples_are_owned_as_plain_geometry_says() {
        for seed in 0..300 {
            let p = points(seed, 3);
            let corners = [p[0], p[1], p[2]];
            let triangle = Triangle::new(corners);
            if triangle.area == 0.0 {
                continue;
            }
            let mut owners = vec![NONE; WIDTH * WIDTH];
            window(1).cover(&triangle, 7, &mut owners);
            for row in 0..WIDTH {
                for column in 0..WIDTH {
                    let at = window(1).centre(row, column);
                    // Quarter texels: these products are exact.
                    let least = triangle.weights(at).into_iter().fold(f32::INFINITY, f32::min);
                    if least.abs() > 1e-6 {
                        assert_eq!(owners[row * WIDTH + column] == 7, least > 0.0, "seed {seed} at {at}");
                    }
                }
            }
        }
    }

    #[test]
    fn touched_texels_are_those_whose_square_meets_the_triangle() {
        for seed in 0..300 {
            let p = points(seed, 3);
            let triangle = Triangle::new([p[0], p[1], p[2]]);
            if triangle.area == 0.0 {
                continue;
            }
            let mut found = vec![Touch::NEVER; WIDTH * WIDTH];
            window(1).touch(&triangle, 3, &[true; WIDTH * WIDTH], &mut found);
            for row in 0..WIDTH {
                for column in 0..WIDTH {
                    let at = window(1).centre(row, column);
                    // Densely sampled interior of the texel's square, just inside its outline.
                    let steps = (0..=40).map(|k| f64::from(k) / 40.0 - 0.5);
                    let meets = steps.clone().any(|dy| {
                        steps.clone().any(|dx| {
                            let q = at + DVec2::new(dx, dy) * 0.999;
                            triangle.edges.iter().all(|edge| edge.value(q) > 0.0)
                        })
                    });
                    let touched = found[row * WIDTH + column].chart == 3;
                    assert!(touched || !meets, "seed {seed} at {at}");
                    if touched {
                        let apart = triangle.nearest(at).distance(at);
                        let inside = triangle.edges.iter().all(|edge| edge.value(at) >= 0.0);
                        assert!(inside || apart <= 0.5_f64.sqrt() + 1e-9, "seed {seed} at {at}: {apart}");
                    }
                }
            }
        }
    }
}
