//! Many rays at once: any technique over arrays of rays, on all cores.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::lanes;
use crate::packet;
use crate::rays::{fault_of, first_unsound, same_count};
use crate::search::Search;
use crate::search::exact::{self, CellRay};
use crate::technique::Reads;
use crate::{HeightField, HeightFieldError, Hits, HitsMut, OutputSet, RayArray, Segment};
use crate::{Status, Technique, Wrap};

pub use crate::rays::validate;

/// Rays handed to one task at a time.
const CHUNK: usize = 4096;

/// How to march.
#[derive(Debug, Clone, Copy)]
pub struct MarchOptions<'a> {
    /// Wanted results.
    pub outputs: OutputSet,
    /// Whether rays start on the surface (shadow rays): the start then is no hit.
    ///
    /// Only the exact search needs to know; the others never look at the start.
    pub from_surface: bool,
    /// Set to `true` from outside to stop early.
    pub cancel: Option<&'a AtomicBool>,
}

impl Default for MarchOptions<'_> {
    fn default() -> Self {
        Self { outputs: OutputSet::ALL, from_surface: false, cancel: None }
    }
}

/// A run of rays and the places their results go.
pub struct Chunk<'a> {
    pub(crate) origins: RayArray<'a>,
    pub(crate) directions: RayArray<'a>,
    pub(crate) from_surface: bool,
    pub(crate) cancel: Option<&'a AtomicBool>,
    pub(crate) t: Option<&'a mut [f32]>,
    pub(crate) uv: Option<&'a mut [f32]>,
    pub(crate) z: Option<&'a mut [f32]>,
    pub(crate) normal: Option<&'a mut [f32]>,
    pub(crate) steps: Option<&'a mut [u32]>,
    pub(crate) status: Option<&'a mut [u8]>,
}

impl Chunk<'_> {
    /// Whether the caller asked to stop. A ray may take milliseconds, so each asks anew.
    #[inline(always)]
    pub(crate) fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

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
}

/// The unit normal `(-dh/du, -dh/dv, 1)` in texture space.
#[inline(always)]
pub fn texture_space_normal(gradient: [f64; 2]) -> [f32; 3] {
    let [gu, gv] = gradient;
    let length = (gu * gu + gv * gv + 1.0).sqrt();
    [(-gu / length) as f32, (-gv / length) as f32, (1.0 / length) as f32]
}

/// Tiles after which the map repeats along an axis, 0 when it does not.
#[inline(always)]
pub fn period(wrap: Wrap) -> f64 {
    match wrap {
        Wrap::Repeat => 1.0,
        Wrap::Mirror => 2.0,
        Wrap::Clamp => 0.0,
    }
}

/// Runs a search with the best instructions the processor has.
///
/// The code is the same and so are the results, bit for bit: wider instruction sets only bring cheap
/// rounding and conversions. Everything below is inlined, so that it is compiled with them.
pub(crate) fn dispatch<S: Search>(search: &S, field: &HeightField, chunk: &mut Chunk<'_>) {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        #[allow(unsafe_code)]
        // SAFETY: the processor has the instructions, asked on the line above.
        unsafe {
            march_avx2(search, field, chunk);
        }
        return;
    }
    search.march(field, chunk);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn march_avx2<S: Search>(search: &S, field: &HeightField, chunk: &mut Chunk<'_>) {
    search.march(field, chunk);
}

/// Runs a search on the `f32` segment of every ray.
#[inline(always)]
pub(crate) fn march_by_segments<S: Search>(search: &S, field: &HeightField, chunk: &mut Chunk<'_>) {
    let period = period(field.wrap());
    for i in 0..chunk.origins.len() {
        if chunk.cancelled() {
            return;
        }
        let (origin, direction) = (chunk.origins.get(i), chunk.directions.get(i));
        let cos_theta = field.extent().cos_theta(direction);
        let Some(segment) = Segment::clip(origin, direction, cos_theta, period) else {
            chunk.write(i, Status::Left, 0.0, 0, || [0.0; 2]);
            continue;
        };
        let found = search.search(field, segment.start, segment.delta, cos_theta);
        let status = match found.status {
            Status::Left if !segment.closed => Status::Unconverged,
            status => status,
        };
        let t = segment.t_start + f64::from(found.tau) * segment.t_length;
        chunk.write(i, status, t, found.steps, || {
            field.gradient_at(origin[0] + t * direction[0], origin[1] + t * direction[1])
        });
    }
}

/// Runs the exact search on every ray, many at once.
pub(crate) fn march_exact(field: &HeightField, chunk: &mut Chunk<'_>) {
    lanes::dispatch(packet::Exact { field, chunk });
}

impl Chunk<'_> {
    /// Runs the exact search in `f64` on the chosen rays, one after the other.
    #[inline(always)]
    pub(crate) fn march_singly(
        &mut self,
        field: &HeightField,
        range: std::ops::Range<usize>,
        chosen: impl Fn(usize) -> bool,
    ) {
        for i in range {
            if !chosen(i) {
                continue;
            }
            if self.cancelled() {
                return;
            }
            let (hit, t) = exact_hit(
                field,
                field.pyramid(),
                self.origins.get(i),
                self.directions.get(i),
                self.from_surface,
            );
            self.write(i, hit.status, t, hit.steps, || {
                field.cell_gradient(hit.cell[0], hit.cell[1], hit.local[0], hit.local[1])
            });
        }
    }
}

/// One ray in texture space through the exact search in `f64`: the hit, and its ray parameter.
#[inline(always)]
pub(crate) fn exact_hit(
    field: &HeightField,
    pyramid: &crate::MaxPyramid,
    origin: [f64; 3],
    direction: [f64; 3],
    from_surface: bool,
) -> (exact::CellHit<f64>, f64) {
    let highest = f64::from(pyramid.highest());
    let begin =
        if origin[2] > highest && direction[2] < 0.0 { (highest - origin[2]) / direction[2] } else { 0.0 };
    let [x, y] =
        exact::cell_position(field, origin[0] + begin * direction[0], origin[1] + begin * direction[1]);
    let ray = CellRay {
        start: [x, y, if begin > 0.0 { highest } else { origin[2] }],
        direction: [direction[0] * field.width() as f64, direction[1] * field.height() as f64, direction[2]],
        from_surface: from_surface && begin == 0.0,
    };
    let hit = exact::trace(field, pyramid, &ray, exact::MAX_STEPS_F64);
    (hit, begin + hit.t)
}

/// Finds where each ray first meets the surface, as the technique sees it.
///
/// Rays are `origin + t * direction`, `t >= 0`, in texture space; directions need not be unit length.
///
/// # Errors
/// [`HeightFieldError::RayCount`], [`HeightFieldError::RayNotFinite`] and
/// [`HeightFieldError::RayZeroDirection`] name the first offending ray;
/// [`HeightFieldError::Interrupted`] after `cancel` was set.
pub fn march(
    field: &HeightField,
    technique: &Technique,
    origins: RayArray<'_>,
    directions: RayArray<'_>,
    options: &MarchOptions<'_>,
) -> Result<Hits, HeightFieldError> {
    same_count(origins, directions)?;
    let mut hits = Hits::new(origins.len(), options.outputs);
    march_into(field, technique, origins, directions, options, hits.as_mut())?;
    Ok(hits)
}

/// As [`march`], into places of the caller's; these say what is wanted, not `options.outputs`.
///
/// Each task checks its rays just before it follows them, while they are in the cache. After an error
/// the places hold anything.
///
/// # Errors
/// As [`march`], and [`HeightFieldError::OutputLength`].
pub fn march_into(
    field: &HeightField,
    technique: &Technique,
    origins: RayArray<'_>,
    directions: RayArray<'_>,
    options: &MarchOptions<'_>,
    mut places: HitsMut<'_>,
) -> Result<(), HeightFieldError> {
    same_count(origins, directions)?;
    let n = origins.len();
    places.check(n)?;
    let chunks: Vec<Chunk<'_>> = (0..n)
        .step_by(CHUNK)
        .map(|from| {
            let to = (from + CHUNK).min(n);
            let HitsMut { t, uv, z, normal, steps, status } = places.split_front(to - from);
            Chunk {
                origins: origins.slice(from, to),
                directions: directions.slice(from, to),
                from_surface: options.from_surface,
                cancel: options.cancel,
                t,
                uv,
                z,
                normal,
                steps,
                status,
            }
        })
        .collect();
    if technique.info.reads == Reads::Pyramid {
        // Built here by all threads, and not while other tasks wait for it in theirs.
        field.margins();
    }
    // The first ray at fault: what lies after it need not be looked at, what lies before it must be.
    let fault = AtomicUsize::new(usize::MAX);
    chunks.into_par_iter().enumerate().try_for_each(|(at, mut chunk)| {
        let (from, known) = (at * CHUNK, fault.load(Ordering::Relaxed));
        if known < from {
            return Ok(());
        }
        if let Some(index) = first_unsound(chunk.origins, chunk.directions) {
            fault.fetch_min(from + index, Ordering::Relaxed);
        } else if known == usize::MAX {
            (technique.info.march)(field, &technique.values, &mut chunk);
        }
        if chunk.cancelled() { Err(HeightFieldError::Interrupted) } else { Ok(()) }
    })?;
    match fault.into_inner() {
        usize::MAX => Ok(()),
        index => Err(fault_of(origins, directions, index)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::relief::Relief;

    fn chunk<'a>(
        origins: &'a [f64],
        directions: &'a [f64],
        t: &'a mut [f32],
        steps: &'a mut [u32],
    ) -> Chunk<'a> {
        Chunk {
            origins: RayArray::F64(origins),
            directions: RayArray::F64(directions),
            from_surface: false,
            cancel: None,
            t: Some(t),
            uv: None,
            z: None,
            normal: None,
            steps: Some(steps),
            status: None,
        }
    }

    /// Runs a search with the processor's best instructions and with the plain ones.
    fn both_ways<S: Search>(search: &S) {
        let texels: Vec<f32> = (0..64 * 48).map(|i| ((i * 7919) % 1009) as f32 / 1009.0).collect();
        let field = HeightField::new(&texels, 64, 48, Wrap::Repeat).unwrap();
        let n = 3000;
        let spread = |i: usize, k: usize| ((i * k) % 997) as f64 / 997.0;
        let origins: Vec<f64> = (0..n).flat_map(|i| [spread(i, 31), spread(i, 57), 1.0]).collect();
        let directions: Vec<f64> =
            (0..n).flat_map(|i| [spread(i, 13) - 0.5, 4.0 * spread(i, 7) - 2.0, -0.7]).collect();
        let mut best = (vec![0.0; n], vec![0; n]);
        let mut plain = (vec![0.0; n], vec![0; n]);
        dispatch(search, &field, &mut chunk(&origins, &directions, &mut best.0, &mut best.1));
        search.march(&field, &mut chunk(&origins, &directions, &mut plain.0, &mut plain.1));
        assert!(best.0.iter().all(|t| t.is_finite()));
        assert_eq!(best, plain);
    }

    #[test]
    fn better_instructions_change_no_bit() {
        both_ways(&Relief { linear: 32, refine: 8 });
    }
}
