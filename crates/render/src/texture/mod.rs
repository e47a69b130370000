//! From maps to textures.

mod albedo;
mod cube;
mod horizon;
mod mips;
mod normals;
mod slopes;
mod upload;

pub(crate) use albedo::{LINEAR_FROM_BYTE, albedo, srgb_byte, white};
pub(crate) use cube::normalization_cube;
pub(crate) use horizon::horizon;
pub(crate) use normals::{baked_8_bit, own, own_8_bit};
pub(crate) use slopes::slopes;
pub(crate) use upload::{MipLevel, sampler, upload};

pub use albedo::{linear_from_srgb, srgb_from_linear};
pub use mips::halve;
pub use normals::unit_normals;
