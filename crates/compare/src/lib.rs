//! Run time against error: what each technique costs on a height map and how wrong it is.
//!
//! Nothing here knows a GPU or Python. Data flows one way: seeded [`rays`] -> [`reference`] (the
//! exact surface in `f64`, found once per set of rays and shared by all techniques) -> [`metrics`]
//! and [`timing`] for each technique, driven by [`run`] -> [`pareto`] and [`recommend`]. A device
//! takes part through the trait [`timing::DeviceMarch`].

pub mod dive;
pub mod error;
pub mod metrics;
pub mod pareto;
pub mod picture;
pub mod rays;
pub mod recommend;
pub mod reference;
pub mod run;
pub mod sweep;
pub mod timing;

pub use error::CompareError;
pub use metrics::{Metrics, RayErrors, Reported};
pub use rays::Rays;
pub use reference::Reference;
pub use run::{Plan, Row, compare};
pub use timing::{DeviceMarch, Timing};
