//! Every cone of whole maps against all pairs, in `f64`: from each texel's centre to every cell, and from each edge
//! between two of them to every centre. `cone_exact` shows by samples that no other pairs count.
#![allow(clippy::unwrap_used)]

mod cone_maps;

use bake::{ConeMode, Progress, cone_map};
use cone_maps::{from_fn, noise, waves};
use heightfield::{HeightField, Wrap};
use rayon::prelude::*;

/// What is not this much steeper than the steepest known is not looked at.
const CLOSE: f64 = 1.0 + 1e-9;

/// Heights of a tiled square map; lengths in UV units.
struct Surface {
    n: i64,
    heights: Vec<f64>,
    /// The highest corner of each cell.
    highest: Vec<f64>,
}

/// A number between `0` and `1` at which `f` is greatest, if it rises up to there and falls from there on.
fn greatest(f: impl Fn(f64) -> f64) -> f64 {
    let (mut from, mut to) = (0.0, 1.0);
    for _ in 0..48 {
        let (a, b) = (from + 0.382 * (to - from), from + 0.618 * (to - from));
        if f(a) < f(b) { from = a } else { to = b }
    }
    f(0.5 * (from + to)).max(f(0.0)).max(f(1.0))
}

impl Surface {
    fn new(field: &HeightField) -> Self {
        let n = field.width() as i64;
        let heights: Vec<f64> = field.texels().iter().map(|&height| f64::from(height)).collect();
        let mut surface = Self { n, heights, highest: Vec::new() };
        surface.highest =
            (0..n * n).map(|at| surface.cell([at % n, at / n]).into_iter().fold(0.0, f64::max)).collect();
        surface
    }

    fn at(&self, [i, j]: [i64; 2]) -> usize {
        (j.rem_euclid(self.n) * self.n + i.rem_euclid(self.n)) as usize
    }

    fn height(&self, place: [i64; 2]) -> f64 {
        self.heights[self.at(place)]
    }

    /// Heights of the corners of the cell whose first corner this is.
    fn cell(&self, [i, j]: [i64; 2]) -> [f64; 4] {
        [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]].map(|place| self.height(place))
    }

    /// Offsets of the images next to a place.
    fn around(&self) -> impl Iterator<Item = [i64; 2]> + use<> {
        let half = -self.n / 2 - 1..=self.n / 2;
        half.clone().flat_map(move |y| half.clone().map(move |x| [x, y]))
    }

    /// The steepest rise from a centre.
    fn rise_of_centre(&self, from: [i64; 2]) -> f64 {
        let (n, low) = (self.n as f64, self.height(from));
        let place = |[x, y]: [i64; 2]| [from[0] + x, from[1] + y];
        let mut best = 0.0_f64;
        for offset in self.around().filter(|&offset| offset != [0, 0]) {
            let rise = self.height(place(offset)) - low;
            let square = (offset[0] * offset[0] + offset[1] * offset[1]) as f64;
            if rise > 0.0 && rise * rise * n * n > best * best * square {
                best = rise * n / square.sqrt();
            }
        }
        for offset in self.around() {
            let gap = offset.map(|o| o.max(-1 - o).max(0) as f64);
            let square = gap[0] * gap[0] + gap[1] * gap[1];
            let rise = (self.highest[self.at(place(offset))] - low) * n;
            if rise > 0.0 && rise * rise > best * best * CLOSE * square {
                best = best.max(self.to_cell(place(offset), low, offset, best));
            }
        }
        best
    }

    /// The steepest rise to a cell at an offset, if it may be steeper than `best`.
    fn to_cell(&self, cell: [i64; 2], low: f64, offset: [i64; 2], best: f64) -> f64 {
        let n = self.n as f64;
        let rises = self.cell(cell).map(|height| (height - low) * n);
        let [x, y] = offset.map(|o| o as f64);
        let touches = offset.iter().all(|o| (-1..=0).contains(o));
        if touches {
            // From its corner, straight lines into it are steepest at their beginning or where they leave it.
            let [h00, h10, h01, h11] = rises;
            let across = if offset[1] == 0 { h10 - h00 } else { h11 - h01 };
            let down = if offset[0] == 0 { h01 - h00 } else { h11 - h10 };
            let (a, b) =
                (if offset[0] == 0 { across } else { -across }, if offset[1] == 0 { down } else { -down });
            let begin = if a > 0.0 && b > 0.0 { a.hypot(b) } else { a.max(b) };
            return begin.max(self.to_border(rises, [x, y]));
        }
        let centre = [x + 0.5, y + 0.5];
        let away = centre[0].hypot(centre[1]);
        // Above this plane through the centre a bilinear cell rises at a corner, if anywhere.
        let corners = [[x, y], [x + 1.0, y], [x, y + 1.0], [x + 1.0, y + 1.0]];
        let above = corners.iter().zip(rises).any(|(corner, rise)| {
            rise > best * CLOSE * (corner[0] * centre[0] + corner[1] * centre[1]) / away
        });
        if !above {
            return best;
        }
        let rise = |s: f64, t: f64| {
            let (top, bottom) = (rises[0] + s * (rises[1] - rises[0]), rises[2] + s * (rises[3] - rises[2]));
            (top + t * (bottom - top)) / (x + s).hypot(y + t)
        };
        // Across the cell the greatest of each column is looked for on a grid and then around the best.
        let column = |s: f64| greatest(|t| rise(s, t));
        let columns = 16.0;
        let most =
            (0..16).map(|k| (f64::from(k) + 0.5) / columns).max_by(|a, b| column(*a).total_cmp(&column(*b)));
        let from = most.unwrap_or(0.5) - 1.0 / columns;
        let inside = greatest(|s| column((from + 2.0 / columns * s).clamp(0.0, 1.0)));
        inside.max(self.to_border(rises, [x, y]))
    }

    /// The steepest rise to the sides of a cell.
    fn to_border(&self, [h00, h10, h01, h11]: [f64; 4], [x, y]: [f64; 2]) -> f64 {
        let sides = [
            ([h00, h10], [x, y], [1.0, 0.0]),
            ([h01, h11], [x, y + 1.0], [1.0, 0.0]),
            ([h00, h01], [x, y], [0.0, 1.0]),
            ([h10, h11], [x + 1.0, y], [0.0, 1.0]),
        ];
        let rise = |([from, to], start, way): ([f64; 2], [f64; 2], [f64; 2])| {
            greatest(|t| {
                let away = (start[0] + t * way[0]).hypot(start[1] + t * way[1]);
                if away > 1e-9 { (from + t * (to - from)) / away } else { 0.0 }
            })
        };
        sides.into_iter().map(rise).fold(0.0, f64::max)
    }

    /// The steepest rise from inside the edge from a centre to the next along an axis, to a centre beside it.
    fn rise_of_edge(&self, from: [i64; 2], axis: usize) -> f64 {
        let n = self.n as f64;
        let mut to = from;
        to[axis] += 1;
        let ends = [self.height(from), self.height(to)];
        let lowest = ends[0].min(ends[1]);
        let mut best = 0.0_f64;
        for offset in self.around().filter(|offset| offset[1 - axis] != 0) {
            let rise = (self.height([from[0] + offset[0], from[1] + offset[1]]) - lowest) * n;
            let (along, apart) = (offset[axis] as f64, offset[1 - axis] as f64);
            let gap = along.max(1.0 - along).max(1.0) - 1.0;
            let square = gap * gap + apart * apart;
            if rise > 0.0 && rise * rise > best * best * CLOSE * square {
                let rises = ends.map(|end| rise + (lowest - end) * n);
                let middle = [along - 0.5, apart];
                let away = middle[0].hypot(middle[1]);
                // As for cells: with a vector from middle to middle for the way, an end decides.
                let beyond = |at: f64| best * CLOSE * ((along - at) * middle[0] + apart * middle[1]) / away;
                if rises[0] > beyond(0.0) || rises[1] > beyond(1.0) {
                    let slope = |t: f64| (rises[0] + t * (rises[1] - rises[0])) / (along - t).hypot(apart);
                    best = best.max(greatest(slope));
                }
            }
        }
        best
    }

    /// The steepest gradient in the cells around a centre, and of those around them where it leads outwards.
    fn gradients(&self, [i, j]: [i64; 2]) -> f64 {
        let n = self.n as f64;
        let mut most = 0.0_f64;
        for [x, y] in (-2..=1).flat_map(|y| (-2..=1).map(move |x| [x, y])) {
            let [h00, h10, h01, h11] = self.cell([i + x, j + y]);
            for (s, t) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let du = if t == 0 { h10 - h00 } else { h11 - h01 };
                let dv = if s == 0 { h01 - h00 } else { h11 - h10 };
                let counts = |place: i64, end: i64, slope: f64| match place {
                    -2 => end == 1 && slope < 0.0,
                    1 => end == 0 && slope > 0.0,
                    _ => true,
                };
                if counts(x, s, du) && counts(y, t, dv) {
                    most = most.max(du.hypot(dv) * n);
                }
            }
        }
        most
    }

    /// The widest cones of the texels of some rows, with their places on the map.
    fn ratios(&self, rows: &[i64]) -> Vec<(usize, f64)> {
        let n = self.n;
        let places = |rows: Vec<i64>| -> Vec<[i64; 2]> {
            rows.into_iter().flat_map(|j| (0..n).map(move |i| [i, j])).collect()
        };
        let beside = |j: i64| rows.iter().any(|row| (row - j + 1).rem_euclid(n) <= 2);
        let looked_at = places((0..n).filter(|&j| beside(j)).collect());
        let all = |f: &(dyn Fn([i64; 2]) -> f64 + Sync)| -> Vec<f64> {
            let found: Vec<f64> = looked_at.par_iter().map(|&place| f(place)).collect();
            let mut map = vec![f64::NAN; (n * n) as usize];
            looked_at.iter().zip(found).for_each(|(&place, rise)| map[self.at(place)] = rise);
            map
        };
        let centres = all(&|place| self.rise_of_centre(place));
        let edges = [all(&|place| self.rise_of_edge(place, 0)), all(&|place| self.rise_of_edge(place, 1))];
        let ratio = |&[i, j]: &[i64; 2]| {
            let mut most = self.gradients([i, j]).max(1.0);
            for [x, y] in (-1..=1).flat_map(|y| (-1..=1).map(move |x| [x, y])) {
                most = most.max(centres[self.at([i + x, j + y])]);
                for (axis, edges) in edges.iter().enumerate() {
                    if [x, y][axis] < 1 {
                        most = most.max(edges[self.at([i + x, j + y])]);
                    }
                }
            }
            1.0 / most
        };
        places(rows.to_vec()).iter().map(|place| (self.at(*place), ratio(place))).collect()
    }
}

/// The least and the most that some rows of a map give away.
fn given_away(field: &HeightField, rows: &[i64]) -> [f64; 2] {
    let map = cone_map(field, ConeMode::Conservative, Progress::none()).unwrap();
    let truth = Surface::new(field).ratios(rows);
    let lost = truth.iter().map(|&(at, truth)| truth - f64::from(map[at]));
    lost.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], lost| [least.min(lost), most.max(lost)])
}

fn fields(n: usize) -> Vec<(&'static str, HeightField)> {
    let folded = |x: usize| 1.0 - (2.0 * x as f32 / n as f32 - 1.0).abs();
    let turn = std::f32::consts::TAU / n as f32;
    let smooth = waves(n, n, Wrap::Repeat).texels();
    let rough = noise(n, n, Wrap::Repeat, 4).texels();
    vec![
        ("noise", noise(n, n, Wrap::Repeat, 9)),
        ("waves", waves(n, n, Wrap::Repeat)),
        (
            "rough waves",
            from_fn(n, n, Wrap::Repeat, |i, j| 0.95 * smooth[j * n + i] + 0.05 * rough[j * n + i]),
        ),
        (
            "product",
            from_fn(n, n, Wrap::Repeat, |i, j| {
                0.5 + 0.5 * (3.0 * i as f32 * turn).sin() * (2.0 * j as f32 * turn).cos()
            }),
        ),
        ("ridge", from_fn(n, n, Wrap::Repeat, |i, _| folded(i))),
        ("pyramid", from_fn(n, n, Wrap::Repeat, |i, j| folded(i).min(folded(j)))),
        ("terraces", from_fn(n, n, Wrap::Repeat, |i, j| (folded((i + 3 * j) % n) * 12.0).floor() / 12.0)),
    ]
}

fn check(n: usize, rows: impl Iterator<Item = i64> + Clone) {
    for (name, field) in fields(n) {
        let [least, most] = given_away(&field, &rows.clone().collect::<Vec<_>>());
        println!("{n} x {n} {name}: gives away {least:.1e} to {most:.1e}");
        assert!(least >= -1e-9 && most <= 1e-6, "{name}: {least:.2e} to {most:.2e}");
    }
}

#[test]
fn all_cones_of_small_maps_are_those_of_all_pairs() {
    check(20, 0..20);
}

#[test]
#[ignore = "minutes: 1792 texels of each map and those around them, each with 65536 cells and edges"]
fn rows_of_cones_of_256_texels_squared_are_those_of_all_pairs() {
    check(256, (5..256).step_by(37));
}
