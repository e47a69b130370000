//! Materials as files describe them: references to images and plain factors, nothing decoded.

use std::path::PathBuf;
use std::sync::Arc;

/// Where the bytes of an image are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ImageSource {
    /// An image file. It existed when the mesh was read.
    File(PathBuf),
    /// An encoded image (PNG, JPEG, ...) carried inside the mesh file, shared by all that use it.
    Encoded(Arc<[u8]>),
}

/// A material as the mesh file describes it.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialSource {
    /// Name in the file; may be empty.
    pub name: String,
    /// Colour image (sRGB): `map_Kd`, glTF base colour.
    pub albedo: Option<ImageSource>,
    /// Tangent-space normal map (+X right, +Y up): `norm`, glTF normal texture.
    pub normal: Option<ImageSource>,
    /// Height image, bright = high: `map_Bump` or `bump`.
    pub bump: Option<ImageSource>,
    /// Displacement image, bright = high: `disp` or `map_disp`.
    pub displacement: Option<ImageSource>,
    /// Linear RGBA factor on the albedo: `Kd` and `d`, glTF base colour factor.
    pub albedo_factor: [f32; 4],
    /// Strength of the specular highlight, 0..1: the largest component of `Ks`; 0.5 when unsaid.
    pub specular: f32,
    /// Exponent of the Blinn-Phong highlight: `Ns`, or from glTF's roughness `r` as `2 / r^4 - 2`.
    pub shininess: f32,
    /// Factor on the bump heights: `-bm`; 1 when unsaid.
    pub bump_scale: f32,
    /// Factor on the displacement heights: `-mm`'s gain or `-bm`; 1 when unsaid.
    pub displacement_scale: f32,
    /// Factor on x and y of the normal map before it is normalised: glTF's normal scale, `-bm`.
    pub normal_scale: f32,
}

impl Default for MaterialSource {
    fn default() -> Self {
        Self {
            name: String::new(),
            albedo: None,
            normal: None,
            bump: None,
            displacement: None,
            albedo_factor: [1.0; 4],
            specular: 0.5,
            shininess: 32.0,
            bump_scale: 1.0,
            displacement_scale: 1.0,
            normal_scale: 1.0,
        }
    }
}
