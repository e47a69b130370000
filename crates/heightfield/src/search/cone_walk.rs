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

use super::cell_walk::{CellWalk, Cells, Leap, Stand};
use crate::lanes::Lanes;
use crate::{ConeKind, HeightField};

/// What a walk reads, and how long it may take. `BILINEAR` when the ratios belong to corners.
#[derive(Debug, Clone, Copy)]
pub struct ConeWalk<const BILINEAR: bool> {
    /// Map of empty cones.
    pub empty: ConeKind,
    /// Map of relaxed cones, if there are any.
    pub relaxed: Option<ConeKind>,
    /// Halvings of a jump that ended below the surface.
    pub refine: u32,
    /// Most steps.
    pub most_steps: u32,
}

/// Ratios of empty cones, and of relaxed ones if there are any.
#[derive(Clone, Copy)]
pub struct Ratios<'a> {
    empty: &'a [f32],
    relaxed: Option<&'a [f32]>,
}

/// The ratios for the points under rays: of their cells, or interpolated between the corners of these.
#[inline(always)]
fn ratio<L: Lanes, const BILINEAR: bool>(
    cones: &[f32],
    cells: &Cells<'_, L>,
    at: &Stand<L>,
    chosen: L::M,
) -> L::F {
    let patch = &at.patch;
    if !BILINEAR {
        return cells.of(cones, patch.corner, chosen);
    }
    let [x, y] = patch.local;
    let [c00, c10, c01, c11] = cells.around(cones, patch.corner);
    let (upper, lower) = (c00 + x * (c10 - c00), c01 + x * (c11 - c01));
    upper + y * (lower - upper)
}

impl<const BILINEAR: bool> Leap for ConeWalk<BILINEAR> {
    type Maps<'a> = Ratios<'a>;

    #[inline(always)]
    fn maps<'a>(&self, field: &'a HeightField) -> Option<Ratios<'a>> {
        let empty = field.cone_map(self.empty)?.values();
        let relaxed = match self.relaxed {
            Some(kind) => Some(field.cone_map(kind)?.values()),
            None => None,
        };
        Some(Ratios { empty, relaxed })
    }

    #[inline(always)]
    fn most_steps(&self) -> u32 {
        self.most_steps
    }

    /// Sideways, in UV units.
    #[inline(always)]
    fn pace<L: Lanes>(_: Ratios<'_>, delta: [L::F; 3]) -> L::F {
        L::sqrt(delta[0] * delta[0] + delta[1] * delta[1])
    }

    #[inline(always)]
    fn leap<L: Lanes>(maps: Ratios<'_>, rays: &CellWalk<L>, cells: &Cells<'_, L>, at: &Stand<L>) -> L::F {
        let zero = L::splat(0.0);
        let all = L::first(L::WIDTH);
        let c = match maps.relaxed {
            None => ratio::<L, BILINEAR>(maps.empty, cells, at, all),
            Some(relaxed) => {
                let falls = L::le(rays.rise(), zero);
                let wide = ratio::<L, BILINEAR>(relaxed, cells, at, falls);
                if L::any(rays.running & !falls) {
                    L::select(falls, wide, ratio::<L, BILINEAR>(maps.empty, cells, at, !falls))
                } else {
                    wide
                }
            }
        };
        let closing = rays.pace - c * rays.rise();
        let nears = L::lt(zero, closing);
        let open = L::lt(zero, at.gap) & L::le(rays.closed_until, rays.t);
        let jump = L::select(open & nears, rays.t + c * at.gap / closing, rays.t);
        L::select(open & !nears & L::lt(zero, c), L::splat(f32::INFINITY), jump)
    }

    #[inline(always)]
    fn land<L: Lanes>(&self, rays: &mut CellWalk<L>, cells: &Cells<'_, L>, chosen: L::M, jump: L::F) {
        let above = *rays;
        rays.jump(chosen, jump);
        if self.relaxed.is_none() {
            return;
        }
        let sunk = chosen & L::le(rays.rise(), L::splat(0.0)) & rays.below(cells, jump);
        if L::any(sunk) {
            *rays = rays.or(sunk, &above);
            self.halve(rays, cells, sunk, jump);
        }
    }
}

impl<const BILINEAR: bool> ConeWalk<BILINEAR> {
    /// Takes the chosen rays closer to where they go below the surface, which is before `below`; up to the
    /// last position below it they are to be followed cell by cell.
    #[inline(always)]
    fn halve<L: Lanes>(&self, rays: &mut CellWalk<L>, cells: &Cells<'_, L>, chosen: L::M, mut below: L::F) {
        let mut halving = chosen;
        for _ in 0..self.refine {
            let middle = L::splat(0.5) * (rays.t + below);
            let mut there = *rays;
            there.jump(halving, middle);
            halving = halving & !there.shares_cell(rays);
            if !L::any(halving) {
                break;
            }
            let under = there.below(cells, middle);
            below = L::select(halving & under, middle, below);
            *rays = rays.or(halving & !under, &there);
        }
        rays.closed_until = L::select(chosen, below, rays.closed_until);
    }
}
