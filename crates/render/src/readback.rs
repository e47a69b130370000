//! The way back of a picture: buffers that the targets are copied into, one set for each picture under way.

use crate::targets::{TARGET_FORMATS, TargetSet, row_bytes};
use crate::timer::Timer;
use crate::{Device, RenderError};

/// Buffers of one band of a picture, and the clock that times it.
pub(crate) struct Readback {
    width: u32,
    pub buffers: [Option<wgpu::Buffer>; TARGET_FORMATS.len()],
    pub timer: Option<Timer>,
}

impl Readback {
    /// Room for `width` x `rows` pixels of some targets.
    pub fn new(device: &Device, set: TargetSet, width: u32, rows: u32) -> Result<Self, RenderError> {
        let mut made = Self { width, buffers: Default::default(), timer: Timer::new(device)? };
        for at in (0..TARGET_FORMATS.len()).filter(|&at| set.has(at)) {
            let size = u64::from(row_bytes(width, at).1) * u64::from(rows);
            let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
            made.buffers[at] = Some(device.buffer("readback", size, usage)?);
        }
        Ok(made)
    }

    fn bytes(&self, at: usize, rows: u32) -> u64 {
        u64::from(row_bytes(self.width, at).1) * u64::from(rows)
    }

    /// Asks for `rows` rows, and for the time, when the device is done with them.
    pub fn map(&self, rows: u32) {
        if let Some(timer) = &self.timer {
            timer.map();
        }
        for (at, buffer) in self.buffers.iter().enumerate() {
            if let Some(buffer) = buffer {
                buffer.slice(..self.bytes(at, rows)).map_async(wgpu::MapMode::Read, |_| ());
            }
        }
    }

    /// Hands the rows of each target to `take(target, row, bytes)`, once they are mapped.
    pub fn read(&self, rows: u32, mut take: impl FnMut(usize, u32, &[u8])) -> Result<(), RenderError> {
        for (at, buffer) in self.buffers.iter().enumerate() {
            let Some(buffer) = buffer else { continue };
            let (tight, padded) = row_bytes(self.width, at);
            let mapped = buffer.slice(..self.bytes(at, rows)).get_mapped_range().map_err(|error| {
                RenderError::Device { during: "reading the picture back", message: error.to_string() }
            })?;
            for (row, bytes) in mapped.chunks_exact(padded as usize).enumerate() {
                take(at, row as u32, &bytes[..tight as usize]);
            }
            drop(mapped);
            buffer.unmap();
        }
        Ok(())
    }
}
