//! The surfaces of `shaders_wgsl/surface/` in Rust, without mipmaps: the truth their pictures are held to.

mod baked_slope;
mod bump;
mod bump_blinn;
mod bump_derivative;
mod bump_exact;
mod bump_forward;
mod bump_orthogonal;
mod displaced;
mod dot3;
mod flat;
mod formula;
mod frame;
mod normal;
mod slope;
mod tangent;

pub use baked_slope::baked_slope;
pub use bump::bump;
pub use bump_blinn::bump_blinn;
pub use bump_derivative::{ScreenDerivatives, bump_derivative};
pub use bump_exact::bump_exact;
pub use bump_forward::bump_forward;
pub use bump_orthogonal::bump_orthogonal;
pub use displaced::displaced;
pub use dot3::dot3;
pub use flat::flat;
pub use formula::{perturb_blinn, perturb_exact, perturb_general, perturb_orthogonal};
pub use frame::{SurfaceFrame, frame_coordinates, perturb_by_map};
pub use normal::normal;
pub use slope::{central_slope, forward_slope};
pub use tangent::tangent;
