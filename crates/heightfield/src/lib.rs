//! Height fields and the searches that find where a ray meets them.
//!
//! Everything here is plain Rust on the CPU: no device, no files, no Python. Positions are in
//! *texture space* `(u, v, z)`: `u` to the right, `v` down (row 0 of an image is `v = 0`), `z` the
//! normalised height, 0 low and 1 high. Texel `i` of `W` has its centre at `u = (i + 0.5) / W`.
//!
//! Data flows one way: [`HeightField`] -> [`MaxPyramid`] -> [`search`] -> [`march()`].

pub mod baked;
mod chunk;
pub mod cone_map;
pub mod distance_map;
pub mod error;
pub mod field;
pub mod hits;
pub mod horizon;
pub mod lanes;
pub mod march;
pub mod margin;
pub mod oracle;
mod order;
mod packet;
pub mod pyramid;
pub mod ray;
pub mod rays;
pub mod search;
pub mod skip_pyramid;
pub mod technique;
pub mod wide;

pub use baked::BakedMap;
pub use cone_map::{ConeKind, ConeMap};
pub use distance_map::DistanceMap;
pub use error::HeightFieldError;
pub use field::{Extent, HeightField, Wrap};
pub use hits::{Hits, HitsMut, OutputSet};
pub use horizon::HorizonMap;
pub use march::{MarchOptions, march, march_into};
pub use pyramid::MaxPyramid;
pub use ray::{Found, Segment, Status};
pub use rays::RayArray;
pub use skip_pyramid::SkipPyramid;
pub use technique::{Parameter, Technique, TechniqueInfo};
