//! The frame of a textured surface. Twin of `shaders_wgsl/lib/surface_frame.wgsl`.

use glam::{DVec3, Vec3, Vec4};

/// Axes of the texture mapping at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFrame {
    /// `dP/du`, mesh units a tile, not normalised.
    pub dpdu: DVec3,
    /// `dP/dv`, mesh units a tile, not normalised; v runs down the image.
    pub dpdv: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

impl SurfaceFrame {
    /// 1, or -1 where the axes turn the other way: `v` runs down, so `dpdu x dpdv` points inward unless
    /// the chart is mirrored.
    pub(super) fn outward(&self) -> f64 {
        if self.dpdu.cross(self.dpdv).dot(self.normal) >= 0.0 { 1.0 } else { -1.0 }
    }

    /// `v` without its part along the normal.
    pub(super) fn in_surface(&self, v: DVec3) -> DVec3 {
        v - self.normal * self.normal.dot(v)
    }
}

/// `v` as `a * dpdu + b * dpdv + c * normal`; the lateral ones are 0 where the mapping is degenerate.
pub fn frame_coordinates(surface: &SurfaceFrame, v: DVec3) -> DVec3 {
    let across_u = surface.dpdv.cross(surface.normal);
    let across_v = surface.normal.cross(surface.dpdu);
    let across_n = surface.dpdu.cross(surface.dpdv);
    let volume = surface.dpdu.dot(across_u);
    let largest = surface.dpdu.length() * surface.dpdv.length();
    if volume.abs() > 1e-6 * largest && volume.abs() > 1e-30 {
        DVec3::new(v.dot(across_u), v.dot(across_v), v.dot(across_n)) / volume
    } else {
        DVec3::new(0.0, 0.0, surface.normal.dot(v))
    }
}

/// Unit normal from a tangent-space normal, glTF convention.
pub fn perturb_by_map(normal: Vec3, tangent: Vec4, normal_ts: Vec3) -> Vec3 {
    let along = tangent.truncate();
    let bitangent = tangent.w * normal.cross(along);
    (normal_ts.x * along + normal_ts.y * bitangent + normal_ts.z * normal).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quad facing +Z: u right, v down.
    const QUAD: SurfaceFrame =
        SurfaceFrame { dpdu: DVec3::new(2.0, 0.0, 0.0), dpdv: DVec3::new(0.0, -3.0, 0.0), normal: DVec3::Z };

    #[test]
    fn coordinates_invert_the_frame() {
        let sheared =
            SurfaceFrame { dpdu: DVec3::new(1.0, 0.4, 0.0), dpdv: DVec3::new(0.2, -2.0, 0.1), ..QUAD };
        for frame in [QUAD, sheared] {
            let c = frame_coordinates(&frame, DVec3::new(0.3, -0.7, 0.5));
            let back = c.x * frame.dpdu + c.y * frame.dpdv + c.z * frame.normal;
            assert!(back.distance(DVec3::new(0.3, -0.7, 0.5)) < 1e-12);
        }
    }

    #[test]
    fn a_degenerate_mapping_gives_no_lateral_motion() {
        let flat = SurfaceFrame { dpdu: DVec3::X, dpdv: DVec3::X, normal: DVec3::Z };
        assert_eq!(frame_coordinates(&flat, DVec3::new(1.0, 2.0, 3.0)), DVec3::new(0.0, 0.0, 3.0));
    }

    #[test]
    fn the_map_s_green_points_up_the_image() {
        // glTF tangent of the quad: along u, w such that w (N x T) is up.
        let up = perturb_by_map(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, 1.0), Vec3::new(0.0, 0.6, 0.8));
        assert!(up.distance(Vec3::new(0.0, 0.6, 0.8)) < 1e-6, "{up}");
    }
}
