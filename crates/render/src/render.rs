//! One picture: validate, prepare, draw band by band, read back.

use std::time::Instant;

use bytemuck::Zeroable;
use glam::Vec4;

use crate::heights::bind;
use crate::pipeline::Pipeline;
use crate::prepare::{self, Prepared};
use crate::targets::{TargetSet, Targets};
use crate::timer::Timer;
use crate::uniforms::FrameInfo;
use crate::unpack::Unpacker;
use crate::{Device, Frame, RenderError, Request, Scene, Stats};

/// Pixels drawn at once. Larger pictures are drawn in bands of rows, so that the memory that the
/// targets take does not grow with the picture.
const BAND_PIXELS: u64 = 1 << 22;

/// Renders a scene.
///
/// # Errors
/// [`RenderError`]: senseless scenes name the draw or light, device faults say what was going on.
pub fn render(device: &Device, scene: &Scene<'_>, request: &Request) -> Result<Frame, RenderError> {
    render_in_bands(device, scene, request, BAND_PIXELS)
}

/// [`render`] with at most `band_pixels` pixels, but at least one row, at a time.
///
/// # Errors
/// As [`render`].
pub fn render_in_bands(
    device: &Device,
    scene: &Scene<'_>,
    request: &Request,
    band_pixels: u64,
) -> Result<Frame, RenderError> {
    let start = Instant::now();
    let (width, height) = (request.width, request.height);
    if width == 0 || height == 0 {
        return Err(RenderError::Size { width, height });
    }
    let longest = u64::from(device.device.limits().max_texture_dimension_2d);
    Device::check("picture width, in pixels,", u64::from(width), longest)?;
    Device::check("picture height, in pixels,", u64::from(height), longest)?;
    scene.validate()?;
    let mut warnings = warnings(scene, request);
    let shadows = request.shadows.unwrap_or(true) && request.technique.casts_shadows();
    let mut stats = Stats::default();

    let draws = prepare::draws(device, scene, request, shadows, &mut stats, &mut warnings)?;
    let rows_at_once = (band_pixels / u64::from(width)).clamp(1, u64::from(height)) as u32;
    let targets = Targets::new(device, TargetSet::of(request.aovs), width, rows_at_once)?;
    let timer = Timer::new(device)?;
    let frame = FrameBinding::new(device, scene)?;
    let mut unpacker = Unpacker::new(request, scene.camera.eye)?;
    stats.prepare_ms = start.elapsed().as_secs_f64() * 1e3 - stats.compile_ms;

    for first_row in (0..height).step_by(rows_at_once as usize) {
        let rows = rows_at_once.min(height - first_row);
        let before = Instant::now();
        let drawn = device.guard("drawing", || {
            frame.write(device, scene, request, first_row, rows_at_once);
            let mut encoder =
                device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            draw_band(&mut encoder, scene, &draws, &targets, &frame, timer.as_ref());
            if let Some(timer) = &timer {
                timer.resolve(&mut encoder);
            }
            device.queue.submit([encoder.finish()]);
            device.wait("drawing")?;
            match &timer {
                Some(timer) => timer.read_ms(device),
                None => Ok(before.elapsed().as_secs_f64() * 1e3),
            }
        })?;
        stats.draw_ms += drawn;

        let before = Instant::now();
        device.guard("reading the picture back", || {
            let mut encoder =
                device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            targets.copy(&mut encoder, rows);
            device.queue.submit([encoder.finish()]);
            targets.read(device, rows, |target, row, bytes| unpacker.row(target, first_row + row, bytes))
        })?;
        stats.readback_ms += before.elapsed().as_secs_f64() * 1e3;
    }
    stats.device_clock = timer.is_some();
    let mut frame = unpacker.finish(&mut stats);
    stats.total_ms = start.elapsed().as_secs_f64() * 1e3;
    frame.stats = stats;
    frame.warnings = warnings;
    Ok(frame)
}

/// Settings that cannot take effect.
fn warnings(scene: &Scene<'_>, request: &Request) -> Vec<String> {
    let mut warnings = Vec::new();
    let name = request.technique.name();
    if request.horizon.is_some() && request.in_shell() {
        warnings.push("silhouettes=True casts its own shadows; horizon shadows have no effect".to_owned());
    } else if request.horizon.is_some() && !request.technique.takes_horizon() {
        warnings.push(format!("technique {name:?} takes no horizon map; horizon shadows have no effect"));
    } else if request.shadows == Some(true) && request.horizon.is_none() && !request.technique.casts_shadows()
    {
        warnings.push(format!("technique {name:?} casts no shadows; shadows=True has no effect"));
    }
    if request.silhouettes && !request.technique.has_silhouettes() && !request.technique.draws_geometry() {
        warnings.push(format!(
            "technique {name:?} has no true outlines, only \"exact\" has; silhouettes=True has no effect"
        ));
    }
    if request.technique.name() == "dot3" {
        if scene.lights.len() > 1 {
            warnings.push(format!("dot3 knows one light; the first of {} is used", scene.lights.len()));
        }
        if scene.draws.iter().any(|draw| draw.material.specular > 0.0) {
            warnings.push("dot3 is diffuse only; specular has no effect".to_owned());
        }
    }
    warnings
}

fn draw_band(
    encoder: &mut wgpu::CommandEncoder,
    scene: &Scene<'_>,
    draws: &[Prepared],
    targets: &Targets,
    frame: &FrameBinding,
    timer: Option<&Timer>,
) {
    let attachments = targets.color_attachments(scene.background);
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("surfaces"),
        color_attachments: &attachments,
        depth_stencil_attachment: Some(targets.depth_attachment()),
        timestamp_writes: timer.map(Timer::render_writes),
        occlusion_query_set: None,
        multiview_mask: None,
    });
    for draw in draws {
        let Pipeline::Render(pipeline) = &*draw.pipeline else { continue };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &frame.group, &[]);
        if let Some(field) = &draw.field {
            pass.set_bind_group(1, field, &[]);
        }
        pass.set_bind_group(2, &draw.material, &[]);
        pass.set_bind_group(3, &draw.draw, &[]);
        for (slot, &location) in draw.locations.iter().enumerate() {
            if let Some(buffer) = &draw.geometry.attributes[location] {
                pass.set_vertex_buffer(slot as u32, buffer.slice(..));
            }
        }
        pass.set_index_buffer(draw.geometry.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(3 * draw.triangles.start..3 * draw.triangles.end, 0, 0..1);
    }
}

/// Group 0.
struct FrameBinding {
    info: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl FrameBinding {
    fn new(device: &Device, scene: &Scene<'_>) -> Result<Self, RenderError> {
        let blank = FrameInfo::zeroed();
        let info = device.buffer_with("frame", bytemuck::bytes_of(&blank), wgpu::BufferUsages::UNIFORM)?;
        let lights = prepare::light_infos(scene);
        let lights =
            device.buffer_with("lights", bytemuck::cast_slice(&lights), wgpu::BufferUsages::STORAGE)?;
        let group = device.guard("binding the frame", || {
            Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout: &device.layouts.frame,
                entries: &[bind(0, info.as_entire_binding()), bind(1, lights.as_entire_binding())],
            }))
        })?;
        Ok(Self { info, group })
    }

    fn write(&self, device: &Device, scene: &Scene<'_>, request: &Request, first_row: u32, rows: u32) {
        let camera = &scene.camera;
        let [r, g, b] = scene.ambient;
        let size = [request.width, request.height];
        let directions = camera.pixel_directions(size, first_row);
        let [corner, pixel_right, pixel_down] = directions.map(|direction| direction.extend(0.0).as_vec4());
        let info = FrameInfo {
            clip_from_relative: camera.clip_from_relative(size, first_row, rows).as_mat4(),
            corner,
            pixel_right,
            pixel_down,
            forward: camera.forward().extend(camera.near()).as_vec4(),
            ambient: Vec4::new(r, g, b, 0.0),
            light_count: scene.lights.len() as u32,
            ..FrameInfo::zeroed()
        };
        device.queue.write_buffer(&self.info, 0, bytemuck::bytes_of(&info));
    }
}
