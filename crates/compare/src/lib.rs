//! Run time against error: what each technique costs on a height map and how wrong it is.
//!
//! Nothing here knows a GPU or Python. Data flows one way: seeded [`rays`] -> [`reference`] (the
//! exact surface in `f64`, found once per set of rays, [`cached`] and shared by all settings) ->
//! [`metrics`] and [`timing`] for each setting, driven by [`run`] -> [`pareto`] and [`recommend`].
//! [`adaptive`] chooses the settings when nobody says. A device takes part through the trait
//! [`timing::DeviceMarch`].

pub mod adaptive;
pub mod cached;
pub mod core_time;
pub mod dive;
pub mod error;
pub mod judge;
pub mod metrics;
pub mod pareto;
pub mod picture;
pub mod rays;
pub mod recommend;
pub mod reference;
pub mod region;
pub mod rounds;
pub mod run;
pub mod setting;
pub mod statistics;
pub mod stores;
pub mod sweep;
pub mod timing;

pub use adaptive::{Dropped, compare_adaptively};
pub use error::CompareError;
pub use metrics::{Metrics, RayErrors, Reported};
pub use rays::Rays;
pub use reference::Reference;
pub use region::Region;
pub use run::{Plan, Row, compare, verify};
pub use setting::{Format, Setting};
pub use timing::{DeviceMarch, Timing};
