//! The reference in `f64`: what every other search, on the CPU and on the device, is measured against.

use crate::march::exact_hit;
use crate::{HeightField, Status};

/// The true first hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OracleHit {
    /// How the ray ended.
    pub status: Status,
    /// Ray parameter, infinite without a hit.
    pub t: f64,
    /// Texture coordinates of the hit, on the ray's own tile.
    pub uv: [f64; 2],
    /// Its height.
    pub z: f64,
    /// Gradient `(dh/du, dh/dv)` of the bilinear surface there.
    pub gradient: [f64; 2],
}

/// The first point of the ray `origin + t * direction`, `t >= 0`, on or below the bilinear surface.
pub fn exact(field: &HeightField, origin: [f64; 3], direction: [f64; 3]) -> OracleHit {
    let (hit, t) = exact_hit(field, field.pyramid(), origin, direction, false);
    if hit.status != Status::Hit {
        return OracleHit {
            status: hit.status,
            t: f64::INFINITY,
            uv: [f64::NAN; 2],
            z: f64::NAN,
            gradient: [f64::NAN; 2],
        };
    }
    OracleHit {
        status: Status::Hit,
        t,
        uv: [origin[0] + t * direction[0], origin[1] + t * direction[1]],
        z: origin[2] + t * direction[2],
        gradient: field.cell_gradient(hit.cell[0], hit.cell[1], hit.local[0], hit.local[1]),
    }
}

/// Whether a ray from a point *on* the surface meets the surface again.
pub fn occluded(field: &HeightField, origin: [f64; 3], direction: [f64; 3]) -> bool {
    exact_hit(field, field.pyramid(), origin, direction, true).0.status == Status::Hit
}
