//! Rays in texture space on the device: the parity tests, the benches and `march(device="gpu")`.

use bytemuck::Zeroable;
use heightfield::march::{period, texture_space_normal, validate};
use heightfield::technique::Reads;
use heightfield::{HeightField, Hits, RayArray, Segment, Status, Technique};
use rayon::prelude::*;

use crate::heights::bind;
use crate::layouts::MaterialMaps;
use crate::pipeline::{Pipeline, PipelineKey, constants_of};
use crate::request::Program;
use crate::targets::TargetSet;
use crate::timer::{Stopwatch, Timer};
use crate::uniforms::{MarchResult, MarchSegment};
use crate::{Device, RenderError};

/// Rays of one dispatch, at most; also bounded by the device's buffers.
const MOST_RAYS: u64 = 1 << 21;
const WORKGROUP: u32 = 64;

/// Hits of many rays, and the seconds that the device took for them.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceHits {
    /// All results, as `heightfield::march` returns them.
    pub hits: Hits,
    /// Time on the device's clock, or of the submissions where it has none: for a software device processor
    /// time, all threads together. Some drivers compile a program when it first runs, so the first call with a
    /// technique may take longer.
    pub device_seconds: f64,
}

/// What to ask of the kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Question {
    /// Where the ray first meets the surface.
    Hit,
    /// Whether anything blocks a ray that starts on the surface.
    Blocked,
}

/// The device's answer to [`heightfield::march()`], all outputs.
///
/// Rays are `origin + t * direction` in texture space, N * 3 numbers each. They are clipped to the slab
/// of the relief in `f64` before they reach the device.
///
/// # Errors
/// [`RenderError::HeightField`] for senseless rays, else what the device complains about.
pub fn march(
    device: &Device,
    field: &HeightField,
    technique: &Technique,
    origins: &[f32],
    directions: &[f32],
) -> Result<DeviceHits, RenderError> {
    let (origins, directions) = (RayArray::F32(origins), RayArray::F32(directions));
    validate(origins, directions)?;
    let (clips, results, device_seconds) = run(device, field, technique, origins, directions, Question::Hit)?;
    let n = origins.len();
    let mut t = vec![f32::INFINITY; n];
    let mut uv = vec![f32::NAN; 2 * n];
    let mut z = vec![f32::NAN; n];
    let mut normal = vec![f32::NAN; 3 * n];
    let mut steps = vec![0; n];
    let mut status = vec![Status::Left as u8; n];
    t.par_iter_mut()
        .zip(uv.par_chunks_exact_mut(2))
        .zip(&mut z)
        .zip(normal.par_chunks_exact_mut(3))
        .zip(&mut steps)
        .zip(&mut status)
        .enumerate()
        .for_each(|(i, (((((t, uv), z), normal), steps), status))| {
            let Some(segment) = &clips[i] else { return };
            let result = results[i];
            *steps = result.steps;
            // Only the exact search goes on beyond the segment of a level ray, which has no end.
            let ends = segment.closed || technique.info.reads == Reads::Pyramid;
            let open = result.status == Status::Left as u32 && !ends;
            *status = if open { Status::Unconverged as u8 } else { result.status as u8 };
            if result.status != Status::Hit as u32 {
                return;
            }
            let (o, d) = (origins.get(i), directions.get(i));
            let along = segment.t_start + f64::from(result.tau) * segment.t_length;
            let at: [f64; 3] = std::array::from_fn(|axis| o[axis] + along * d[axis]);
            *t = along as f32;
            uv.copy_from_slice(&[at[0] as f32, at[1] as f32]);
            *z = at[2] as f32;
            normal.copy_from_slice(&texture_space_normal(field.gradient_at(at[0], at[1])));
        });
    let hits = Hits {
        t: Some(t),
        uv: Some(uv),
        z: Some(z),
        normal: Some(normal),
        steps: Some(steps),
        status: Some(status),
    };
    Ok(DeviceHits { hits, device_seconds })
}

/// Whether anything blocks each ray from a point on the surface, as the technique sees it.
///
/// # Errors
/// As [`march`].
pub fn occluded(
    device: &Device,
    field: &HeightField,
    technique: &Technique,
    origins: &[f32],
    directions: &[f32],
) -> Result<Vec<bool>, RenderError> {
    let (origins, directions) = (RayArray::F32(origins), RayArray::F32(directions));
    validate(origins, directions)?;
    let (clips, results, _) = run(device, field, technique, origins, directions, Question::Blocked)?;
    Ok(clips
        .iter()
        .zip(&results)
        .map(|(clip, result)| clip.is_some() && result.status == Status::Hit as u32)
        .collect())
}

type Answers = (Vec<Option<Segment>>, Vec<MarchResult>, f64);

fn run(
    device: &Device,
    field: &HeightField,
    technique: &Technique,
    origins: RayArray<'_>,
    directions: RayArray<'_>,
    question: Question,
) -> Result<Answers, RenderError> {
    let tiles = period(field.wrap());
    let clips: Vec<Option<Segment>> = (0..origins.len())
        .into_par_iter()
        .map(|i| {
            let direction = directions.get(i);
            Segment::clip(origins.get(i), direction, field.extent().cos_theta(direction), tiles)
        })
        .collect();
    let mut results = Vec::with_capacity(clips.len());
    let mut seconds = 0.0;
    if clips.is_empty() {
        return Ok((clips, results, seconds));
    }
    let reads = technique.info.reads;
    let group = device.make_field_group(field, reads)?;
    let mut constants = constants_of(technique, field);
    constants.push(("shadow_rays", i64::from(question == Question::Blocked)));
    let pipeline = device.pipeline(PipelineKey {
        program: Program {
            entry: "kernels/march",
            search: Some(technique.info.name),
            surface: "",
            maps: MaterialMaps::None,
            horizon: false,
        },
        reads: Some(reads),
        constants,
        targets: TargetSet::none(),
        apart: false,
        double_sided: false,
        mirrored: false,
    })?;
    let limits = device.device.limits();
    let bytes = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size);
    let fits = bytes / size_of::<MarchSegment>() as u64;
    let at_once = fits
        .min(MOST_RAYS)
        .min(u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(WORKGROUP));
    for chunk in clips.chunks(at_once.max(1) as usize) {
        let (part, took) = dispatch(device, &pipeline, &group, chunk)?;
        results.extend(part);
        seconds += took;
    }
    Ok((clips, results, seconds))
}

fn dispatch(
    device: &Device,
    pipeline: &Pipeline,
    field: &wgpu::BindGroup,
    clips: &[Option<Segment>],
) -> Result<(Vec<MarchResult>, f64), RenderError> {
    let segments: Vec<MarchSegment> = clips
        .par_iter()
        .map(|clip| match clip {
            Some(segment) => MarchSegment {
                start: segment.start.to_array(),
                cos_theta: segment.cos_theta,
                delta: segment.delta.to_array(),
                stretch: [0.0, 1.0],
                ..MarchSegment::zeroed()
            },
            // A ray that stays above the lid: straight down, and its answer is not looked at.
            None => MarchSegment {
                start: [0.0, 0.0, 1.0],
                cos_theta: 1.0,
                delta: [0.0, 0.0, -1.0],
                stretch: [0.0, 1.0],
                ..MarchSegment::zeroed()
            },
        })
        .collect();
    let storage = wgpu::BufferUsages::STORAGE;
    let bytes = size_of_val(&segments[..]) as u64;
    let result_bytes = (segments.len() * size_of::<MarchResult>()) as u64;
    let input = device.buffer_with("segments", bytemuck::cast_slice(&segments), storage)?;
    let output = device.buffer("results", result_bytes, storage | wgpu::BufferUsages::COPY_SRC)?;
    let readback_usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let readback = device.buffer("results readback", result_bytes, readback_usage)?;
    debug_assert_eq!(bytes, input.size());
    let timer = Timer::new(device)?;
    device.guard("marching", || {
        let group = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("march"),
            layout: &device.layouts.march,
            entries: &[bind(0, input.as_entire_binding()), bind(1, output.as_entire_binding())],
        });
        // The upload is not part of the time.
        device.queue.submit([]);
        device.wait("marching")?;
        let stopwatch = Stopwatch::start(device);
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("march"),
                timestamp_writes: timer.as_ref().map(Timer::compute_writes),
            });
            if let Pipeline::Compute(pipeline) = pipeline {
                pass.set_pipeline(pipeline);
            }
            pass.set_bind_group(0, &group, &[]);
            pass.set_bind_group(1, field, &[]);
            pass.dispatch_workgroups((segments.len() as u32).div_ceil(WORKGROUP), 1, 1);
        }
        if let Some(timer) = &timer {
            timer.resolve(&mut encoder);
        }
        device.queue.submit([encoder.finish()]);
        if let Some(timer) = &timer {
            timer.map();
        }
        device.wait("marching")?;
        let seconds = match &timer {
            Some(timer) => timer.read_ms(device)? * 1e-3,
            None => stopwatch.seconds(),
        };
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&output, 0, &readback, 0, result_bytes);
        device.queue.submit([encoder.finish()]);
        readback.slice(..).map_async(wgpu::MapMode::Read, |_| ());
        device.wait("marching")?;
        let mapped = readback
            .slice(..)
            .get_mapped_range()
            .map_err(|error| RenderError::Device { during: "marching", message: error.to_string() })?;
        let results = bytemuck::pod_collect_to_vec(&mapped[..]);
        drop(mapped);
        readback.unmap();
        Ok((results, seconds))
    })
}
