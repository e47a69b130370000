//! The one open device of the process, and how its faults become errors.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::adapter::{ADAPTER_VARIABLE, choose};
use crate::layouts::Layouts;
use crate::pipeline::{Pipeline, PipelineKey};
use crate::uploads::Uploads;
use crate::{AdapterInfo, RenderError};

/// How to open a device.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DeviceOptions {
    /// Part of the name of the device wanted, case aside.
    pub adapter: Option<String>,
    /// Filter heights in the shader even where the device could do it.
    pub manual_bilinear: bool,
}

/// An open Vulkan device with its pipelines and what was uploaded to it.
pub struct Device {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) layouts: Layouts,
    pub(crate) manual_bilinear: bool,
    pub(crate) timestamps: bool,
    pub(crate) pipelines: Mutex<HashMap<PipelineKey, Arc<Pipeline>>>,
    pub(crate) uploads: Mutex<Uploads>,
    pub(crate) solids: Mutex<crate::shell::Store>,
    info: AdapterInfo,
    faults: Arc<Faults>,
    process: u32,
}

/// What the device reports outside of any call.
#[derive(Default)]
struct Faults {
    lost: Mutex<Option<String>>,
    uncaptured: Mutex<Option<String>>,
}

impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Device").field("info", &self.info).finish_non_exhaustive()
    }
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

static SHARED: Mutex<Option<Arc<Device>>> = Mutex::new(None);

/// The device of this process, opened at the first call.
///
/// `BUMPWGPU_ADAPTER` chooses it by a part of its name; otherwise a hardware device goes before a
/// software one. A lost device is opened anew, and so is one inherited through `fork`.
///
/// # Errors
/// [`RenderError::NoDevice`] says what to install; [`RenderError::NoSuchAdapter`] lists the names.
pub fn device() -> Result<Arc<Device>, RenderError> {
    let mut shared = lock(&SHARED);
    if let Some(device) = shared.as_ref() {
        if device.process == std::process::id() && device.lost().is_none() {
            return Ok(Arc::clone(device));
        }
        if device.process != std::process::id() {
            // The driver's threads stayed in the parent: closing its device here could wait for ever.
            std::mem::forget(Arc::clone(device));
        }
    }
    let adapter = std::env::var(ADAPTER_VARIABLE).ok().filter(|name| !name.is_empty());
    let device = Arc::new(Device::open(&DeviceOptions { adapter, manual_bilinear: false })?);
    *shared = Some(Arc::clone(&device));
    Ok(device)
}

impl Device {
    /// Opens a device of its own; [`device`] is the usual way.
    ///
    /// # Errors
    /// [`RenderError::NoDevice`], [`RenderError::NoSuchAdapter`], [`RenderError::Open`].
    pub fn open(options: &DeviceOptions) -> Result<Self, RenderError> {
        let adapter = choose(options.adapter.as_deref())?;
        let info = AdapterInfo::from(adapter.get_info());
        let optional = wgpu::Features::FLOAT32_FILTERABLE | wgpu::Features::TIMESTAMP_QUERY;
        let features = adapter.features() & optional;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("bumpwgpu"),
            required_features: features,
            required_limits: adapter.limits(),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            trace: wgpu::Trace::Off,
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| RenderError::Open { adapter: info.name.clone(), reason: error.to_string() })?;

        let faults = Arc::new(Faults::default());
        let seen = Arc::clone(&faults);
        device.set_device_lost_callback(move |reason, message| {
            *lock(&seen.lost) = Some(format!("{reason:?}: {message}"));
        });
        let seen = Arc::clone(&faults);
        // wgpu's own handler panics.
        device.on_uncaptured_error(Arc::new(move |error| {
            lock(&seen.uncaptured).get_or_insert_with(|| error.to_string());
        }));
        let manual_bilinear =
            options.manual_bilinear || !features.contains(wgpu::Features::FLOAT32_FILTERABLE);
        Ok(Self {
            layouts: Layouts::new(&device, !manual_bilinear),
            device,
            queue,
            manual_bilinear,
            // A device in software stamps when it has queued the work, not when it has done it; the
            // host's clock is its clock anyway.
            timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY) && info.kind != "software",
            pipelines: Mutex::default(),
            uploads: Mutex::default(),
            solids: Mutex::default(),
            info,
            faults,
            process: std::process::id(),
        })
    }

    /// Name and driver.
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }

    /// Whether times come from the device itself.
    pub fn has_timestamps(&self) -> bool {
        self.timestamps
    }

    /// Pipelines compiled so far.
    pub fn pipelines_compiled(&self) -> usize {
        lock(&self.pipelines).len()
    }

    fn lost(&self) -> Option<String> {
        lock(&self.faults.lost).clone()
    }

    /// Runs `work` and turns whatever the device complains about into an error.
    pub(crate) fn guard<T>(
        &self,
        during: &'static str,
        work: impl FnOnce() -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let internal = self.device.push_error_scope(wgpu::ErrorFilter::Internal);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let result = work();
        let validation = pollster::block_on(validation.pop());
        let internal = pollster::block_on(internal.pop());
        let memory = pollster::block_on(memory.pop());
        if let Some(reason) = self.lost() {
            return Err(RenderError::DeviceLost(reason));
        }
        if memory.is_some() {
            return Err(RenderError::OutOfMemory(during));
        }
        let message = validation.or(internal).map(|error| error.to_string());
        if let Some(message) = message.or_else(|| lock(&self.faults.uncaptured).take()) {
            return Err(RenderError::Device { during, message });
        }
        result
    }

    /// Waits until the device has done all that was submitted.
    pub(crate) fn wait(&self, during: &'static str) -> Result<(), RenderError> {
        self.device
            .poll(wgpu::PollType::wait_indefinitely())
            .map(|_| ())
            .map_err(|error| RenderError::Device { during, message: error.to_string() })
    }

    /// Waits until the device has done what was submitted then.
    pub(crate) fn wait_for(
        &self,
        submission: wgpu::SubmissionIndex,
        during: &'static str,
    ) -> Result<(), RenderError> {
        self.device
            .poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
            .map(|_| ())
            .map_err(|error| RenderError::Device { during, message: error.to_string() })
    }

    /// Fails in a process that was forked off the one that opened the device: its threads stayed there.
    pub(crate) fn check_process(&self) -> Result<(), RenderError> {
        if self.process == std::process::id() {
            return Ok(());
        }
        Err(RenderError::DeviceLost("it was opened by the process that this one was forked from".to_owned()))
    }

    /// Fails when `got` is more than the device's `limit`.
    pub(crate) fn check(what: &'static str, got: u64, limit: u64) -> Result<(), RenderError> {
        if got > limit { Err(RenderError::Limit { what, got, limit }) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_device_is_an_error_and_then_replaced() {
        let first = match device() {
            Ok(device) => device,
            Err(error) => {
                assert!(std::env::var("BUMPWGPU_REQUIRE_GPU").as_deref() != Ok("1"), "{error}");
                return;
            }
        };
        assert!(Arc::ptr_eq(&first, &device().unwrap()));
        first.device.destroy();
        let result = first.buffer_with("test", &[0; 16], wgpu::BufferUsages::UNIFORM);
        assert!(matches!(result, Err(RenderError::DeviceLost(_) | RenderError::Device { .. })), "{result:?}");
        let _ = first.wait("test");
        let second = device().unwrap();
        assert!(!Arc::ptr_eq(&first, &second), "the lost device was handed out again");
        assert!(second.buffer_with("test", &[0; 16], wgpu::BufferUsages::UNIFORM).is_ok());
    }

    #[test]
    fn complaints_become_errors_inside_and_outside_of_a_guard() {
        let Ok(device) = Device::open(&DeviceOptions::default()) else { return };
        let nonsense = || {
            device.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: None,
                source: wgpu::ShaderSource::Wgsl("fn f() -> f32 { return 1u; }".into()),
            })
        };
        let inside = device.guard("testing", || {
            nonsense();
            Ok(())
        });
        assert!(matches!(inside, Err(RenderError::Device { during: "testing", .. })), "{inside:?}");
        // Outside of a guard wgpu would panic; here the next guard reports it.
        nonsense();
        assert!(device.guard("testing", || Ok(())).is_err());
        assert!(device.guard("testing", || Ok(())).is_ok());
    }
}
