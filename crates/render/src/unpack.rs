//! From rows of the targets to the frame's arrays and counts.

use glam::{DVec3, Vec3};

use crate::targets::{COLOR, NORMAL, PLACE, POSITION, RAY_DELTA, RAY_START, TRACE};
use crate::{AovSet, Aovs, Frame, RenderError, Request, Skips, Stats};

/// Collects rows. The twin of `pack_trace` in `shaders_wgsl/lib/targets.wgsl`.
pub(crate) struct Unpacker {
    width: usize,
    height: usize,
    eye: DVec3,
    /// Lights, as far as the trace counts.
    lights: u32,
    color: Vec<u8>,
    trace: Vec<u32>,
    aovs: Aovs,
    wanted: AovSet,
}

const COVERED: u32 = 1 << 31;
const MARCHED: u32 = 1 << 30;
const RANGE: u32 = 1 << 19;
const SHADOWED: u32 = 1 << 18;
/// Most shadow rays that the trace counts.
const MOST_RAYS: usize = 255;
/// Kinds that are counted by the pixel; shadow rays are counted one by one.
const COUNTED: [Skips; 3] = [Skips::FLAT, Skips::PARALLAX, Skips::RANGE];
/// Pixels whose counts fit into 32 bits whatever they are: steps have 18.
const COUNTED_AT_ONCE: usize = 1 << 12;

fn status(trace: u32) -> u32 {
    (trace >> 28) & 3
}

fn shadow_rays(trace: u32) -> u32 {
    (trace >> 20) & 0xff
}

fn steps(trace: u32) -> u32 {
    trace & 0x3_ffff
}

impl Unpacker {
    pub fn new(request: &Request, eye: DVec3, lights: usize) -> Result<Self, RenderError> {
        let (width, height) = (request.width as usize, request.height as usize);
        let pixels = width * height;
        let wanted = request.aovs;
        let floats = |aov, channels: usize| -> Result<Option<Vec<f32>>, RenderError> {
            if !wanted.contains(aov) {
                return Ok(None);
            }
            Ok(Some(zeros(pixels * channels)?))
        };
        let aovs = Aovs {
            uv: floats(AovSet::UV, 2)?,
            depth: floats(AovSet::DEPTH, 1)?,
            position: floats(AovSet::POSITION, 3)?,
            normal: floats(AovSet::NORMAL, 3)?,
            height: floats(AovSet::HEIGHT, 1)?,
            shadow: floats(AovSet::SHADOW, 1)?,
            ray_start: floats(AovSet::RAY_START, 3)?,
            ray_delta: floats(AovSet::RAY_DELTA, 3)?,
            steps: None,
            mask: None,
            skip: None,
        };
        Ok(Self {
            width,
            height,
            eye,
            lights: lights.min(MOST_RAYS) as u32,
            color: zeros(4 * pixels)?,
            trace: zeros(pixels)?,
            aovs,
            wanted,
        })
    }

    /// Takes one row of a target. The trace of a row comes before its other outputs.
    pub fn row(&mut self, target: usize, row: u32, bytes: &[u8]) {
        let from = row as usize * self.width;
        let pixels = from..from + self.width;
        match target {
            COLOR => self.color[4 * from..4 * pixels.end].copy_from_slice(bytes),
            TRACE => {
                for (out, word) in self.trace[pixels].iter_mut().zip(bytes.as_chunks::<4>().0) {
                    *out = u32::from_le_bytes(*word);
                }
            }
            _ => {
                for (at, texel) in pixels.zip(bytes.as_chunks::<16>().0) {
                    let texel: [f32; 4] = bytemuck::cast(*texel);
                    self.texel(target, at, texel);
                }
            }
        }
    }

    fn texel(&mut self, target: usize, at: usize, texel: [f32; 4]) {
        let covered = self.trace[at] & COVERED != 0;
        let [x, y, z, w] = texel;
        match target {
            PLACE => {
                write(&mut self.aovs.uv, at, [x, y]);
                write(&mut self.aovs.depth, at, [if covered { z } else { f32::INFINITY }]);
                write(&mut self.aovs.height, at, [w]);
            }
            POSITION => {
                let world = (self.eye + Vec3::new(x, y, z).as_dvec3()).as_vec3();
                write(&mut self.aovs.position, at, if covered { world.to_array() } else { [0.0; 3] });
                write(&mut self.aovs.shadow, at, [w]);
            }
            NORMAL => write(&mut self.aovs.normal, at, [x, y, z]),
            RAY_START => write(&mut self.aovs.ray_start, at, [x, y, z]),
            RAY_DELTA => write(&mut self.aovs.ray_delta, at, [x, y, z]),
            _ => (),
        }
    }

    /// What was left out of a pixel: [`Skips::bits`], and how many shadow rays. Without branches, which the processor
    /// would mispredict at every border.
    fn left_out(&self, trace: u32) -> (u32, u32) {
        let flag = |set: bool, kind: Skips| u32::from(set) * kind.bits();
        let (marched, why) = (trace & MARCHED != 0, status(trace));
        let cast = u32::from(trace & SHADOWED != 0);
        let rays = cast * self.lights.saturating_sub(shadow_rays(trace));
        let bits = flag(!marched & (why == 1), Skips::FLAT)
            | flag(!marched & (why > 1), Skips::PARALLAX)
            | flag(marched & (trace & RANGE != 0), Skips::RANGE)
            | flag(rays > 0, Skips::SHADOW);
        (bits, rays)
    }

    /// Adds the counts of all pixels.
    fn count(&self, stats: &mut Stats) {
        for part in self.trace.chunks(COUNTED_AT_ONCE) {
            let [mut covered, mut marched, mut unconverged, mut walked, mut cast, mut spared] = [0_u32; 6];
            let mut kinds = [0_u32; 3];
            for &trace in part {
                let was_marched = trace & MARCHED != 0;
                covered += u32::from(trace & COVERED != 0);
                marched += u32::from(was_marched);
                unconverged += u32::from(was_marched & (status(trace) == 2));
                walked += steps(trace);
                cast += shadow_rays(trace);
                let (bits, rays) = self.left_out(trace);
                spared += rays;
                for (count, kind) in kinds.iter_mut().zip(COUNTED) {
                    *count += u32::from(bits & kind.bits() != 0);
                }
            }
            stats.pixels_covered += u64::from(covered);
            stats.pixels_marched += u64::from(marched);
            stats.pixels_unconverged += u64::from(unconverged);
            stats.steps += u64::from(walked);
            stats.shadow_rays += u64::from(cast);
            stats.skipped.add(Skips::SHADOW, u64::from(spared));
            for (count, kind) in kinds.into_iter().zip(COUNTED) {
                stats.skipped.add(kind, u64::from(count));
            }
        }
    }

    /// The frame, and the counts of its pixels.
    pub fn finish(mut self, stats: &mut Stats) -> Frame {
        self.count(stats);
        if self.wanted.contains(AovSet::MASK) {
            self.aovs.mask = Some(self.trace.iter().map(|trace| u8::from(trace & COVERED != 0)).collect());
        }
        if self.wanted.contains(AovSet::SKIP) {
            let code = |&trace: &u32| {
                let (bits, rays) = self.left_out(trace);
                let on_mesh = trace & MARCHED == 0 && status(trace) == 3;
                bits | (u32::from(on_mesh) * Skips::ON_MESH) | (rays << Skips::RAYS_FROM_BIT)
            };
            self.aovs.skip = Some(self.trace.iter().map(code).collect());
        }
        if self.wanted.contains(AovSet::STEPS) {
            self.aovs.steps = Some(self.trace.iter().map(|&trace| steps(trace)).collect());
        }
        Frame {
            width: self.width as u32,
            height: self.height as u32,
            color: self.color,
            aovs: self.aovs,
            stats: Stats::default(),
            warnings: Vec::new(),
        }
    }
}

fn write<const N: usize>(out: &mut Option<Vec<f32>>, at: usize, values: [f32; N]) {
    if let Some(out) = out {
        out[N * at..N * (at + 1)].copy_from_slice(&values);
    }
}

/// Zeros, or an error where the machine has no memory for them.
fn zeros<T: Clone + Default>(length: usize) -> Result<Vec<T>, RenderError> {
    let mut values = Vec::new();
    values.try_reserve_exact(length).map_err(|_| RenderError::OutOfMemory("making room for the picture"))?;
    values.resize(length, T::default());
    Ok(values)
}
