//! Normals of a displaced surface from the slopes of its heights: four formulas, from the plainest to the
//! exact one. Twin of `shaders_wgsl/lib/perturb.wgsl`, in double precision.
//!
//! All: `slope` in mesh units of height per tile along u and v, results of unit length in the space of
//! the frame, oriented to its normal.
//!
//! Source: Blinn, "Simulation of Wrinkled Surfaces", SIGGRAPH 1978; Mikkelsen, "Surface Gradient-Based
//! Bump Mapping Framework", JCGT 2020.

use glam::{DVec2, DVec3};

use super::SurfaceFrame;

/// As if the axes were orthogonal: `N - hu T - hv B` with slopes along unit tangents. Off where the
/// mapping is sheared.
pub fn perturb_orthogonal(surface: &SurfaceFrame, slope: DVec2) -> DVec3 {
    let along = surface.in_surface(surface.dpdu).normalize_or_zero();
    let down = surface.normal.cross(along) * surface.outward();
    let u = slope.x / surface.dpdu.length().max(1e-30);
    let v = slope.y / surface.dpdv.length().max(1e-30);
    (surface.normal - u * along - v * down).normalize_or(surface.normal)
}

/// Axes at any angle and of any length. Level heights keep the smooth normal. Drops the term `h dN/du`.
pub fn perturb_general(surface: &SurfaceFrame, slope: DVec2) -> DVec3 {
    let volume = surface.dpdu.cross(surface.dpdv).dot(surface.normal);
    bend(surface, volume * surface.normal, slope)
}

/// As Blinn has it: the normal to be bent is that of the axes, which on interpolated frames is not quite
/// the smooth one.
pub fn perturb_blinn(surface: &SurfaceFrame, slope: DVec2) -> DVec3 {
    bend(surface, surface.dpdu.cross(surface.dpdv), slope)
}

fn bend(surface: &SurfaceFrame, plain: DVec3, slope: DVec2) -> DVec3 {
    let bent =
        plain + slope.x * surface.normal.cross(surface.dpdv) + slope.y * surface.dpdu.cross(surface.normal);
    (bent * surface.outward()).normalize_or(surface.normal)
}

/// The displaced surface's own: with the term that Blinn drops. `bend`: `dN/du` and `dN/dv` of the unit
/// normal, per tile; `rise`: mesh units from the mesh surface to the displaced one.
pub fn perturb_exact(surface: &SurfaceFrame, [dndu, dndv]: [DVec3; 2], slope: DVec2, rise: f64) -> DVec3 {
    let along_u = surface.in_surface(surface.dpdu + rise * dndu) + slope.x * surface.normal;
    let along_v = surface.in_surface(surface.dpdv + rise * dndv) + slope.y * surface.normal;
    (along_u.cross(along_v) * surface.outward()).normalize_or(surface.normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quad facing +Z: u right, v down.
    const QUAD: SurfaceFrame =
        SurfaceFrame { dpdu: DVec3::new(2.0, 0.0, 0.0), dpdv: DVec3::new(0.0, -3.0, 0.0), normal: DVec3::Z };

    const FORMULAS: [fn(&SurfaceFrame, DVec2) -> DVec3; 4] =
        [perturb_orthogonal, perturb_general, perturb_blinn, |surface, slope| {
            perturb_exact(surface, [DVec3::ZERO; 2], slope, 0.3)
        }];

    #[test]
    fn a_rise_to_the_right_leans_left_and_a_rise_down_leans_up() {
        for formula in FORMULAS {
            let right = formula(&QUAD, DVec2::new(2.0, 0.0));
            assert!(right.distance(DVec3::new(-1.0, 0.0, 1.0).normalize()) < 1e-12, "{right}");
            let down = formula(&QUAD, DVec2::new(0.0, 3.0));
            assert!(down.distance(DVec3::new(0.0, 1.0, 1.0).normalize()) < 1e-12, "{down}");
        }
    }

    #[test]
    fn a_mirrored_chart_leans_the_other_way_along_u_only() {
        let mirrored = SurfaceFrame { dpdu: -QUAD.dpdu, ..QUAD };
        for formula in FORMULAS {
            let right = formula(&mirrored, DVec2::new(2.0, 0.0));
            assert!(right.distance(DVec3::new(1.0, 0.0, 1.0).normalize()) < 1e-12, "{right}");
            let down = formula(&mirrored, DVec2::new(0.0, 3.0));
            assert!(down.distance(DVec3::new(0.0, 1.0, 1.0).normalize()) < 1e-12, "{down}");
        }
    }

    /// A plane `z = a x + b y` over a sheared mapping has one normal, whatever the axes.
    #[test]
    fn sheared_axes_are_left_to_the_general_formulas() {
        let frame =
            SurfaceFrame { dpdu: DVec3::new(1.5, 0.4, 0.0), dpdv: DVec3::new(0.5, -0.7, 0.0), ..QUAD };
        let (a, b) = (0.4, -0.2);
        let slope = DVec2::new(a * 1.5 + b * 0.4, a * 0.5 - b * 0.7);
        let truth = DVec3::new(-a, -b, 1.0).normalize();
        for (at, formula) in FORMULAS.iter().enumerate() {
            let off = formula(&frame, slope).angle_between(truth).to_degrees();
            assert!(if at == 0 { off > 4.0 } else { off < 1e-6 }, "formula {at}: {off} degrees");
        }
    }

    /// Where the axes leave the plane of the smooth normal, level heights keep it; Blinn's do not.
    #[test]
    fn level_heights_keep_the_smooth_normal() {
        let frame = SurfaceFrame { dpdu: DVec3::new(1.0, 0.0, 0.2), ..QUAD };
        for (at, formula) in FORMULAS.iter().enumerate() {
            let off = formula(&frame, DVec2::ZERO).angle_between(DVec3::Z).to_degrees();
            assert!(if at == 2 { off > 4.0 } else { off < 1e-6 }, "formula {at}: {off} degrees");
        }
    }
}
