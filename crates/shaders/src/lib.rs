//! Composes and checks the shaders of `shaders_wgsl/`. Knows no device.
//!
//! The files are embedded when the crate is built. A line `#import "lib/frame.wgsl"` stands for the
//! file of that path, once a program however often it is imported. Paths are relative to
//! `shaders_wgsl/`; order does not matter in WGSL.
//!
//! | folder | holds |
//! |---|---|
//! | `lib/` | functions and structs: no bindings, no entry points |
//! | `bindings/` | declarations of what the host binds |
//! | `search/` | one file a technique: `search` and `occluded` |
//! | `surface/` | one file a way to find the shading normal |
//! | `shading/` | lights and shadows |
//! | `entry/` | vertex and fragment entry points of the renderer |
//! | `kernels/` | compute entry points |

pub mod compose;
pub mod export;
pub mod reflect;

pub use compose::{ComposeError, compose, compose_paths, compose_with_horizon, files, read, traces_solids};
pub use export::{ExportError, Language, export_search};
pub use reflect::{Field, Layout, ReflectError, layout_of, validate};
