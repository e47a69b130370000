//! Points of surfaces given in closed form.

use glam::DVec3;

/// A point of a parametric surface `P(u, v)`, `v` down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// `P`, mesh units.
    pub position: DVec3,
    /// `dP/du`, mesh units per UV unit; zero at a pole.
    pub dpdu: DVec3,
    /// `dP/dv`, mesh units per UV unit.
    pub dpdv: DVec3,
    /// `dN/du`, per UV unit.
    pub dndu: DVec3,
    /// `dN/dv`, per UV unit.
    pub dndv: DVec3,
    /// Unit vector along growing `u`; at a pole, its limit along the meridian.
    pub along: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
}
