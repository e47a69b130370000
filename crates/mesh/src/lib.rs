//! Triangle meshes: loading, generating, and the tangent frames that carry relief across them.
//!
//! Conventions: right-handed axes with +Y up; UV origin at the top left of the image with `v`
//! *down*, as in glTF. OBJ counts `v` upwards and is flipped in its reader and nowhere else.
//! Counter-clockwise triangles face the viewer. Lengths are in mesh units.
//!
//! [`Mesh::open`] reads OBJ, glTF and GLB; [`Mesh::quad`], [`Mesh::cube`], [`Mesh::sphere`] and
//! [`Mesh::torus`] generate shapes whose derivatives are exact; [`Mesh::from_arrays`] takes plain
//! arrays. [`tangents`] alone turns arrays into arrays. [`bake_detail`] makes maps of a detailed mesh on the
//! UVs of a plain one, and [`displace()`] the way back: micro-polygons from a height.
//!
//! Readers answer bad files with a [`MeshError`]. What could be repaired or had to be left out is
//! listed in [`Mesh::warnings`].

pub mod arrays;
pub mod detail;
pub mod displace;
pub mod error;
pub mod frame;
pub mod generate;
mod gltf;
pub mod limits;
pub mod material;
mod mesh;
mod normals;
mod obj;
mod sheets;

pub use detail::{
    DetailMaps, DetailOptions, DetailReport, NormalSpace, SkyOptions, bake_detail, tangent_map,
};
pub use displace::{Cut, Displaced, EdgeSide, Relief, bridges, displace};
pub use error::MeshError;
pub use frame::{Derivatives, FrameMethod, Split, derivatives, normal_derivatives, tangents};
pub use material::{ImageSource, MaterialSource};
pub use mesh::{Mesh, Part};
pub use sheets::{Sheets, sheets};
