//! The surfaces of `shaders_wgsl/surface/` in Rust, without mipmaps: the truth their pictures are held to.

mod bump;
mod dot3;
mod flat;
mod frame;
mod normal;
mod tangent;

pub use bump::bump;
pub use dot3::dot3;
pub use flat::flat;
pub use frame::{SurfaceFrame, frame_coordinates, perturb_by_map, perturb_by_slope};
pub use normal::normal;
pub use tangent::tangent;
