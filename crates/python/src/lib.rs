//! `bumpwgpu._bumpwgpu`: what the Python package gets from the Rust crates.
//!
//! Nothing is decided here. Arguments arrive checked and normalised by `python/bumpwgpu`; heavy
//! work leaves through [`run::run`] and errors through [`errors::Raise`].

mod baking;
mod compare;
mod detail;
mod errors;
mod export;
mod field;
mod images;
mod march;
mod mesh;
mod rendering;
mod repair;
mod run;
mod stress;
mod surface;
mod system;

use pyo3::prelude::*;

/// The compiled half of bumpwgpu; use the package `bumpwgpu` instead.
#[pymodule]
mod _bumpwgpu {
    #[pymodule_export]
    use crate::baking::{bake_file, bake_map, bake_rows, map_bytes, map_registry, save_map};
    #[pymodule_export]
    use crate::compare::{
        CompareView, SegmentReference, compare_front, compare_memory, compare_planar, compare_recommend,
        compare_verify,
    };
    #[pymodule_export]
    use crate::detail::{bake_detail, bake_tangents, mesh_map_registry};
    #[pymodule_export]
    use crate::errors::classes::{BakeError, BumpError, CompareError, MeshError, RenderError};
    #[pymodule_export]
    use crate::export::export_search;
    #[pymodule_export]
    use crate::field::Field;
    #[pymodule_export]
    use crate::images::{decode_image, effective_bits, finite_span, read_image};
    #[pymodule_export]
    use crate::march::{Cancel, march, techniques};
    #[pymodule_export]
    use crate::mesh::{PyMesh, tangent_methods, tangents};
    #[pymodule_export]
    use crate::rendering::{
        PyMaterial, PyRenderer, PyTicket, adapters, aov_names, march_gpu, skip_codes, skip_names,
    };
    #[pymodule_export]
    use crate::repair::{check_normals, dequantise, derivatives, integrate_normals, quantum, seams};
    #[pymodule_export]
    use crate::stress::judge;
    #[pymodule_export]
    use crate::surface::{bend_normals, surface_points};
    #[pymodule_export]
    use crate::system::{simd_level, threads};

    /// Version of the package.
    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
    /// Longest side of a height map, in texels.
    #[pymodule_export]
    const MAX_SIDE: usize = heightfield::field::MAX_SIDE;

    /// Longest side of a map baked from a mesh, in texels.
    #[pymodule_export]
    const MAX_MAP_SIDE: usize = ::mesh::detail::MAX_MAP_SIDE;

    #[pymodule_init]
    fn init() {
        crate::run::install_panic_hook();
    }
}
