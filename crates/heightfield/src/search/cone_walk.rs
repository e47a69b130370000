//! Stepping by cones; shared by every search that reads a cone map. The twin of
//! `shaders_wgsl/lib/cone_walk.wgsl`.
//!
//! Above a point of the surface, at a gap `g` over it, a ray that moves `l` sideways (UV units) while it
//! rises by `z` stays in the empty cone of ratio `c` for `c g / (l - c z)`. Where that does not take it
//! out of its cell, the ray is solved against the bilinear cell in closed form instead and goes on at
//! the cell's wall. So every step gains a cell at least, thin features are met wherever they stand, and
//! hits are exact.
//!
//! In a relaxed cone the ray may go below the surface, once. Where it ends up below, the way there is
//! halved a few times and what is left of it followed cell by cell. That holds for rays that do not
//! rise; the others use empty cones.

use glam::Vec3;

use super::cell_walk::{CellWalk, NOTHING, Patch};
use crate::{ConeKind, Found, HeightField};

/// What a walk reads, and how long it may take.
#[derive(Debug, Clone, Copy)]
pub struct ConeWalk {
    /// Map of empty cones.
    pub empty: ConeKind,
    /// Map of relaxed cones, if there are any.
    pub relaxed: Option<ConeKind>,
    /// Halvings of a jump that ended below the surface.
    pub refine: u32,
    /// Most steps.
    pub most_steps: u32,
}

/// The ratio for the point under the ray: of its cell, or interpolated between its corners.
#[inline(always)]
fn ratio<const BILINEAR: bool>(cones: &[f32], stride: usize, patch: &Patch) -> f32 {
    let at = patch.id[1] * stride + patch.id[0];
    if !BILINEAR {
        return cones[at];
    }
    let [x, y] = patch.local;
    let row = |at: usize| cones[at] + x * (cones[at + 1] - cones[at]);
    let (upper, lower) = (row(at), row(at + stride));
    upper + y * (lower - upper)
}

impl ConeWalk {
    /// Follows a segment to the first point on or below the surface.
    ///
    /// `BILINEAR` when the ratios belong to corners. With `from_surface` the start lies on the surface and
    /// is no hit. Nothing is found without the maps.
    #[inline(always)]
    pub fn trace<const BILINEAR: bool>(
        &self,
        field: &HeightField,
        start: Vec3,
        delta: Vec3,
        from_surface: bool,
    ) -> Found {
        let Some(mut open) = field.cone_map(self.empty) else { return NOTHING };
        let relaxed = self.relaxed.is_some() && delta.z <= 0.0;
        if let Some(kind) = self.relaxed {
            let Some(wide) = field.cone_map(kind) else { return NOTHING };
            open = if relaxed { wide } else { open };
        }
        let open = open.values();
        let Some(mut ray) = CellWalk::new(field, start, delta, from_surface) else { return NOTHING };
        let stride = field.cells()[0] + 1;
        let dz = delta.z;
        let lateral = (delta.x * delta.x + delta.y * delta.y).sqrt();
        // Up to here the ray is followed cell by cell.
        let mut closed_until = 0.0_f32;
        for steps in 1..=self.most_steps {
            let stand = ray.stand(field);
            if stand.gap <= 0.0 && !stand.on_surface {
                return Found::hit(ray.t, steps);
            }
            let mut jump = ray.t;
            if stand.gap > 0.0 && ray.t >= closed_until {
                let c = ratio::<BILINEAR>(open, stride, &stand.patch);
                let closing = lateral - c * dz;
                if closing > 0.0 {
                    jump = ray.t + c * stand.gap / closing;
                } else if c > 0.0 {
                    jump = f32::INFINITY;
                }
            }
            if jump == f32::INFINITY {
                return Found::left(steps);
            }
            if jump > stand.exit() {
                let (above, x, y) = (ray.t, ray.x, ray.y);
                ray.jump(jump);
                if relaxed && ray.z(jump) <= Patch::new(field, &ray.x, &ray.y, jump).height {
                    (ray.t, ray.x, ray.y) = (above, x, y);
                    closed_until = self.halve(field, &mut ray, jump);
                }
            } else if let Some(t) = ray.cross(&stand) {
                return Found::hit(t, steps);
            }
            if ray.has_left() {
                return Found::left(steps);
            }
        }
        ray.unconverged(self.most_steps)
    }

    /// Takes a ray closer to where it goes below the surface, which is before `below`; returns up to where
    /// it is to be followed cell by cell.
    #[inline(always)]
    fn halve(&self, field: &HeightField, ray: &mut CellWalk, mut below: f32) -> f32 {
        for _ in 0..self.refine {
            let middle = 0.5 * (ray.t + below);
            let (mut x, mut y) = (ray.x, ray.y);
            x.place(middle);
            y.place(middle);
            if x.cell == ray.x.cell && y.cell == ray.y.cell {
                break;
            }
            if ray.z(middle) <= Patch::new(field, &x, &y, middle).height {
                below = middle;
            } else {
                (ray.t, ray.x, ray.y) = (middle, x, y);
            }
        }
        below
    }
}
