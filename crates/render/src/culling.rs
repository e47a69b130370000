//! Which groups of triangles can be seen at all, decided on the host before anything is drawn.
//!
//! Every test errs on the side of drawing: what is left out covers no pixel's middle, rounding on the device included.
//! Positions reach it in `f32`, and it rounds places in the picture to 1/256 pixel (Vulkan's
//! `subPixelPrecisionBits`: 8 on every device that this is likely to meet).

use std::ops::Range;

use glam::{DMat4, DVec3};

use crate::camera::Frustum;
use crate::clusters::Cluster;
use crate::covers::{Candidate, Covers};
use crate::walls::{Screen, Wall};
use crate::{Camera, Skipped, Skips};

/// Grid that devices round places in the picture to, pixels: twice how far off a corner can be.
const SNAP: f64 = 1.0 / 256.0;

/// Walls that everything is tested against at most.
const MOST_SCREENS: usize = 16;

/// A view, and what may be left out of it.
pub(crate) struct Culling {
    skips: Skips,
    frustum: Frustum,
    size: [f64; 2],
    /// Pixels that a unit at distance 1 covers.
    focal: f64,
    near: f64,
    /// How far off a corner may be drawn, pixels.
    off: f64,
    /// Walls that hide what is behind them.
    screens: Vec<Screen>,
    /// What other meshes hide.
    covers: Option<Covers>,
}

/// Merges runs that follow one another.
fn add_run(runs: &mut Vec<Range<u32>>, first: u32, end: u32) {
    match runs.last_mut() {
        Some(last) if last.end == first => last.end = end,
        _ => runs.push(first..end),
    }
}

/// How a draw stands in a view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stand {
    /// From the centred mesh to world axes around the camera.
    pub relative_from_object: DMat4,
    /// The camera, space of the centred mesh.
    pub eye: DVec3,
    /// Longest stretch of the transform, or more.
    pub stretch: f64,
    /// What volumes are multiplied by.
    pub volume: f64,
    /// Ball around all of the draw, world units.
    pub radius: f64,
    /// Whether backs show as well.
    pub double_sided: bool,
    /// Whether the transform turns the winding around.
    pub mirrored: bool,
}

impl Stand {
    /// `radius`: of the ball around the draw, mesh units.
    pub fn new(relative_from_object: DMat4, radius: f64, double_sided: bool) -> Self {
        let m = &relative_from_object;
        // The Frobenius norm is never less than the longest stretch.
        let squares = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().length_squared());
        let stretch = squares.iter().sum::<f64>().sqrt();
        Self {
            relative_from_object,
            eye: relative_from_object.inverse().w_axis.truncate(),
            stretch,
            radius: radius * stretch,
            volume: relative_from_object.determinant().abs(),
            mirrored: relative_from_object.determinant() < 0.0,
            double_sided,
        }
    }
}

/// Where a ball is in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outline {
    /// Pixels: least and greatest of the ball across and down.
    pub low: [f64; 2],
    pub high: [f64; 2],
    /// Nearest and farthest distance along the view axis.
    pub near: f64,
    pub far: f64,
}

impl Culling {
    pub fn new(camera: &Camera, size: [u32; 2], skips: Skips) -> Self {
        let [width, height] = size.map(f64::from);
        Self {
            skips,
            frustum: camera.frustum(width / height),
            size: [width, height],
            focal: height / (2.0 * (0.5 * camera.fov_y).tan()),
            near: camera.near(),
            off: SNAP + width.max(height) * 1e-6,
            screens: Vec::new(),
            covers: None,
        }
    }

    /// The outline of a ball around a point relative to the camera; `None` where it reaches the near plane.
    pub fn outline(&self, centre: DVec3, radius: f64) -> Option<Outline> {
        let Frustum { right, up, forward, .. } = self.frustum;
        let [x, y, z] = [right, -up, forward].map(|axis| centre.dot(axis));
        let (near, far) = (z - radius, z + radius);
        if near <= self.near {
            return None;
        }
        let side = |place: f64, share: f64, farthest: bool| {
            let edge = if farthest { place + radius } else { place - radius };
            let depth = if (edge < 0.0) == farthest { far } else { near };
            0.5 * share + self.focal * edge / depth
        };
        let [width, height] = self.size;
        let low = [side(x, width, false) - self.off, side(y, height, false) - self.off];
        let high = [side(x, width, true) + self.off, side(y, height, true) + self.off];
        Some(Outline { low, high, near, far })
    }

    /// Whether a ball relative to the camera covers no pixel's middle.
    fn is_outside(&self, centre: DVec3, radius: f64) -> bool {
        // Beside the picture, or between the middles of pixels, which are at halves.
        self.frustum.misses(centre, radius)
            || self.outline(centre, radius).is_some_and(|outline| {
                [0, 1]
                    .iter()
                    .any(|&axis| (outline.low[axis] - 0.5).ceil() > (outline.high[axis] - 0.5).floor())
            })
    }

    /// Whether all triangles of a group turn their backs, and clearly so: a triangle seen nearly from its edge may
    /// be turned around when its corners are rounded.
    fn is_turned_away(&self, stand: &Stand, group: &Cluster) -> bool {
        let to_centre = group.centre - stand.eye;
        let distance = to_centre.length();
        let cos_view = to_centre.dot(group.axis) / distance;
        let sin = |cos: f64| (1.0 - cos * cos).max(0.0).sqrt();
        // Of the angle between the view and the normal that is farthest from it.
        let cos_worst = cos_view * group.cos_spread - sin(cos_view) * sin(group.cos_spread);
        // How far the eye is behind each triangle's plane.
        let behind = cos_worst * distance - group.radius;
        if !(cos_view > 0.0 && group.cos_spread > 0.0 && cos_worst > 0.0 && behind > 0.0) {
            return false;
        }
        let centre = stand.relative_from_object.transform_point3(group.centre);
        let radius = group.radius * stand.stretch;
        let depth = centre.dot(self.frustum.forward);
        let (near, far) = (depth - radius, depth + radius);
        if near <= self.near {
            return false;
        }
        // Twice a triangle's area in pixels is the volume between it and the eye over the three depths, and less
        // than the longest side times what its corners may be off is not clear.
        let aside = ((centre - self.frustum.forward * depth).length() + radius) / near;
        let area = self.focal * stand.volume * group.least_height * behind / (far * far * far);
        let rounded = 3.0 * (self.off + self.focal * aside * 2e-6) * stand.stretch * aside.hypot(1.0) / near;
        area > 2.0 * rounded
    }

    /// Whether nothing within a ball relative to the camera is in the picture, if that may be left out.
    pub fn misses(&self, centre: DVec3, radius: f64) -> bool {
        self.skips.contains(Skips::FRUSTUM) && self.is_outside(centre, radius)
    }

    /// Takes a wall of a draw into account. `middle`: of its mesh; `depth`: how deep its relief goes, mesh units.
    pub fn add_wall(&mut self, wall: &Wall, stand: &Stand, middle: DVec3, depth: f64) {
        if self.skips.contains(Skips::OCCLUSION) {
            self.screens.extend(Screen::new(wall, stand, middle, depth, self.frustum.forward, self.near));
        }
    }

    /// Keeps the walls that hide most.
    pub fn settle_walls(&mut self) {
        self.screens.sort_by(|a, b| b.size.total_cmp(&a.size));
        self.screens.truncate(MOST_SCREENS);
    }

    /// Takes into account what meshes cover.
    pub fn add_covers(&mut self, draws: &[Candidate<'_>]) {
        self.covers = Covers::of(draws, self);
    }

    /// Whether a ball relative to the camera is behind a wall or another mesh.
    pub fn is_hidden(&self, centre: DVec3, radius: f64) -> bool {
        let behind = |covers: &Covers| {
            self.outline(centre, radius).is_some_and(|outline| covers.hides(&outline, self.size))
        };
        self.screens.iter().any(|screen| screen.hides(centre, radius, 1.0 / self.focal))
            || self.covers.as_ref().is_some_and(behind)
    }

    /// Pixels of the picture across and down.
    pub fn size(&self) -> [f64; 2] {
        self.size
    }

    /// Where a point relative to the camera is in the picture, pixels across and down, and its depth; `None` before the
    /// near plane.
    pub fn in_picture(&self, point: DVec3) -> Option<[f64; 3]> {
        let Frustum { right, up, forward, .. } = self.frustum;
        let [x, y, depth] = [right, -up, forward].map(|axis| point.dot(axis));
        let [width, height] = self.size;
        let place = |at: f64, share: f64| 0.5 * share + self.focal * at / depth;
        (depth > self.near * 1.01).then(|| [place(x, width), place(y, height), depth])
    }

    /// Runs of triangles that may be seen. `solid`: whether nothing shows before the triangles themselves.
    pub fn visible(
        &self,
        stand: &Stand,
        groups: &[Cluster],
        solid: bool,
        skipped: &mut Skipped,
    ) -> Vec<Range<u32>> {
        let turns = self.skips.contains(Skips::BACKFACE) && !stand.double_sided;
        let mut runs = Vec::new();
        for group in groups {
            let count = u64::from(group.end - group.first);
            let centre = stand.relative_from_object.transform_point3(group.centre);
            if self.misses(centre, group.radius * stand.stretch) {
                skipped.add(Skips::FRUSTUM, count);
            } else if turns && self.is_turned_away(stand, group) {
                skipped.add(Skips::BACKFACE, count);
            } else if solid && self.is_hidden(centre, group.radius * stand.stretch) {
                skipped.add(Skips::OCCLUSION, count);
            } else {
                add_run(&mut runs, group.first, group.end);
            }
        }
        runs
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DQuat;
    use mesh::Mesh;

    use super::*;
    use crate::clusters::Clusters;

    /// Signed area of a triangle in the picture, and its corners there; `None` when one is not before the camera.
    fn on_screen(camera: &Camera, size: [u32; 2], corners: [DVec3; 3]) -> Option<(f64, [[f64; 2]; 3])> {
        let clip = camera.clip_from_relative(size, 0, size[1]);
        let mut places = [[0.0; 2]; 3];
        for (place, corner) in places.iter_mut().zip(corners) {
            let at = clip * corner.extend(1.0);
            if at.w <= camera.near() {
                return None;
            }
            *place = [
                (at.x / at.w + 1.0) * 0.5 * f64::from(size[0]),
                (1.0 - at.y / at.w) * 0.5 * f64::from(size[1]),
            ];
        }
        let [a, b, c] = places;
        // Rows run down.
        Some((-((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])), places))
    }

    /// Whether some pixel's middle may be in a triangle whose corners may be a little off.
    fn touches_a_pixel(size: [u32; 2], places: [[f64; 2]; 3]) -> bool {
        let ends = |axis: usize| {
            let parts = places.map(|place| place[axis]);
            let low = parts.iter().copied().fold(f64::INFINITY, f64::min) - 1.0 / 512.0;
            let high = parts.iter().copied().fold(f64::NEG_INFINITY, f64::max) + 1.0 / 512.0;
            (low.max(0.5), high.min(f64::from(size[axis]) - 0.5))
        };
        [0, 1].iter().all(|&axis| (ends(axis).0 - 0.5).ceil() <= (ends(axis).1 - 0.5).floor())
    }

    #[test]
    fn nothing_is_left_out_that_could_show() {
        let size = [160, 120];
        let mut left_out = [0_u64; 2];
        for (number, mesh) in
            [Mesh::sphere(0.5, 64).unwrap(), Mesh::torus(0.5, 0.2, 96, 48).unwrap()].iter().enumerate()
        {
            let count = mesh.indices.len() as u32;
            let clusters = Clusters::new(mesh, 0..count, DVec3::ZERO);
            for step in 0..60 {
                let turn = f64::from(step) * TAU / 17.0;
                let axis = DVec3::new(turn.sin(), 0.3, turn.cos()).normalize();
                let scale =
                    [DVec3::ONE, DVec3::new(1.0, 0.05, 2.0), DVec3::new(-1.0, 1.0, 0.7)][step as usize % 3];
                let place = DMat4::from_rotation_translation(
                    DQuat::from_axis_angle(axis, turn * 1.7),
                    DVec3::new(turn.sin() * 0.4, turn.cos() * 0.7, 0.0),
                ) * DMat4::from_scale(scale);
                let distance = [0.8, 2.0, 9.0, 70.0][step as usize % 4];
                let camera = Camera::look_at(DVec3::new(0.1, 0.2, distance), DVec3::new(0.1, 0.1, 0.0));
                let relative = DMat4::from_translation(-camera.eye) * place;
                let culling = Culling::new(&camera, size, Skips::ALL);
                let mut skipped = Skipped::default();
                let runs =
                    culling.visible(&Stand::new(relative, 1.0, false), &clusters.groups, true, &mut skipped);
                let shown: u64 = runs.iter().map(|run| u64::from(run.end - run.start)).sum();
                let lost = [Skips::FRUSTUM, Skips::BACKFACE].map(|kind| skipped.of(kind));
                assert_eq!(shown + lost[0] + lost[1], u64::from(count));
                left_out = [left_out[0] + lost[0], left_out[1] + lost[1]];
                let mirrored = if place.determinant() < 0.0 { -1.0 } else { 1.0 };
                for at in (0..count).filter(|at| !runs.iter().any(|run| run.contains(at))) {
                    let corners = clusters.triangles[at as usize]
                        .map(|corner| relative.transform_point3(mesh.positions[corner as usize].as_dvec3()));
                    if let Some((area, places)) = on_screen(&camera, size, corners) {
                        assert!(
                            area * mirrored < 0.0 || !touches_a_pixel(size, places),
                            "mesh {number}, step {step}: triangle {at} shows {area}"
                        );
                    }
                }
                // All of it is there when nothing may be left out.
                let all = Culling::new(&camera, size, Skips::NONE);
                let whole =
                    all.visible(&Stand::new(relative, 1.0, false), &clusters.groups, true, &mut skipped);
                assert!(whole.len() == 1 && whole[0] == (0..count));
            }
        }
        // A good part of it each.
        assert!(left_out[0] > 20_000 && left_out[1] > 100_000, "{left_out:?}");
    }

    #[test]
    fn backs_of_double_sided_meshes_stay() {
        let mesh = Mesh::sphere(0.5, 64).unwrap();
        let clusters = Clusters::new(&mesh, 0..mesh.indices.len() as u32, DVec3::ZERO);
        let camera = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO);
        let relative = DMat4::from_translation(-camera.eye);
        let culling = Culling::new(&camera, [200, 200], Skips::ALL);
        let mut skipped = Skipped::default();
        culling.visible(&Stand::new(relative, 1.0, true), &clusters.groups, true, &mut skipped);
        assert_eq!(skipped, Skipped::default());
        culling.visible(&Stand::new(relative, 1.0, false), &clusters.groups, true, &mut skipped);
        assert!(skipped.of(Skips::BACKFACE) > mesh.indices.len() as u64 / 5, "{skipped:?}");
    }
}
