//! The frame of a textured surface. Twin of `shaders_wgsl/lib/surface_frame.wgsl` and `perturb.wgsl`.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978.

use glam::{Vec2, Vec3, Vec4};

/// Axes of the texture mapping at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFrame {
    /// `dP/du`, mesh units a tile, not normalised.
    pub dpdu: Vec3,
    /// `dP/dv`, mesh units a tile, not normalised; v runs down the image.
    pub dpdv: Vec3,
    /// Unit normal.
    pub normal: Vec3,
}

/// `v` as `a * dpdu + b * dpdv + c * normal`; the lateral ones are 0 where the mapping is degenerate.
pub fn frame_coordinates(surface: &SurfaceFrame, v: Vec3) -> Vec3 {
    let across_u = surface.dpdv.cross(surface.normal);
    let across_v = surface.normal.cross(surface.dpdu);
    let across_n = surface.dpdu.cross(surface.dpdv);
    let volume = surface.dpdu.dot(across_u);
    let largest = surface.dpdu.length() * surface.dpdv.length();
    if volume.abs() > 1e-6 * largest && volume.abs() > 1e-30 {
        Vec3::new(v.dot(across_u), v.dot(across_v), v.dot(across_n)) / volume
    } else {
        Vec3::new(0.0, 0.0, surface.normal.dot(v))
    }
}

/// Unit normal of the displaced surface; `slope`: mesh units of height per tile along u and v.
pub fn perturb_by_slope(surface: &SurfaceFrame, slope: Vec2) -> Vec3 {
    let plain = surface.dpdu.cross(surface.dpdv);
    let bent =
        plain + slope.x * surface.normal.cross(surface.dpdv) + slope.y * surface.dpdu.cross(surface.normal);
    let outward = if plain.dot(surface.normal) >= 0.0 { 1.0 } else { -1.0 };
    (bent * outward).normalize_or(surface.normal)
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
        SurfaceFrame { dpdu: Vec3::new(2.0, 0.0, 0.0), dpdv: Vec3::new(0.0, -3.0, 0.0), normal: Vec3::Z };

    #[test]
    fn coordinates_invert_the_frame() {
        let sheared =
            SurfaceFrame { dpdu: Vec3::new(1.0, 0.4, 0.0), dpdv: Vec3::new(0.2, -2.0, 0.1), normal: Vec3::Z };
        for frame in [QUAD, sheared] {
            let c = frame_coordinates(&frame, Vec3::new(0.3, -0.7, 0.5));
            let back = c.x * frame.dpdu + c.y * frame.dpdv + c.z * frame.normal;
            assert!(back.distance(Vec3::new(0.3, -0.7, 0.5)) < 1e-6);
        }
    }

    #[test]
    fn a_degenerate_mapping_gives_no_lateral_motion() {
        let flat = SurfaceFrame { dpdu: Vec3::X, dpdv: Vec3::X, normal: Vec3::Z };
        assert_eq!(frame_coordinates(&flat, Vec3::new(1.0, 2.0, 3.0)), Vec3::new(0.0, 0.0, 3.0));
    }

    #[test]
    fn a_rise_to_the_right_leans_left_and_a_rise_down_leans_up() {
        let right = perturb_by_slope(&QUAD, Vec2::new(2.0, 0.0));
        assert!(right.distance(Vec3::new(-1.0, 0.0, 1.0).normalize()) < 1e-6, "{right}");
        let down = perturb_by_slope(&QUAD, Vec2::new(0.0, 3.0));
        assert!(down.distance(Vec3::new(0.0, 1.0, 1.0).normalize()) < 1e-6, "{down}");
    }

    #[test]
    fn a_mirrored_chart_leans_the_other_way_along_u_only() {
        let mirrored = SurfaceFrame { dpdu: -QUAD.dpdu, ..QUAD };
        let right = perturb_by_slope(&mirrored, Vec2::new(2.0, 0.0));
        assert!(right.distance(Vec3::new(1.0, 0.0, 1.0).normalize()) < 1e-6, "{right}");
        let down = perturb_by_slope(&mirrored, Vec2::new(0.0, 3.0));
        assert!(down.distance(Vec3::new(0.0, 1.0, 1.0).normalize()) < 1e-6, "{down}");
    }

    #[test]
    fn the_map_s_green_points_up_the_image() {
        // glTF tangent of the quad: along u, w such that w (N x T) is up.
        let up = perturb_by_map(Vec3::Z, Vec4::new(1.0, 0.0, 0.0, 1.0), Vec3::new(0.0, 0.6, 0.8));
        assert!(up.distance(Vec3::new(0.0, 0.6, 0.8)) < 1e-6, "{up}");
    }
}
