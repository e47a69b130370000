//! What a draw's fragments may leave out of their marches and shadow rays: constants of its pipeline, and how far a
//! hit may be off. The shaders that go by it are `shading/approach.wgsl`, `shading/lit.wgsl` and
//! `shading/shadow_search.wgsl`; what each kind promises stands in `docs/skipping.md`.

use glam::{DMat3, DVec3};

use crate::culling::Stand;
use crate::request::Program;
use crate::uniforms::DrawInfo;
use crate::uploads::Ground;
use crate::{AovSet, Camera, Device, Draw, RenderError, Request, Skips, TechniqueChoice};

/// Searches whose hits lie on the surface: whatever the ray can meet bounds them.
const ON_SURFACE: [&str; 4] = ["exact", "cone", "relaxed_cone", "distance"];
/// Techniques that read a height or two and do not march.
const ONE_READ: [&str; 2] = ["parallax", "parallax_limited"];
/// What rounding may take of the lowest and the highest point: BOUNDS_ROUNDING of `shaders_wgsl/lib/bounds.wgsl`.
const ROUNDING: f32 = 2.5e-7;

/// What may be left out of a draw, from wherever it is seen.
pub(crate) struct Sparing {
    /// What the shaders know of the ground.
    pub ground: Ground,
    skips: Skips,
    /// The search, where the shaders look the bounds of the ground up.
    search: Option<&'static str>,
    scale: f64,
}

/// How far a hit may be off in a view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leeway {
    /// Times the way from the camera to a point of the mesh, object space: heights there.
    most_heights: DVec3,
    /// Heights at the nearest point of the draw.
    least: f64,
}

impl Sparing {
    /// Of a draw.
    pub fn of(device: &Device, draw: &Draw<'_>, request: &Request) -> Result<Self, RenderError> {
        let marches = Skips::IN_PIXELS;
        let search = match &request.technique {
            TechniqueChoice::Search(technique)
                if !request.in_shell() && request.skips.intersects(marches) =>
            {
                Some(technique.info.name).filter(|name| !ONE_READ.contains(name))
            }
            _ => None,
        };
        let field = &draw.material.field;
        Ok(Self {
            ground: device.ground(search.is_some().then_some(field))?,
            skips: request.skips,
            search,
            scale: f64::from(field.extent().scale),
        })
    }

    /// What the shaders are told of a place, with what they may leave out there.
    pub fn told(&self, place: DrawInfo, leeway: &Leeway, request: &Request) -> DrawInfo {
        let [low, high] = self.ground.span;
        DrawInfo {
            most_heights: leeway.most_heights.as_vec3().to_array(),
            most_texels: request.skip_error.texels,
            // Rounded outwards.
            span: [low - ROUNDING, high + ROUNDING],
            ..place
        }
    }

    /// How far a hit may be off in a view.
    pub fn leeway(&self, camera: &Camera, request: &Request, stand: &Stand) -> Leeway {
        let forward = camera.forward();
        let linear = DMat3::from_mat4(stand.relative_from_object);
        let [_, right, down] = camera.pixel_directions([request.width, request.height], 0);
        let [width, height] = [request.width, request.height].map(f64::from);
        // A height moves what is seen by no more than its length over the distance to it, off the view axis a little
        // more than on it.
        let corner = (right * (0.5 * width)).length().hypot((down * (0.5 * height)).length());
        let relief = self.scale * stretch(linear) * corner.hypot(1.0);
        let at_1 = (f64::from(request.skip_error.pixels) * right.length() / relief.max(1e-30)).min(1e6);
        let middle = stand.relative_from_object.w_axis.truncate().dot(forward);
        Leeway { most_heights: linear.transpose() * forward * at_1, least: at_1 * (middle - stand.radius) }
    }

    /// Whether no pixel of a view needs a march.
    pub fn needs_no_march(&self, leeway: &Leeway) -> bool {
        let Some(search) = self.search else { return false };
        let [low, high] = self.ground.span;
        let on_surface = ON_SURFACE.contains(&search);
        if self.skips.contains(Skips::FLAT) && (self.scale == 0.0 || on_surface && low == high) {
            return true;
        }
        // Searches with layers may end a layer beside the surface, but always between lid and floor.
        let off = if on_surface { 0.5 * f64::from(high - low) + 1e-4 } else { 1.0 };
        self.skips.contains(Skips::PARALLAX) && off <= leeway.least
    }

    /// Whether nothing tells the draw from the bare mesh.
    pub fn shows_no_relief(&self, draw: &Draw<'_>, request: &Request) -> bool {
        let base = draw.material.field.extent().base;
        self.search.is_some()
            && self.skips.contains(Skips::FLAT)
            && self.ground.span == [base, base]
            && draw.material.normal.is_none()
            && !request.aovs.intersects(AovSet::RAY_START | AovSet::RAY_DELTA)
    }

    /// Constants of the draw's pipeline, of those that its program has. `marches`: whether any pixel may need a march.
    pub fn constants(&self, program: Program, request: &Request, marches: bool) -> Vec<(&'static str, i64)> {
        let has = |kind| i64::from(self.skips.contains(kind));
        let mut constants = Vec::new();
        if self.search.is_some() && program.search.is_none() {
            constants.push(("flat_ground", 1));
        }
        if self.search.is_some() && matches!(program.entry, "relief" | "relief_mapped") {
            constants.push(("skip_flat", has(Skips::FLAT)));
            constants.push(("skip_parallax", has(Skips::PARALLAX)));
            constants.push(("skip_range", has(Skips::RANGE)));
            constants.push(("skip_march", i64::from(!marches)));
        }
        if program.search.is_some() && !program.horizon {
            constants.push(("skip_shadow", has(Skips::SHADOW)));
            let shown = request.aovs.contains(AovSet::SHADOW);
            constants.push(("skip_faint", i64::from(self.skips.contains(Skips::SHADOW) && !shown)));
        }
        constants
    }
}

/// A bound of the factor by which a matrix stretches anything; the factor itself for turned and evenly scaled meshes.
fn stretch(matrix: DMat3) -> f64 {
    // The largest eigenvalue of its square is no more than the largest sum of a row.
    let square = matrix.transpose() * matrix;
    let [x, y, z] = [square.x_axis, square.y_axis, square.z_axis].map(|axis| axis.abs().element_sum());
    x.max(y).max(z).sqrt()
}
