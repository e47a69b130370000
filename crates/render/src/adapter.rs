//! Which Vulkan devices there are, and which one is taken.

use crate::RenderError;

/// Environment variable with a part of the name of the device to use.
pub const ADAPTER_VARIABLE: &str = "BUMPWGPU_ADAPTER";

/// A Vulkan device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterInfo {
    /// Name of the device.
    pub name: String,
    /// Name of its driver.
    pub driver: String,
    /// Version of its driver.
    pub driver_info: String,
    /// `"discrete"`, `"integrated"`, `"virtual"`, `"software"` or `"other"`.
    pub kind: &'static str,
}

impl From<wgpu::AdapterInfo> for AdapterInfo {
    fn from(info: wgpu::AdapterInfo) -> Self {
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        };
        Self { name: info.name, driver: info.driver, driver_info: info.driver_info, kind }
    }
}

/// All Vulkan devices of this machine, the preferred one first. Opens none of them.
pub fn adapters() -> Vec<AdapterInfo> {
    sorted().iter().map(|adapter| adapter.get_info().into()).collect()
}

/// The device whose name contains `wanted`, case aside, or the preferred one.
pub(crate) fn choose(wanted: Option<&str>) -> Result<wgpu::Adapter, RenderError> {
    let adapters = sorted();
    if adapters.is_empty() {
        return Err(RenderError::NoDevice);
    }
    let wanted_lower = wanted.unwrap_or_default().to_lowercase();
    let found: Vec<String> = adapters.iter().map(|adapter| adapter.get_info().name).collect();
    adapters
        .into_iter()
        .find(|adapter| adapter.get_info().name.to_lowercase().contains(&wanted_lower))
        .ok_or_else(|| RenderError::NoSuchAdapter {
            wanted: wanted.unwrap_or_default().to_owned(),
            found: found.join(", "),
        })
}

fn sorted() -> Vec<wgpu::Adapter> {
    // Vulkan only: Mesa's software device answers through OpenGL as well, with fewer features.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: wgpu::Backends::VULKAN,
        flags: wgpu::InstanceFlags::empty(),
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    let mut adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    adapters.sort_by_key(|adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    adapters
}
