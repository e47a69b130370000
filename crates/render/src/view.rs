//! What is drawn of a scene from one place, and in which order.

use std::cmp::Ordering::Equal;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;

use crate::culling::{Culling, Stand};
use crate::geometry::Geometry;
use crate::micro::{self, View};
use crate::pipeline::{Pipeline, PipelineKey};
use crate::prepare::{Cutting, Fixed, Prepared};
use crate::sparing::Leeway;
use crate::{Camera, Device, Draw, RenderError, Request, Skips, Stats};

/// One program over some triangles of a draw.
pub(crate) struct Call {
    /// The draw's place in the scene.
    pub draw: usize,
    pipeline: Arc<Pipeline>,
    geometry: Geometry,
    runs: Vec<Range<u32>>,
    /// Where the draw's place is in the buffer of places, bytes.
    offset: u32,
    /// Distances along the view axis between which the draw is.
    span: [f64; 2],
    /// Whether the draw is sorted by its mesh.
    apart: bool,
}

impl Call {
    /// Draws. Group 0 is set.
    pub fn encode(&self, pass: &mut wgpu::RenderPass<'_>, prepared: &Prepared) {
        let Pipeline::Render(pipeline) = &*self.pipeline else { return };
        pass.set_pipeline(pipeline);
        if let Some(field) = &prepared.field {
            pass.set_bind_group(1, field, &[]);
        }
        pass.set_bind_group(2, &prepared.material, &[]);
        pass.set_bind_group(3, &prepared.place, &[self.offset]);
        for (slot, (_, buffer)) in self.geometry.attributes.0.iter().enumerate() {
            pass.set_vertex_buffer(slot as u32, buffer.slice(..));
        }
        pass.set_index_buffer(self.geometry.indices.slice(..), wgpu::IndexFormat::Uint32);
        for run in &self.runs {
            pass.draw_indexed(3 * run.start..3 * run.end, 0, 0..1);
        }
    }
}

/// The draws of a view as they are collected.
pub(crate) struct ViewOf<'a> {
    device: &'a Device,
    camera: &'a Camera,
    request: &'a Request,
    culling: &'a Culling,
    calls: Vec<Call>,
}

impl<'a> ViewOf<'a> {
    pub fn new(device: &'a Device, camera: &'a Camera, request: &'a Request, culling: &'a Culling) -> Self {
        Self { device, camera, request, culling, calls: Vec::new() }
    }

    /// Adds what may be seen of a draw, and says whether there is anything.
    #[expect(clippy::too_many_arguments, reason = "all that is known of a draw comes together here")]
    pub fn add(
        &mut self,
        at: usize,
        draw: &Draw<'_>,
        middle: DVec3,
        prepared: &Prepared,
        stand: &Stand,
        leeway: &Leeway,
        offset: u32,
        stats: &mut Stats,
        warnings: &mut Vec<String>,
    ) -> Result<bool, RenderError> {
        let before = self.calls.len();
        let apart = prepared.fixed.as_ref().is_some_and(|fixed| fixed.key.apart);
        let span = self.span(stand, apart);
        if let Some(Fixed { key, spared, geometry, groups, triangles }) = &prepared.fixed {
            let runs = match groups {
                Some(groups) => {
                    let solid = self.request.is_solid(&draw.material);
                    self.culling.visible(stand, groups, solid, &mut stats.skipped)
                }
                None => std::iter::once(0..*triangles).collect(),
            };
            if !runs.is_empty() {
                let spared = spared.as_ref().filter(|_| prepared.sparing.needs_no_march(leeway));
                let key = spared.unwrap_or(key);
                let pipeline = compiled(self.device, key, stats)?;
                let geometry = geometry.clone();
                self.calls.push(Call { draw: at, pipeline, geometry, runs, offset, span, apart });
            }
        }
        if let Some(Cutting { key }) = &prepared.cutting {
            let view = View {
                camera: self.camera,
                relative_from_object: stand.relative_from_object,
                stretch: stand.stretch,
                centre: middle,
                size: [self.request.width, self.request.height],
                culled: self.request.skips.contains(Skips::FRUSTUM),
            };
            let (displaced, coarser) = micro::displaced(draw, &view)?;
            if coarser > 1.0 {
                warnings.push(format!(
                    "draw {at}: micro-polygons are up to {coarser:.1} pixels wide, to keep their number down"
                ));
            }
            if !displaced.indices.is_empty() {
                let pipeline = compiled(self.device, key, stats)?;
                let geometry = Geometry::micro(self.device, &displaced)?;
                let runs = std::iter::once(0..displaced.indices.len() as u32).collect();
                self.calls.push(Call { draw: at, pipeline, geometry, runs, offset, span, apart });
            }
        }
        let added = &self.calls[before..];
        stats.triangles_drawn +=
            added.iter().flat_map(|call| &call.runs).map(|run| u64::from(run.end - run.start)).sum::<u64>();
        Ok(!added.is_empty())
    }

    /// The calls in the order in which they are drawn.
    pub fn calls(self, stats: &mut Stats) -> Vec<Call> {
        let mut calls = self.calls;
        if self.request.skips.contains(Skips::DEPTH_FIRST) {
            let moved = if calls.iter().any(|call| call.apart) {
                apart_last(&mut calls)
            } else {
                nearest_first(&mut calls)
            };
            stats.skipped.add(Skips::DEPTH_FIRST, moved as u64);
        }
        calls
    }

    /// Distances along the view axis between which all that a draw shows is. Without bounds for what writes a depth of
    /// its own: no order saves a fragment of it.
    fn span(&self, stand: &Stand, apart: bool) -> [f64; 2] {
        let writes_depth = self.request.technique.displaces() && !self.request.technique.draws_geometry();
        if writes_depth && !apart {
            return [f64::NEG_INFINITY, f64::INFINITY];
        }
        let depth = stand.relative_from_object.w_axis.truncate().dot(self.camera.forward());
        [depth - stand.radius, depth + stand.radius]
    }
}

/// The pipeline of a key; compiled now where it is new.
fn compiled(device: &Device, key: &PipelineKey, stats: &mut Stats) -> Result<Arc<Pipeline>, RenderError> {
    let started = Instant::now();
    let pipeline = device.pipeline(key.clone());
    stats.compile_ms += started.elapsed().as_secs_f64() * 1e3;
    pipeline
}

/// How far ahead a draw is moved at most, to bound the work for scenes of many.
const FARTHEST_AHEAD: usize = 256;

/// Moves what is nearer ahead, so that fewer hidden fragments are lit. Only past what is wholly behind it: of surfaces
/// at the same depth the one that comes first in the scene shows, whatever the order. Says how many it moved.
fn nearest_first(calls: &mut [Call]) -> usize {
    let mut moved = 0;
    for at in 1..calls.len() {
        let [_, far] = calls[at].span;
        let behind = |call: &&Call| far * (1.0 + 1e-6) < call.span[0];
        let ahead = calls[..at].iter().rev().take(FARTHEST_AHEAD).take_while(behind).count();
        calls[at - ahead..=at].rotate_right(1);
        moved += usize::from(ahead > 0);
    }
    moved
}

/// Draws what is sorted by its mesh after all else, so that whatever is before it hides it, and nearest first: no order
/// changes what shows of it. Says how many are now ahead of a draw that comes before them in the scene.
fn apart_last(calls: &mut [Call]) -> usize {
    calls.sort_by(|a, b| {
        (a.apart.cmp(&b.apart)).then(if a.apart { a.span[0].total_cmp(&b.span[0]) } else { Equal })
    });
    let mut first = usize::MAX;
    let mut overtakes = |call: &&Call| {
        let overtakes = call.draw > first;
        first = first.min(call.draw);
        overtakes
    };
    calls.iter().rev().filter(|call| overtakes(call)).count()
}
