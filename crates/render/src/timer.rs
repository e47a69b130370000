//! Time on the device's own clock, or on this process' where the device is software.

use std::time::Instant;

use crate::{Device, RenderError};

/// The host's time for a submission, where the device has no clock of its own.
///
/// Software devices run on threads of this process, so theirs is its processor time, all threads together: other
/// programs, which take cores away for a while, and the number of cores do not count.
pub(crate) struct Stopwatch {
    start: Instant,
    worked: Option<f64>,
}

impl Stopwatch {
    /// Begins now. Nothing else should be at work in this process until the end.
    pub fn start(device: &Device) -> Self {
        let worked = (device.info().kind == "software").then(processor_seconds).flatten();
        Self { start: Instant::now(), worked }
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        match (self.worked, processor_seconds()) {
            (Some(before), Some(now)) => now - before,
            _ => self.start.elapsed().as_secs_f64(),
        }
    }
}

/// Processor time of this process so far, where the system tells.
fn processor_seconds() -> Option<f64> {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64)
    }
    #[cfg(not(unix))]
    None
}

/// Two timestamps around a pass.
pub(crate) struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readback: wgpu::Buffer,
}

impl Timer {
    /// A timer, or `None` where the device has no clock.
    pub fn new(device: &Device) -> Result<Option<Self>, RenderError> {
        if !device.timestamps {
            return Ok(None);
        }
        let resolved = wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC;
        let readback = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let queries = device.guard("making a timer", || {
            Ok(device.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timer"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }))
        })?;
        Ok(Some(Self {
            queries,
            resolved: device.buffer("timer", 16, resolved)?,
            readback: device.buffer("timer readback", 16, readback)?,
        }))
    }

    /// For a render pass.
    pub fn render_writes(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// For a compute pass.
    pub fn compute_writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// After the pass.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readback, 0, 16);
    }

    /// Asks for the timestamps once what resolves them is submitted.
    pub fn map(&self) {
        self.readback.slice(..).map_async(wgpu::MapMode::Read, |_| ());
    }

    /// Milliseconds between the two timestamps, which have been asked for, once the device is done.
    pub fn read_ms(&self, device: &Device) -> Result<f64, RenderError> {
        let fail = |message: String| RenderError::Device { during: "reading a timer", message };
        let mapped = self.readback.slice(..).get_mapped_range().map_err(|error| fail(error.to_string()))?;
        let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| mapped[at + i]));
        let ticks = word(8).saturating_sub(word(0));
        drop(mapped);
        self.readback.unmap();
        Ok(ticks as f64 * f64::from(device.queue.get_timestamp_period()) * 1e-6)
    }
}
