//! Many rays at once: any technique over arrays of rays, on all cores.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::search::Search;
use crate::search::exact::{self, CellRay};
use crate::{HeightField, HeightFieldError, Segment, Status, Technique, Wrap};

/// Rays handed to one task at a time.
const CHUNK: usize = 4096;

/// Ray origins or directions: N * 3 numbers, `(u, v, z)` after one another.
///
/// `f64` rays are followed in `f64` by the exact search and rounded for the others.
#[derive(Debug, Clone, Copy)]
pub enum RayArray<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

impl<'a> RayArray<'a> {
    /// Number of rays.
    #[inline(always)]
    pub fn len(&self) -> usize {
        match self {
            Self::F32(a) => a.len() / 3,
            Self::F64(a) => a.len() / 3,
        }
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Ray `i`.
    #[inline(always)]
    pub fn get(&self, i: usize) -> [f64; 3] {
        match self {
            Self::F32(a) => [a[3 * i], a[3 * i + 1], a[3 * i + 2]].map(f64::from),
            Self::F64(a) => [a[3 * i], a[3 * i + 1], a[3 * i + 2]],
        }
    }

    fn slice(&self, from: usize, to: usize) -> Self {
        match self {
            Self::F32(a) => Self::F32(&a[3 * from..3 * to]),
            Self::F64(a) => Self::F64(&a[3 * from..3 * to]),
        }
    }
}

/// Which results are wanted; the others are neither computed nor allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutputSet(u8);

impl OutputSet {
    /// Nothing.
    pub const NONE: Self = Self(0);
    /// Ray parameter of the hit.
    pub const T: Self = Self(1);
    /// Texture coordinates of the hit.
    pub const UV: Self = Self(2);
    /// Height of the hit.
    pub const Z: Self = Self(4);
    /// Surface normal at the hit.
    pub const NORMAL: Self = Self(8);
    /// Steps taken.
    pub const STEPS: Self = Self(16);
    /// How the search ended.
    pub const STATUS: Self = Self(32);
    /// Everything.
    pub const ALL: Self = Self(63);

    /// Whether all of `other` is in the set.
    #[inline(always)]
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The set of one output by its Python name.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "t" => Self::T,
            "uv" => Self::UV,
            "z" => Self::Z,
            "normal" => Self::NORMAL,
            "steps" => Self::STEPS,
            "status" => Self::STATUS,
            _ => return None,
        })
    }
}

impl std::ops::BitOr for OutputSet {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

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

/// Results, one entry a ray, for the outputs that were asked for.
///
/// Rays without a hit have `t = inf` and NaN in `uv`, `z` and `normal`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Hits {
    /// Ray parameter, N.
    pub t: Option<Vec<f32>>,
    /// Texture coordinates on the ray's own tile, N * 2.
    pub uv: Option<Vec<f32>>,
    /// Height in 0..1, N.
    pub z: Option<Vec<f32>>,
    /// Unit normal of the bilinear surface in texture space, `(-dh/du, -dh/dv, 1)` normalised, N * 3.
    pub normal: Option<Vec<f32>>,
    /// Height reads or nodes visited, N.
    pub steps: Option<Vec<u32>>,
    /// [`Status`] as a number, N.
    pub status: Option<Vec<u8>>,
}

/// A run of rays and the places their results go.
pub struct Chunk<'a> {
    origins: RayArray<'a>,
    directions: RayArray<'a>,
    from_surface: bool,
    cancel: Option<&'a AtomicBool>,
    t: Option<&'a mut [f32]>,
    uv: Option<&'a mut [f32]>,
    z: Option<&'a mut [f32]>,
    normal: Option<&'a mut [f32]>,
    steps: Option<&'a mut [u32]>,
    status: Option<&'a mut [u8]>,
}

impl Chunk<'_> {
    /// Whether the caller asked to stop. A ray may take milliseconds, so each asks anew.
    #[inline(always)]
    fn cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    #[inline(always)]
    fn write(&mut self, i: usize, status: Status, t: f64, steps: u32, gradient: impl FnOnce() -> [f64; 2]) {
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

/// Runs the exact search in `f64` on every ray.
#[inline(always)]
pub(crate) fn march_exact(field: &HeightField, chunk: &mut Chunk<'_>) {
    let pyramid = field.pyramid();
    for i in 0..chunk.origins.len() {
        if chunk.cancelled() {
            return;
        }
        let (origin, direction) = (chunk.origins.get(i), chunk.directions.get(i));
        let (hit, t) = exact_hit(field, pyramid, origin, direction, chunk.from_surface);
        chunk.write(i, hit.status, t, hit.steps, || {
            field.cell_gradient(hit.cell[0], hit.cell[1], hit.local[0], hit.local[1])
        });
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
    validate(origins, directions)?;
    let n = origins.len();
    let wants = |output| options.outputs.contains(output);
    let mut hits = Hits {
        t: wants(OutputSet::T).then(|| vec![0.0; n]),
        uv: wants(OutputSet::UV).then(|| vec![0.0; 2 * n]),
        z: wants(OutputSet::Z).then(|| vec![0.0; n]),
        normal: wants(OutputSet::NORMAL).then(|| vec![0.0; 3 * n]),
        steps: wants(OutputSet::STEPS).then(|| vec![0; n]),
        status: wants(OutputSet::STATUS).then(|| vec![0; n]),
    };
    let mut t = hits.t.as_mut().map(|v| v.chunks_mut(CHUNK));
    let mut uv = hits.uv.as_mut().map(|v| v.chunks_mut(2 * CHUNK));
    let mut z = hits.z.as_mut().map(|v| v.chunks_mut(CHUNK));
    let mut normal = hits.normal.as_mut().map(|v| v.chunks_mut(3 * CHUNK));
    let mut steps = hits.steps.as_mut().map(|v| v.chunks_mut(CHUNK));
    let mut status = hits.status.as_mut().map(|v| v.chunks_mut(CHUNK));
    let chunks: Vec<Chunk<'_>> = (0..n)
        .step_by(CHUNK)
        .map(|from| {
            let to = (from + CHUNK).min(n);
            Chunk {
                origins: origins.slice(from, to),
                directions: directions.slice(from, to),
                from_surface: options.from_surface,
                cancel: options.cancel,
                t: t.as_mut().and_then(Iterator::next),
                uv: uv.as_mut().and_then(Iterator::next),
                z: z.as_mut().and_then(Iterator::next),
                normal: normal.as_mut().and_then(Iterator::next),
                steps: steps.as_mut().and_then(Iterator::next),
                status: status.as_mut().and_then(Iterator::next),
            }
        })
        .collect();
    chunks.into_par_iter().try_for_each(|mut chunk| {
        (technique.info.march)(field, &technique.values, &mut chunk);
        if chunk.cancelled() { Err(HeightFieldError::Interrupted) } else { Ok(()) }
    })?;
    Ok(hits)
}

/// Checks that every ray is finite and has a direction.
///
/// # Errors
/// As [`march`].
pub fn validate(origins: RayArray<'_>, directions: RayArray<'_>) -> Result<(), HeightFieldError> {
    if origins.len() != directions.len() {
        return Err(HeightFieldError::RayCount { origins: origins.len(), directions: directions.len() });
    }
    let fault = (0..origins.len()).into_par_iter().with_min_len(CHUNK).find_first(|&i| {
        let d = directions.get(i);
        !origins.get(i).iter().chain(&d).all(|x| x.is_finite()) || d == [0.0; 3]
    });
    match fault {
        None => Ok(()),
        Some(index) if !origins.get(index).iter().all(|x| x.is_finite()) => {
            Err(HeightFieldError::RayNotFinite { index, what: "origin" })
        }
        Some(index) if !directions.get(index).iter().all(|x| x.is_finite()) => {
            Err(HeightFieldError::RayNotFinite { index, what: "direction" })
        }
        Some(index) => Err(HeightFieldError::RayZeroDirection { index }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::search::exact::Exact;
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
        both_ways(&Exact {});
    }
}
