//! What a march gives back: which results are wanted, and the arrays they go to.

use crate::HeightFieldError;

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
    /// Height reads or nodes visited, N. The exact search shares some with the rays beside a ray, so its
    /// count depends on them a little.
    pub steps: Option<Vec<u32>>,
    /// [`Status`](crate::Status) as a number, N.
    pub status: Option<Vec<u8>>,
}

impl Hits {
    /// Zeroed arrays for `rays` rays.
    pub fn new(rays: usize, outputs: OutputSet) -> Self {
        let wants = |output| outputs.contains(output);
        Self {
            t: wants(OutputSet::T).then(|| vec![0.0; rays]),
            uv: wants(OutputSet::UV).then(|| vec![0.0; 2 * rays]),
            z: wants(OutputSet::Z).then(|| vec![0.0; rays]),
            normal: wants(OutputSet::NORMAL).then(|| vec![0.0; 3 * rays]),
            steps: wants(OutputSet::STEPS).then(|| vec![0; rays]),
            status: wants(OutputSet::STATUS).then(|| vec![0; rays]),
        }
    }

    /// The arrays as places to write to.
    pub fn as_mut(&mut self) -> HitsMut<'_> {
        HitsMut {
            t: self.t.as_deref_mut(),
            uv: self.uv.as_deref_mut(),
            z: self.z.as_deref_mut(),
            normal: self.normal.as_deref_mut(),
            steps: self.steps.as_deref_mut(),
            status: self.status.as_deref_mut(),
        }
    }
}

/// Places for the results of N rays, laid out as in [`Hits`]. What is `None` is not computed.
#[derive(Debug, Default)]
pub struct HitsMut<'a> {
    /// Ray parameter of the hit, N.
    pub t: Option<&'a mut [f32]>,
    /// Texture coordinates, N * 2.
    pub uv: Option<&'a mut [f32]>,
    /// Height, N.
    pub z: Option<&'a mut [f32]>,
    /// Unit normal, N * 3.
    pub normal: Option<&'a mut [f32]>,
    /// Height reads or nodes visited, N.
    pub steps: Option<&'a mut [u32]>,
    /// [`Status`](crate::Status) as a number, N.
    pub status: Option<&'a mut [u8]>,
}

impl<'a> HitsMut<'a> {
    /// Checks that every array has room for exactly `rays` rays.
    ///
    /// # Errors
    /// [`HeightFieldError::OutputLength`].
    pub fn check(&self, rays: usize) -> Result<(), HeightFieldError> {
        let lengths = [
            ("t", self.t.as_ref().map(|a| a.len()), rays),
            ("uv", self.uv.as_ref().map(|a| a.len()), 2 * rays),
            ("z", self.z.as_ref().map(|a| a.len()), rays),
            ("normal", self.normal.as_ref().map(|a| a.len()), 3 * rays),
            ("steps", self.steps.as_ref().map(|a| a.len()), rays),
            ("status", self.status.as_ref().map(|a| a.len()), rays),
        ];
        match lengths.into_iter().find(|(_, length, expected)| length.is_some_and(|n| n != *expected)) {
            Some((name, Some(got), expected)) => Err(HeightFieldError::OutputLength { name, expected, got }),
            _ => Ok(()),
        }
    }

    /// Takes the first `rays` rays' places off the front.
    pub fn split_front(&mut self, rays: usize) -> HitsMut<'a> {
        fn front<'a, T>(places: &mut Option<&'a mut [T]>, count: usize) -> Option<&'a mut [T]> {
            let (first, rest) = places.take()?.split_at_mut(count);
            *places = Some(rest);
            Some(first)
        }
        HitsMut {
            t: front(&mut self.t, rays),
            uv: front(&mut self.uv, 2 * rays),
            z: front(&mut self.z, rays),
            normal: front(&mut self.normal, 3 * rays),
            steps: front(&mut self.steps, rays),
            status: front(&mut self.status, rays),
        }
    }
}
