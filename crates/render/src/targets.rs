//! The textures that a rendering draws into, and the way back from them.

use crate::readback::Readback;
use crate::{AovSet, Device, RenderError};

/// Format of the depth buffer, reversed: 1 near, 0 at infinity.
pub(crate) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Formats of the fragment outputs of `shaders_wgsl/lib/targets.wgsl`.
pub(crate) const TARGET_FORMATS: [wgpu::TextureFormat; 7] = [
    wgpu::TextureFormat::Rgba8UnormSrgb,
    wgpu::TextureFormat::R32Uint,
    wgpu::TextureFormat::Rgba32Float,
    wgpu::TextureFormat::Rgba32Float,
    wgpu::TextureFormat::Rgba32Float,
    wgpu::TextureFormat::Rgba32Float,
    wgpu::TextureFormat::Rgba32Float,
];

/// Places in [`TARGET_FORMATS`].
pub(crate) const COLOR: usize = 0;
pub(crate) const TRACE: usize = 1;
pub(crate) const PLACE: usize = 2;
pub(crate) const POSITION: usize = 3;
pub(crate) const NORMAL: usize = 4;
pub(crate) const RAY_START: usize = 5;
pub(crate) const RAY_DELTA: usize = 6;

/// Which targets are drawn into.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct TargetSet(u8);

impl TargetSet {
    /// The targets that hold the wanted outputs; colour and trace always.
    pub fn of(aovs: AovSet) -> Self {
        let mut set = (1 << COLOR) | (1 << TRACE);
        for (target, holds) in [
            (PLACE, AovSet::UV | AovSet::DEPTH | AovSet::HEIGHT),
            (POSITION, AovSet::POSITION | AovSet::SHADOW),
            (NORMAL, AovSet::NORMAL),
            (RAY_START, AovSet::RAY_START),
            (RAY_DELTA, AovSet::RAY_DELTA),
        ] {
            if aovs.intersects(holds) {
                set |= 1 << target;
            }
        }
        Self(set)
    }

    /// No targets, for compute programs.
    pub fn none() -> Self {
        Self(0)
    }

    /// Whether target `at` is drawn into.
    pub fn has(self, at: usize) -> bool {
        self.0 & (1 << at) != 0
    }
}

/// Textures of one band of the picture.
pub(crate) struct Targets {
    width: u32,
    views: [Option<wgpu::TextureView>; 7],
    textures: [Option<wgpu::Texture>; 7],
    depth: wgpu::TextureView,
}

/// Bytes of a row of a target, and as copies to buffers lay it out.
pub(crate) fn row_bytes(width: u32, at: usize) -> (u32, u32) {
    let tight = width * TARGET_FORMATS[at].block_copy_size(None).unwrap_or(16);
    (tight, tight.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT))
}

impl Targets {
    /// Makes textures of `width` x `rows` pixels.
    pub fn new(device: &Device, set: TargetSet, width: u32, rows: u32) -> Result<Self, RenderError> {
        let limits = device.device.limits();
        let side = u64::from(limits.max_texture_dimension_2d);
        Device::check("picture width, in pixels,", u64::from(width), side)?;
        Device::check("picture height, in pixels,", u64::from(rows), side)?;
        let bytes: u32 = (0..7)
            .filter(|&at| set.has(at))
            .map(|at| TARGET_FORMATS[at].block_copy_size(None).unwrap_or(16).max(8))
            .sum();
        Device::check(
            "size of all outputs, in bytes a pixel,",
            u64::from(bytes),
            u64::from(limits.max_color_attachment_bytes_per_sample),
        )?;
        Device::check("number of outputs", 7, u64::from(limits.max_color_attachments))?;

        let texture = |format, usage| {
            device.guard("making a picture", || {
                Ok(device.device.create_texture(&wgpu::TextureDescriptor {
                    label: Some("target"),
                    size: wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 },
                    mip_level_count: 1,
                    sample_count: 1,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                    view_formats: &[],
                }))
            })
        };
        let depth = texture(DEPTH_FORMAT, wgpu::TextureUsages::empty())?.create_view(&Default::default());
        let mut targets = Self { width, views: Default::default(), textures: Default::default(), depth };
        for at in (0..7).filter(|&at| set.has(at)) {
            let made = texture(TARGET_FORMATS[at], wgpu::TextureUsages::COPY_SRC)?;
            targets.views[at] = Some(made.create_view(&Default::default()));
            targets.textures[at] = Some(made);
        }
        Ok(targets)
    }

    /// Attachments that start out as `background` and nothing.
    pub fn color_attachments(
        &self,
        background: [f32; 4],
    ) -> Vec<Option<wgpu::RenderPassColorAttachment<'_>>> {
        let [r, g, b, a] = background.map(f64::from);
        let attach = |at: usize, view| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(if at == COLOR {
                    wgpu::Color { r, g, b, a }
                } else {
                    wgpu::Color::TRANSPARENT
                }),
                store: wgpu::StoreOp::Store,
            },
        };
        self.views.iter().enumerate().map(|(at, view)| view.as_ref().map(|view| attach(at, view))).collect()
    }

    /// The depth attachment.
    pub fn depth_attachment(&self) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }
    }

    /// Copies the first `rows` rows of each target to its buffer.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, rows: u32, to: &Readback) {
        for (at, pair) in self.textures.iter().zip(&to.buffers).enumerate() {
            if let (Some(texture), Some(buffer)) = pair {
                encoder.copy_texture_to_buffer(
                    texture.as_image_copy(),
                    wgpu::TexelCopyBufferInfo {
                        buffer,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 0,
                            bytes_per_row: Some(row_bytes(self.width, at).1),
                            rows_per_image: None,
                        },
                    },
                    wgpu::Extent3d { width: self.width, height: rows, depth_or_array_layers: 1 },
                );
            }
        }
    }
}
