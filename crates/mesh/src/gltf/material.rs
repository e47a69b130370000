//! Materials, and which UVs their textures use.

use std::collections::HashMap;

use glam::Vec2;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::NormalTexture;
use gltf::json::texture::Info;

use super::buffers::Buffers;
use super::image::Images;
use crate::error::MeshError;
use crate::limits;
use crate::material::MaterialSource;

/// Which TEXCOORD set a texture uses and how KHR_texture_transform moves it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvChoice {
    pub set: u32,
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
}

impl Default for UvChoice {
    fn default() -> Self {
        Self { set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
    }
}

impl UvChoice {
    fn new(set: u32, transform: Option<&TextureTransform>) -> Self {
        match transform {
            None => Self { set, ..Self::default() },
            Some(t) => Self {
                set: t.tex_coord.unwrap_or(set),
                offset: Vec2::from(t.offset.0),
                rotation: t.rotation.0,
                scale: Vec2::from(t.scale.0),
            },
        }
    }

    /// The extension's matrix product: scale first, then rotate, then move. Positive angles turn
    /// counter-clockwise as seen, which with `v` down is from u towards -v.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        let (sin, cos) = self.rotation.sin_cos();
        let scaled = uv * self.scale;
        self.offset + Vec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x)
    }

    /// Whether directions in the texture change, so that tangents of the plain UVs no longer fit.
    pub fn turns(&self) -> bool {
        self.rotation != 0.0 || self.scale.min_element() <= 0.0
    }
}

/// The materials in use, read once each.
#[derive(Default)]
pub(super) struct Materials {
    place: HashMap<usize, usize>,
    read: Vec<(MaterialSource, UvChoice)>,
    images: Images,
}

impl Materials {
    /// Index in the result of the file's material `index`.
    pub fn read(
        &mut self,
        buffers: &Buffers<'_>,
        index: usize,
        warnings: &mut Vec<String>,
    ) -> Result<usize, MeshError> {
        if let Some(&place) = self.place.get(&index) {
            return Ok(place);
        }
        let Some(material) = buffers.root.materials.get(index) else {
            return Err(buffers.missing("material", index, buffers.root.materials.len()));
        };
        let pbr = &material.pbr_metallic_roughness;
        let mut result = MaterialSource {
            name: limits::name(material.name.as_deref().unwrap_or("")).to_owned(),
            albedo_factor: pbr.base_color_factor.0,
            ..MaterialSource::default()
        };
        if !result.albedo_factor.iter().all(|f| f.is_finite()) {
            result.albedo_factor = [1.0; 4];
        }
        (result.specular, result.shininess) = highlight(pbr.roughness_factor.0);
        let albedo_uv = pbr.base_color_texture.as_ref().map(|info| {
            result.albedo = self.images.read(buffers, info.index.value(), warnings);
            albedo_choice(info)
        });
        let normal_uv = material.normal_texture.as_ref().map(|texture| {
            result.normal = self.images.read(buffers, texture.index.value(), warnings);
            result.normal_scale = if texture.scale.is_finite() { texture.scale } else { 1.0 };
            normal_choice(texture)
        });
        if let (Some(albedo), Some(normal)) = (albedo_uv, normal_uv)
            && albedo != normal
        {
            warnings.push(format!(
                "material {index}: albedo and normal map differ in UV set or transform; \
                 the normal map's are used for both"
            ));
        }
        let place = self.read.len();
        self.read.push((result, normal_uv.or(albedo_uv).unwrap_or_default()));
        self.place.insert(index, place);
        Ok(place)
    }

    /// The UVs a material asks for: its normal map's, else its albedo's.
    pub fn uv(&self, material: Option<usize>) -> UvChoice {
        material.and_then(|m| self.read.get(m)).map_or_else(UvChoice::default, |(_, uv)| *uv)
    }

    /// All that were read.
    pub fn finish(self) -> Vec<MaterialSource> {
        self.read.into_iter().map(|(material, _)| material).collect()
    }
}

/// Strength and exponent of a Blinn-Phong highlight for a roughness in 0..1: the exponent is
/// `2 / r^4 - 2` (Karis 2013), the strength fades to nothing at full roughness.
fn highlight(roughness: f32) -> (f32, f32) {
    let r = if roughness.is_finite() { roughness.clamp(0.0, 1.0) } else { 1.0 };
    (0.5 * (1.0 - r), (2.0 / r.powi(4).max(1e-6) - 2.0).clamp(1.0, 10_000.0))
}

fn albedo_choice(info: &Info) -> UvChoice {
    UvChoice::new(info.tex_coord, info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref()))
}

fn normal_choice(texture: &NormalTexture) -> UvChoice {
    let transform = texture.extensions.as_ref().and_then(|e| e.others.get("KHR_texture_transform"));
    let transform = transform.and_then(|value| gltf::json::deserialize::from_value(value.clone()).ok());
    UvChoice::new(texture.tex_coord, transform.as_ref())
}
