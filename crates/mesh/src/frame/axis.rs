//! The direction across a fixed axis, whatever the texture says: +Y, so that tangents run level.
//!
//! Exact on surfaces of revolution around Y whose `u` is the longitude, and on their outside only;
//! elsewhere a hack, here so that its cost can be seen.

use glam::{DVec3, Vec4};

use super::{FrameInfo, Surface};

pub(super) const INFO: FrameInfo = FrameInfo {
    name: "axis",
    summary: "the direction across the normal and +Y; the texture has no say",
    guarantee: "none: right only where u happens to run level; no frame where the normal is along Y; w = 1 \
                everywhere, wrong on mirrored charts",
    source: "folklore of early fixed-function demos",
    shares: true,
    corners,
};

/// Sine of the smallest angle between normal and axis that still gives a direction.
const MIN_SINE: f64 = 1e-6;

fn corners(surface: Surface<'_>) -> Vec<Option<Vec4>> {
    surface.each_corner(|_| {
        |_, normal| {
            let across = DVec3::Y.cross(normal);
            (across.length() > MIN_SINE).then(|| across.normalize().as_vec3().extend(1.0))
        }
    })
}
