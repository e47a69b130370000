//! What there is to see: meshes with materials, lights, a camera.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use bake::Image;
use glam::{DMat4, DVec3, DVec4, Vec3};
use heightfield::HeightField;
use mesh::Mesh;

use crate::{Camera, Held, RenderError};

/// A surface: a height field with its extent, colour and gloss.
#[derive(Debug, Clone)]
pub struct Material {
    /// Heights, with the relief's size in mesh units.
    pub field: Arc<HeightField>,
    /// Colour, sRGB-encoded, 1 to 4 channels; white when absent.
    pub albedo: Option<Arc<Image>>,
    /// A tangent-space normal map (glTF: +Y up the image, linear data) used as it is in place of one baked
    /// from the heights. 2 to 4 channels; integers and floats encode `n * 0.5 + 0.5`, floats may also
    /// hold plain unit vectors.
    pub normal: Option<Arc<Image>>,
    /// Linear rgba that the albedo is multiplied with.
    pub albedo_factor: [f32; 4],
    /// Share of light in the highlight, 0..1.
    pub specular: f32,
    /// Blinn-Phong exponent, at least 1.
    pub shininess: f32,
    /// Whether back faces show, with the relief on their side.
    pub double_sided: bool,
}

impl Material {
    /// A white, matt material.
    pub fn new(field: Arc<HeightField>) -> Self {
        Self {
            field,
            albedo: None,
            normal: None,
            albedo_factor: [1.0; 4],
            specular: 0.0,
            shininess: 32.0,
            double_sided: false,
        }
    }

    pub(crate) fn validate(&self, index: usize) -> Result<(), RenderError> {
        let fail = |problem: String| Err(RenderError::Material { index, problem });
        if !self.albedo_factor.iter().all(|factor| factor.is_finite() && *factor >= 0.0) {
            return fail(format!("albedo factor {:?} must be finite and not negative", self.albedo_factor));
        }
        if !(0.0..=1.0).contains(&self.specular) {
            return fail(format!("specular is {}; it must be in 0..1", self.specular));
        }
        if !(1.0..=1e6).contains(&self.shininess) {
            return fail(format!("shininess is {}; it must be in 1..1e6", self.shininess));
        }
        for (name, image, least) in [("albedo", &self.albedo, 1), ("normal map", &self.normal, 2)] {
            if let Some(image) = image {
                image.validate()?;
                if !(least..=4).contains(&image.channels) {
                    return fail(format!("{name} has {} channels; expected {least} to 4", image.channels));
                }
            }
        }
        Ok(())
    }
}

/// One mesh, or some of its triangles, in the scene.
#[derive(Debug, Clone)]
pub struct Draw<'a> {
    /// The mesh. Draws of the same mesh are instances: it is uploaded once.
    pub mesh: Held<'a, Mesh>,
    /// Which of its triangles.
    pub triangles: Range<u32>,
    /// How it looks.
    pub material: Held<'a, Material>,
    /// Where it stands: any affine map with an inverse. Relief is part of the object: it is stretched along with the
    /// mesh, as the displaced mesh would be.
    pub world_from_object: DMat4,
}

impl<'a> Draw<'a> {
    /// A whole mesh where it is.
    pub fn new(mesh: impl Into<Held<'a, Mesh>>, material: impl Into<Held<'a, Material>>) -> Self {
        let (mesh, material) = (mesh.into(), material.into());
        let triangles = 0..mesh.indices.len() as u32;
        Self { mesh, triangles, material, world_from_object: DMat4::IDENTITY }
    }

    fn validate_mesh(&self, index: usize) -> Result<(), RenderError> {
        let fail = |problem: String| Err(RenderError::Mesh { index, problem });
        let mesh = &*self.mesh;
        let vertices = mesh.positions.len();
        for (name, length) in [
            ("normals", mesh.normals.len()),
            ("uvs", mesh.uvs.len()),
            ("tangents", mesh.tangents.len()),
            ("dpdu", mesh.dpdu.len()),
            ("dpdv", mesh.dpdv.len()),
        ] {
            if length != vertices {
                return fail(format!("{vertices} positions but {length} {name}"));
            }
        }
        if self.triangles.start > self.triangles.end || self.triangles.end as usize > mesh.indices.len() {
            return fail(format!("triangles {:?} of {}", self.triangles, mesh.indices.len()));
        }
        let used = &mesh.indices[self.triangles.start as usize..self.triangles.end as usize];
        if let Some(bad) = used.iter().flatten().find(|&&vertex| vertex as usize >= vertices) {
            return fail(format!("vertex {bad} of {vertices} in a triangle"));
        }
        if let Some(at) = mesh.positions.iter().position(|position| !position.is_finite()) {
            return fail(format!("vertex {at} is at {}", mesh.positions[at]));
        }
        Ok(())
    }

    fn validate_place(&self, index: usize) -> Result<(), RenderError> {
        let fail = |problem: String| Err(RenderError::Mesh { index, problem });
        let matrix = self.world_from_object;
        let determinant = matrix.determinant();
        if !matrix.is_finite()
            || !determinant.is_finite()
            || determinant == 0.0
            || !matrix.inverse().is_finite()
        {
            return fail("world_from_object has no inverse".to_owned());
        }
        if matrix.row(3) != DVec4::W {
            return fail(format!(
                "the last row of world_from_object is {}; it must be 0, 0, 0, 1",
                matrix.row(3)
            ));
        }
        Ok(())
    }
}

/// A source of light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Parallel light, as from the sun.
    Directional {
        /// Where the light travels to, world axes, any length.
        direction: Vec3,
        /// Linear rgb.
        color: [f32; 3],
        /// What a surface facing the light receives.
        intensity: f32,
    },
    /// Light from a point, falling off with the square of the distance.
    Point {
        /// World position.
        position: DVec3,
        /// Linear rgb.
        color: [f32; 3],
        /// What a surface facing the light at distance 1 receives.
        intensity: f32,
    },
}

impl Light {
    pub(crate) fn validate(&self, index: usize) -> Result<(), RenderError> {
        let fail = |problem: String| Err(RenderError::Light { index, problem });
        let (color, intensity) = match *self {
            Light::Directional { direction, color, intensity } => {
                if !direction.is_finite() || direction.as_dvec3().length() < 1e-30 {
                    return fail(format!("direction is {direction}; it must be finite and not zero"));
                }
                (color, intensity)
            }
            Light::Point { position, color, intensity } => {
                if !position.is_finite() {
                    return fail(format!("position is {position}; it must be finite"));
                }
                (color, intensity)
            }
        };
        if !color.iter().chain([&intensity]).all(|value| value.is_finite() && *value >= 0.0) {
            return fail(format!(
                "color {color:?} and intensity {intensity} must be finite and not negative"
            ));
        }
        Ok(())
    }
}

/// Everything there is to see.
#[derive(Debug, Clone)]
pub struct Scene<'a> {
    /// The meshes.
    pub draws: Vec<Draw<'a>>,
    /// Where from.
    pub camera: Camera,
    /// The lights.
    pub lights: Vec<Light>,
    /// Light from everywhere, linear rgb.
    pub ambient: [f32; 3],
    /// Colour where nothing is, linear rgba.
    pub background: [f32; 4],
}

impl Scene<'_> {
    pub(crate) fn validate(&self) -> Result<(), RenderError> {
        self.camera.validate()?;
        if !self.ambient.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return Err(RenderError::Scene(format!(
                "ambient light {:?} must be finite and not negative",
                self.ambient
            )));
        }
        if !self.background.iter().all(|value| (0.0..=1.0).contains(value)) {
            return Err(RenderError::Scene(format!("background {:?} must be in 0..1", self.background)));
        }
        for (index, light) in self.lights.iter().enumerate() {
            light.validate(index)?;
        }
        let mut known = HashSet::new();
        for (index, draw) in self.draws.iter().enumerate() {
            if known.insert((std::ptr::from_ref::<Mesh>(&draw.mesh), draw.triangles.clone())) {
                draw.validate_mesh(index)?;
            }
            draw.validate_place(index)?;
            draw.material.validate(index)?;
        }
        Ok(())
    }
}
