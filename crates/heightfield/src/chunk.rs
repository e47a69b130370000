//! A run of rays and the places their results go.

// Unchecked table reads.
#![allow(unsafe_code)]

use std::sync::atomic::{AtomicBool, Ordering};

use crate::lanes::Lanes;
use crate::march::texture_space_normal;
use crate::{HeightField, RayArray, Status};

/// A run of rays and the places their results go.
pub struct Chunk<'a> {
    pub(crate) origins: RayArray<'a>,
    pub(crate) directions: RayArray<'a>,
    /// Where the runs of [`RUN`](crate::order::RUN) rays begin, in the order in which the exact search follows
    /// them; none at all when rays are followed in the order they have.
    pub(crate) order: &'a [u32],
    pub(crate) from_surface: bool,
    pub(crate) cancel: Option<&'a AtomicBool>,
    pub(crate) t: Option<&'a mut [f32]>,
    pub(crate) uv: Option<&'a mut [f32]>,
    pub(crate) z: Option<&'a mut [f32]>,
    pub(crate) normal: Option<&'a mut [f32]>,
    pub(crate) steps: Option<&'a mut [u32]>,
    pub(crate) status: Option<&'a mut [u8]>,
}

/// How some rays ended: with a hit, or beyond the relief.
pub(crate) struct Outcome<L: Lanes> {
    /// Which met the surface.
    pub hit: L::M,
    /// Which of the others are unconverged.
    pub unconverged: L::M,
    /// Ray parameter of the hit.
    pub t: L::D,
    /// Height reads or nodes visited.
    pub steps: L::I,
}

impl Chunk<'_> {
    /// Whether the caller asked to stop. A ray may take milliseconds, so each asks anew.
    #[inline(always)]
    pub(crate) fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// Writes what one ray gave; the gradient of the surface is only asked for when it is needed.
    #[inline(always)]
    pub(crate) fn write(
        &mut self,
        i: usize,
        status: Status,
        t: f64,
        steps: u32,
        gradient: impl FnOnce() -> [f64; 2],
    ) {
        let hit = status == Status::Hit;
        if let Some(out) = &mut self.t {
            out[i] = if hit { t as f32 } else { f32::INFINITY };
        }
        if let Some(out) = &mut self.steps {
            out[i] = steps;
        }
        if let Some(out) = &mut self.status {
            out[i] = status as u8;
        }
        if self.uv.is_some() || self.z.is_some() {
            let o = self.origins.get(i);
            let d = self.directions.get(i);
            let at = |axis: usize| if hit { (o[axis] + d[axis] * t) as f32 } else { f32::NAN };
            if let Some(out) = &mut self.uv {
                out[2 * i..2 * i + 2].copy_from_slice(&[at(0), at(1)]);
            }
            if let Some(out) = &mut self.z {
                out[i] = at(2);
            }
        }
        if let Some(out) = &mut self.normal {
            let n = if hit { texture_space_normal(gradient()) } else { [f32::NAN; 3] };
            out[3 * i..3 * i + 3].copy_from_slice(&n);
        }
    }

    /// Writes what the chosen rays of a vector gave, whose first is ray `at`.
    #[inline(always)]
    pub(crate) fn write_all<L: Lanes>(
        &mut self,
        field: &HeightField,
        at: usize,
        chosen: L::M,
        outcome: &Outcome<L>,
        origin: [L::D; 3],
        direction: [L::D; 3],
    ) {
        let bits = L::bits(chosen);
        if bits == 0 {
            return;
        }
        if let Some(out) = &mut self.t {
            let t = L::select(outcome.hit, L::narrow(outcome.t), L::splat(f32::INFINITY));
            scatter::<L, 1>(out, at, bits, [t]);
        }
        if let Some(out) = &mut self.steps {
            let mut steps = [0; 16];
            L::store_int(outcome.steps, &mut steps);
            each(bits, |lane| out[at + lane] = steps[lane] as u32);
        }
        if let Some(out) = &mut self.status {
            let (hit, unconverged) = (L::bits(outcome.hit), L::bits(outcome.unconverged));
            each(bits, |lane| {
                out[at + lane] = match (hit >> lane & 1, unconverged >> lane & 1) {
                    (1, _) => Status::Hit,
                    (_, 1) => Status::Unconverged,
                    _ => Status::Left,
                } as u8;
            });
        }
        if self.uv.is_none() && self.z.is_none() && self.normal.is_none() {
            return;
        }
        let nothing = L::splat(f32::NAN);
        let u = origin[0] + direction[0] * outcome.t;
        let v = origin[1] + direction[1] * outcome.t;
        if let Some(out) = &mut self.uv {
            let uv = [
                L::select(outcome.hit, L::narrow(u), nothing),
                L::select(outcome.hit, L::narrow(v), nothing),
            ];
            scatter::<L, 2>(out, at, bits, uv);
        }
        if let Some(out) = &mut self.z {
            let z = L::narrow(origin[2] + direction[2] * outcome.t);
            scatter::<L, 1>(out, at, bits, [L::select(outcome.hit, z, nothing)]);
        }
        if let Some(out) = &mut self.normal {
            let [x, y, z] = normal::<L>(field, u, v);
            let normal = [
                L::select(outcome.hit, x, nothing),
                L::select(outcome.hit, y, nothing),
                L::select(outcome.hit, z, nothing),
            ];
            scatter::<L, 3>(out, at, bits, normal);
        }
    }
}

/// Calls a function with the number of every set bit.
#[inline(always)]
fn each(mut bits: u32, mut f: impl FnMut(usize)) {
    while bits != 0 {
        f(bits.trailing_zeros() as usize & 15);
        bits &= bits - 1;
    }
}

/// Writes `N` numbers for each chosen lane.
#[inline(always)]
fn scatter<L: Lanes, const N: usize>(out: &mut [f32], at: usize, bits: u32, parts: [L::F; N]) {
    let whole = bits == u32::MAX >> (32 - L::WIDTH as u32);
    if N == 1 && whole {
        L::store(parts[0], &mut out[at..]);
        return;
    }
    let mut lanes = [[0.0; 16]; N];
    for (lanes, part) in lanes.iter_mut().zip(parts) {
        L::store(part, lanes);
    }
    each(bits, |lane| {
        for (k, part) in lanes.iter().enumerate() {
            out[N * (at + lane) + k] = part[lane];
        }
    });
}

/// The unit normal of the bilinear surface: [`HeightField::gradient_at`] for lanes.
#[inline(always)]
fn normal<L: Lanes>(field: &HeightField, u: L::D, v: L::D) -> [L::F; 3] {
    let one = L::splat_wide(1.0);
    let [nx, ny] = field.cells();
    let (i, x) = locate::<L>(field, u, field.width(), nx);
    let (j, y) = locate::<L>(field, v, field.height(), ny);
    let stride = L::splat_int(nx as i32 + 1);
    let corner = L::to_int(i) + L::to_int(j) * stride;
    // SAFETY: the four corners of one of the field's cells; a field has fewer corners than 2^31.
    let (upper, lower) = unsafe {
        (L::gather_pairs(field.corners(), corner), L::gather_pairs(field.corners(), corner + stride))
    };
    let (h00, h10) = (L::widen(upper.0), L::widen(upper.1));
    let (h01, h11) = (L::widen(lower.0), L::widen(lower.1));
    let dx = (h10 - h00) * (one - y) + (h11 - h01) * y;
    let dy = (h01 - h00) * (one - x) + (h11 - h10) * x;
    let gu = dx * L::splat_wide(field.width() as f64);
    let gv = dy * L::splat_wide(field.height() as f64);
    let length = L::sqrt_wide(gu * gu + gv * gv + one);
    let minus = L::splat_wide(-1.0);
    [L::narrow(minus * gu / length), L::narrow(minus * gv / length), L::narrow(one / length)]
}

/// The cell of a coordinate, a whole number and one of the field's whatever the input, and the
/// position inside it.
#[inline(always)]
fn locate<L: Lanes>(field: &HeightField, coordinate: L::D, texels: usize, cells: usize) -> (L::F, L::D) {
    let (zero, one) = (L::splat_wide(0.0), L::splat_wide(1.0));
    let last = L::splat_wide((cells - 1) as f64);
    let x = coordinate * L::splat_wide(texels as f64)
        - L::splat_wide(0.5)
        - L::splat_wide(field.first_texel() as f64);
    let floor = L::floor_wide(x);
    if field.is_periodic() {
        let n = L::splat_wide(cells as f64);
        let cell = floor - L::floor_wide(floor / n) * n;
        (L::narrow(L::max_wide(L::min_wide(cell, last), zero)), x - floor)
    } else {
        let cell = L::max_wide(L::min_wide(floor, last), zero);
        (L::narrow(cell), L::max_wide(L::min_wide(x - cell, one), zero))
    }
}
