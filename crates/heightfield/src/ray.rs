//! Rays, the part of a ray that a search looks at, and what it finds there.

use glam::Vec3;

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Status {
    /// The ray meets the surface.
    Hit = 0,
    /// The ray leaves the relief without meeting it.
    Left = 1,
    /// The search ran out of its bound before it knew.
    Unconverged = 2,
}

/// What a search returns. The twin of `Found` in `shaders_wgsl/lib/found.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Position along the segment, 0 at its start and 1 at its end.
    pub tau: f32,
    /// How the search ended.
    pub status: Status,
    /// Height reads (or nodes visited) it took.
    pub steps: u32,
}

impl Found {
    /// A hit at `tau`.
    #[inline(always)]
    pub fn hit(tau: f32, steps: u32) -> Self {
        Self { tau, status: Status::Hit, steps }
    }

    /// No hit up to the end of the segment.
    #[inline(always)]
    pub fn left(steps: u32) -> Self {
        Self { tau: 1.0, status: Status::Left, steps }
    }
}

/// The part of a ray between the lid (`z = 1`) or its origin and the floor (`z = 0`) or the lid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Where it starts; `u`, `v` are reduced to the tile at the origin.
    pub start: Vec3,
    /// End minus start.
    pub delta: Vec3,
    /// Cosine between the ray and the normal in mesh units, 0 grazing to 1 head-on.
    pub cos_theta: f32,
    /// Ray parameter at the start.
    pub t_start: f64,
    /// Ray parameter at the end minus that at the start.
    pub t_length: f64,
    /// Whether the end of the segment is the end of all that the ray can meet.
    pub closed: bool,
}

impl Segment {
    /// Clips the ray `origin + t * direction`, `t >= 0`, to the slab `0 <= z <= 1`.
    ///
    /// `period` is the number of tiles after which the map repeats (1, 2 for mirrored maps, 0 for
    /// clamped ones): whole periods are taken off the origin. A horizontal ray has no end in the
    /// slab; its segment is one tile long and not [`closed`](Self::closed). Returns `None` where
    /// the ray stays above the lid.
    #[inline(always)]
    pub fn clip(origin: [f64; 3], direction: [f64; 3], cos_theta: f32, period: f64) -> Option<Self> {
        let [ou, ov, oz] = origin;
        let [du, dv, dz] = direction;
        let mut t_start = 0.0;
        if oz > 1.0 {
            if dz >= 0.0 {
                return None;
            }
            t_start = (1.0 - oz) / dz;
        }
        let (t_end, closed) = if dz < 0.0 {
            ((-oz / dz).max(t_start), true)
        } else if dz > 0.0 {
            ((1.0 - oz) / dz, true)
        } else {
            (1.0 / du.hypot(dv), false)
        };
        let mut u = ou + du * t_start;
        let mut v = ov + dv * t_start;
        if period > 0.0 {
            u -= (u / period).floor() * period;
            v -= (v / period).floor() * period;
        }
        let z = if t_start > 0.0 { 1.0 } else { oz };
        let t_length = t_end - t_start;
        Some(Self {
            start: Vec3::new(u as f32, v as f32, z as f32),
            delta: Vec3::new((du * t_length) as f32, (dv * t_length) as f32, (dz * t_length) as f32),
            cos_theta,
            t_start,
            t_length,
            closed,
        })
    }
}
