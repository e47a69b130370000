//! Renders meshes with any technique on a Vulkan device. The only crate that knows wgpu.
//!
//! Data flows one way: [`Scene`] and [`Request`] -> maps, buffers, pipelines (`prepare`) -> one pass a
//! band of rows ([`render()`]) -> [`Frame`]. What a technique does not use is neither baked nor
//! uploaded, bound or compiled; what it uses is kept on the [`Device`] as long as the height field or
//! image it was made from. [`march()`] runs the same searches over rays of its own.
//!
//! Lengths are mesh (world) units, angles radians, colours linear light unless said to be sRGB.
//! Positions reach the device relative to the camera, computed in `f64`.

pub mod adapter;
pub mod bounds;
pub mod camera;
mod clusters;
mod covers;
mod culling;
pub mod device;
pub mod error;
pub mod frame;
mod frame_binding;
mod geometry;
pub mod heights;
pub mod held;
mod layouts;
pub mod march;
mod materials;
mod micro;
mod pieces;
mod pipeline;
pub mod plain;
mod prepare;
mod readback;
pub mod render;
pub mod renderer;
pub mod request;
mod resolve;
pub mod scene;
mod shell;
pub mod skips;
mod sorting;
mod sparing;
pub mod surface;
mod tally;
mod targets;
pub mod texture;
mod timer;
mod triangles;
pub mod uniforms;
mod unpack;
mod uploads;
mod view;
mod walls;
mod warnings;

pub use adapter::{ADAPTER_VARIABLE, AdapterInfo, adapters};
pub use camera::Camera;
pub use device::{Device, DeviceOptions, device};
pub use error::RenderError;
pub use frame::{Aovs, Frame, Stats};
pub use held::Held;
pub use march::{DeviceHits, march, occluded};
pub use plain::{PLAIN_TECHNIQUES, PlainTechnique};
pub use render::{render, render_in_bands};
pub use renderer::{Renderer, Ticket};
pub use request::{AovSet, HorizonShadows, Request, TechniqueChoice};
pub use scene::{Draw, Light, Material, Scene};
pub use skips::{SkipError, Skipped, Skips};
