//! Many rays at once: any technique over arrays of rays, on all cores.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::chunk::Chunk;
use crate::lanes;
use crate::order;
use crate::packet;
use crate::rays::{fault_of, first_unsound, same_count};
use crate::search::Search;
use crate::search::exact::{self, CellRay};
use crate::technique::Reads;
use crate::{HeightField, HeightFieldError, Hits, HitsMut, OutputSet, RayArray, Segment};
use crate::{Status, Technique, Wrap};

pub use crate::rays::validate;

/// Rays handed to one task at a time, as a rule.
const CHUNK: usize = 4096;

/// How to march.
#[derive(Debug, Clone, Copy)]
pub struct MarchOptions<'a> {
    /// Wanted results.
    pub outputs: OutputSet,
    /// Whether rays start on the surface (shadow rays): the start then is no hit.
    ///
    /// Only searches that look at the start need to know: the exact one and those that step by cones.
    pub from_surface: bool,
    /// Set to `true` from outside to stop early.
    pub cancel: Option<&'a AtomicBool>,
}

impl Default for MarchOptions<'_> {
    fn default() -> Self {
        Self { outputs: OutputSet::ALL, from_surface: false, cancel: None }
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

/// Runs a search on the `f32` segment of one ray.
#[inline(always)]
pub(crate) fn march_one<S: Search>(search: &S, field: &HeightField, chunk: &mut Chunk<'_>, i: usize) {
    let (origin, direction) = (chunk.origins.get(i), chunk.directions.get(i));
    let cos_theta = field.extent().cos_theta(direction);
    let Some(segment) = Segment::clip(origin, direction, cos_theta, period(field.wrap())) else {
        chunk.write(i, Status::Left, 0.0, 0, || [0.0; 2]);
        return;
    };
    let found = search.trace(field, segment.start, segment.delta, cos_theta, chunk.from_surface);
    let status = match found.status {
        Status::Left if !segment.closed => Status::Unconverged,
        status => status,
    };
    let t = segment.t_start + f64::from(found.tau) * segment.t_length;
    chunk.write(i, status, t, found.steps, || {
        field.gradient_at(origin[0] + t * direction[0], origin[1] + t * direction[1])
    });
}

/// Runs the exact search on every ray, many at once.
pub(crate) fn march_exact(field: &HeightField, chunk: &mut Chunk<'_>) {
    lanes::dispatch(packet::Exact { field, chunk });
}

impl Chunk<'_> {
    /// Runs the exact search in `f64` on some rays, one after the other.
    #[inline(always)]
    pub(crate) fn march_singly(&mut self, field: &HeightField, rays: impl IntoIterator<Item = usize>) {
        for i in rays {
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
/// [`HeightFieldError::MapMissing`] when the technique reads a map that was not attached;
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
    technique.check_maps(field)?;
    let n = origins.len();
    places.check(n)?;
    let exact = technique.info.reads == Reads::Pyramid;
    // Rays that start on the surface are followed one by one.
    let side_by_side = exact && !options.from_surface;
    let squares = if side_by_side { order::squares(field, origins, directions) } else { None };
    let (size, order) = squares.map_or((CHUNK, Vec::new()), |squares| (squares.rays, squares.runs));
    let chunks: Vec<Chunk<'_>> = (0..n)
        .step_by(size)
        .map(|from| {
            let to = (from + size).min(n);
            let HitsMut { t, uv, z, normal, steps, status } = places.split_front(to - from);
            Chunk {
                origins: origins.slice(from, to),
                directions: directions.slice(from, to),
                order: if to - from == size { &order } else { &[] },
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
    if exact {
        // Built here by all threads, and not while other tasks wait for it in theirs.
        field.margins();
    }
    // The first ray at fault: what lies after it need not be looked at, what lies before it must be.
    let fault = AtomicUsize::new(usize::MAX);
    chunks.into_par_iter().enumerate().try_for_each(|(at, mut chunk)| {
        let (from, known) = (at * size, fault.load(Ordering::Relaxed));
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
