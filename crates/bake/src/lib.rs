//! Maps from height fields, and the image files they come from and go to.
//!
//! Data flows one way: [`files`] -> `heightfield::HeightField` -> [`mod@slopes`] -> the maps
//! ([`normal`], [`relief`], [`mod@pyramid`]) -> [`encode`] -> [`files`]. [`maps`] is the registry of all
//! maps and drives them; a new map is one file here and one line there.
//!
//! Conventions: row 0 is the top, `u` runs right and `v` down. Baked maps are `f32`: normals in
//! -1..1 with +X right, +Y up, +Z out (OpenGL, glTF), heights in 0..1. Integers appear only when a
//! map is saved.

pub mod bits;
pub mod cache;
pub mod cone;
pub mod curvature;
pub mod distance;
pub mod encode;
pub mod error;
pub mod files;
pub mod horizon;
pub mod image;
pub mod kernel;
pub mod maps;
mod memory;
pub mod mips;
pub mod moments;
pub mod normal;
pub mod occlusion;
pub mod progress;
pub mod provide;
pub mod pyramid;
pub mod relief;
pub mod repair;
mod resample;
mod rows;
pub mod slopes;
mod span;
pub mod stream;
mod sweep;
mod texels;

pub use bits::effective_bits;
pub use cache::{Cache, bake_cached};
pub use cone::{ConeMode, cone_map, relaxed_cone_map};
pub use curvature::curvature;
pub use distance::distance_map;
pub use error::BakeError;
pub use files::{WriteOptions, decode_image, read_image, write_image, write_image_with};
pub use horizon::{azimuth, horizon_map};
pub use image::{Image, Samples};
pub use kernel::Kernel;
pub use maps::{
    Baked, Channel, Encoded, EncodedLayer, FileFormat, Form, Grid, Kind, Layer, Map, MapInfo, MapOption,
    Options, Plan, Span, Value, bake, bake_encoded, bake_rows, save,
};
pub use mips::{NormalLength, mip_chain, mip_sizes, normal_mips};
pub use moments::{covariance, half_vector_density, moments, toksvig_roughness};
pub use normal::{Convention, normal_map, normal_xy};
pub use occlusion::{ao_map, bent_normal_map};
pub use progress::Progress;
pub use provide::{cone_ratios, provide, provide_for};
pub use pyramid::{Level, pyramid};
pub use relief::relief_map;
pub use slopes::slopes;
pub use span::finite_span;
pub use stream::{HeightSettings, StreamRequest, Streamed, Values, bake_file};
pub use texels::Texels;
