//! Where on the relief a ray truly hits: errors differ between even ground, edges and shadows.

use heightfield::{HeightField, Status, oracle};

use crate::Rays;
use crate::reference::Truth;

/// A hit is at a silhouette when a ray shifted by a texel hits more than this many texels away from where
/// the shift alone would put it.
pub const SILHOUETTE_TEXELS: f64 = 4.0;

/// Part of the relief that a true hit belongs to; each hit has one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Region {
    /// Lit, away from edges.
    #[default]
    Interior,
    /// Beside an edge behind which the relief is hidden, or seen at a grazing angle: a ray a texel away
    /// hits somewhere else altogether.
    Silhouette,
    /// Not reached by the light, away from edges.
    Shadow,
}

impl Region {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Interior, Self::Silhouette, Self::Shadow];

    /// The name that users see.
    pub fn name(self) -> &'static str {
        match self {
            Self::Interior => "interior",
            Self::Silhouette => "silhouette",
            Self::Shadow => "shadow",
        }
    }
}

/// Whether the true hit of ray `i` lies at a silhouette.
pub fn is_silhouette(field: &HeightField, rays: &Rays, i: usize, truth: &Truth) -> bool {
    let size = [field.width() as f64, field.height() as f64];
    let (origin, direction) = (rays.origin(i), rays.direction(i));
    [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)].into_iter().any(|(axis, texels)| {
        let shift = texels / size[axis];
        let mut start = origin;
        start[axis] += shift;
        let found = oracle::exact(field, start, direction);
        if found.status != Status::Hit {
            return true;
        }
        let mut off = [found.uv[0] - truth.uv[0], found.uv[1] - truth.uv[1]];
        off[axis] -= shift;
        (off[0] * size[0]).hypot(off[1] * size[1]) > SILHOUETTE_TEXELS
    })
}
