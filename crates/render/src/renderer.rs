//! A scene on the device, and its pictures: validate, prepare what a view shows, draw band by band, read back.

mod seen;

use std::collections::{HashMap, VecDeque};
use std::sync::Arc;
use std::time::Instant;

use heightfield::HeightField;

use crate::frame_binding::FrameBinding;
use crate::geometry::Room;
use crate::prepare::{Prepared, Shared, address};
use crate::readback::Readback;
use crate::resolve::resolve;
use crate::shell::SceneSolids;
use crate::sorting::Sorting;
use crate::tally::Tally;
use crate::targets::{TargetSet, Targets};
use crate::timer::Timer;
use crate::unpack::Unpacker;
use crate::view::Call;
use crate::{AovSet, Camera, Device, Frame, Held, RenderError, Request, Scene, Stats};

/// Pixels drawn at once. Larger pictures are drawn in bands of rows, so that the memory that the
/// targets take does not grow with the picture.
pub(crate) const BAND_PIXELS: u64 = 1 << 22;

/// A picture under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ticket(u64);

/// A scene for many views. What a view shows is prepared and uploaded when it is first seen, once; pictures may be
/// under way while others are read back.
///
/// The counts and times of preparing are in the statistics of the picture that it was first done for.
pub struct Renderer<'a> {
    device: Held<'a, Device>,
    scene: Scene<'a>,
    request: Request,
    rows_at_once: u32,
    rooms: HashMap<usize, Room>,
    shared: Shared,
    /// Where programs read them, from the first view on.
    solids: Option<SceneSolids>,
    /// How draws of searches are sorted, from the first view on.
    sorting: Option<Arc<Sorting>>,
    draws: Vec<Option<Prepared>>,
    /// Samples along a side of a pixel; the request is for as many more pixels.
    across: u32,
    /// Additional outputs where there are several samples a pixel.
    central: Option<Box<Self>>,
    targets: Targets,
    frame: FrameBinding,
    spare: Vec<Readback>,
    under_way: VecDeque<UnderWay>,
    tickets: u64,
    warnings: Vec<String>,
    /// Spent since the last picture on what the next one needs.
    unclaimed: Stats,
}

/// A band that the device is drawing, and what is known of its picture.
struct UnderWay {
    ticket: Ticket,
    central: Option<Ticket>,
    started: Instant,
    band: Band,
    unpacker: Unpacker,
    stats: Stats,
    warnings: Vec<String>,
}

struct Band {
    readback: Readback,
    first_row: u32,
    rows: u32,
    submitted: Instant,
    drawn: wgpu::SubmissionIndex,
    copied: wgpu::SubmissionIndex,
}

impl std::fmt::Debug for Renderer<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Renderer").field("request", &self.request).finish_non_exhaustive()
    }
}

impl<'a> Renderer<'a> {
    /// Takes a scene and what is asked of its pictures.
    ///
    /// # Errors
    /// [`RenderError`]: senseless scenes name the draw or light.
    pub fn new(
        device: impl Into<Held<'a, Device>>,
        scene: Scene<'a>,
        request: Request,
    ) -> Result<Self, RenderError> {
        Self::in_bands(device, scene, request, BAND_PIXELS)
    }

    /// [`Renderer::new`] with at most `band_pixels` pixels, but at least one row, drawn at a time.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn in_bands(
        device: impl Into<Held<'a, Device>>,
        scene: Scene<'a>,
        request: Request,
        band_pixels: u64,
    ) -> Result<Self, RenderError> {
        let (started, before) = (Instant::now(), Tally::now());
        let device = device.into();
        device.check_process()?;
        let across = request.samples_across()?;
        let wants_central = across > 1 && request.aovs != AovSet::NONE;
        let central = wants_central
            .then(|| {
                let central = Request { samples: 1, ..request };
                Self::in_bands(device.clone(), scene.clone(), central, band_pixels).map(Box::new)
            })
            .transpose()?;
        let request = request.of_samples(across);
        let (width, height) = (request.width, request.height);
        if width == 0 || height == 0 {
            return Err(RenderError::Size { width, height });
        }
        let longest = u64::from(device.device.limits().max_texture_dimension_2d);
        Device::check("picture width, in pixels,", u64::from(width), longest)?;
        Device::check("picture height, in pixels,", u64::from(height), longest)?;
        scene.validate()?;
        request.skip_error.validate()?;
        let mut rooms = HashMap::new();
        for draw in &scene.draws {
            rooms.entry(address(&draw.mesh)).or_insert_with(|| Room::of(&draw.mesh));
        }
        let rows_at_once = (band_pixels / u64::from(width)).clamp(1, u64::from(height)) as u32;
        let mut renderer = Self {
            rooms,
            across,
            central,
            solids: None,
            sorting: None,
            shared: Shared::new(&device, &scene, request.traces_light())?,
            draws: scene.draws.iter().map(|_| None).collect(),
            targets: Targets::new(&device, TargetSet::of(request.aovs), width, rows_at_once)?,
            frame: FrameBinding::new(&device, &scene)?,
            spare: Vec::new(),
            under_way: VecDeque::new(),
            tickets: 0,
            warnings: crate::warnings::warnings(&scene, &request),
            unclaimed: Stats::default(),
            device,
            scene,
            request,
            rows_at_once,
        };
        renderer.unclaimed.prepare_ms = started.elapsed().as_secs_f64() * 1e3;
        renderer.unclaimed.bytes_uploaded = Tally::now().bytes - before.bytes;
        Ok(renderer)
    }

    /// A picture of one view. Others may be under way.
    ///
    /// # Errors
    /// [`RenderError`]: a senseless camera, or the device's faults.
    pub fn render(&mut self, camera: Camera) -> Result<Frame, RenderError> {
        let ticket = self.start(camera)?;
        self.finish(ticket)
    }

    /// Has the device draw a view, and returns while it does so. Each ticket takes memory for its picture until it is
    /// finished or abandoned.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn start(&mut self, camera: Camera) -> Result<Ticket, RenderError> {
        let (started, before) = (Instant::now(), Tally::now());
        self.device.check_process()?;
        camera.validate()?;
        let central = self.central.as_mut().map(|central| central.start(camera)).transpose()?;
        let mut stats = std::mem::take(&mut self.unclaimed);
        let (compiled, mut warnings) = (stats.compile_ms, self.warnings.clone());
        let calls = self.view(&camera, &mut stats, &mut warnings)?;
        let mut unpacker = Unpacker::new(&self.request, camera.eye, self.scene.lights.len())?;
        let compiled = stats.compile_ms - compiled;
        stats.prepare_ms += started.elapsed().as_secs_f64() * 1e3 - compiled;
        let mut first_row = 0;
        let band = loop {
            let band = self.draw(&camera, &calls, first_row)?;
            first_row += band.rows;
            if first_row == self.request.height {
                break band;
            }
            self.collect(band, &mut unpacker, &mut stats)?;
        };
        let spent = Tally::now();
        stats.bytes_uploaded += spent.bytes - before.bytes;
        stats.pipelines_compiled += spent.pipelines - before.pipelines;
        let ticket = Ticket(self.tickets);
        self.tickets += 1;
        self.under_way.push_back(UnderWay { ticket, central, started, band, unpacker, stats, warnings });
        Ok(ticket)
    }

    /// Waits for a picture and reads it back.
    ///
    /// # Errors
    /// The device's faults, or a ticket that is not under way.
    pub fn finish(&mut self, ticket: Ticket) -> Result<Frame, RenderError> {
        self.device.check_process()?;
        let Some(UnderWay { central, started, band, mut unpacker, mut stats, warnings, .. }) =
            self.take(ticket)
        else {
            return Err(RenderError::Scene(format!("picture {} is not under way", ticket.0)));
        };
        self.collect(band, &mut unpacker, &mut stats)?;
        stats.device_clock = self.device.has_timestamps();
        let mut frame = unpacker.finish(&mut stats);
        if self.across > 1 {
            frame.color = resolve(&frame.color, frame.width as usize, self.across as usize);
            (frame.width, frame.height) = (frame.width / self.across, frame.height / self.across);
        }
        if let (Some(renderer), Some(ticket)) = (&mut self.central, central) {
            let central = renderer.finish(ticket)?;
            frame.aovs = central.aovs;
            stats.add_times(&central.stats);
        }
        stats.total_ms = started.elapsed().as_secs_f64() * 1e3;
        frame.stats = stats;
        frame.warnings = warnings;
        Ok(frame)
    }

    /// Gives a picture up.
    pub fn abandon(&mut self, ticket: Ticket) {
        let given_up = self.take(ticket).and_then(|work| work.central);
        if let (Some(renderer), Some(ticket)) = (&mut self.central, given_up) {
            renderer.abandon(ticket);
        }
    }

    /// Pictures of many views in turn, each read back while the next one is drawn.
    pub fn render_many(
        &mut self,
        cameras: impl IntoIterator<Item = Camera>,
    ) -> impl Iterator<Item = Result<Frame, RenderError>> {
        let mut cameras = cameras.into_iter();
        let mut waiting: Option<Result<Ticket, RenderError>> = None;
        std::iter::from_fn(move || {
            loop {
                let next = cameras.next().map(|camera| self.start(camera));
                let ready = std::mem::replace(&mut waiting, next);
                match (ready, &waiting) {
                    (Some(Ok(ticket)), _) => return Some(self.finish(ticket)),
                    (Some(Err(error)), _) => return Some(Err(error)),
                    (None, Some(_)) => (),
                    (None, None) => return None,
                }
            }
        })
    }

    /// The height fields that a view shows and that have not been prepared yet: what their technique reads can be baked
    /// beforehand, with progress and where it can be interrupted.
    pub fn fields_to_prepare(&self, camera: &Camera) -> Vec<Arc<HeightField>> {
        let culling = self.culling(camera);
        let unseen = |at: &usize| self.draws[*at].is_none() && self.stands(*at, camera, &culling).is_some();
        (0..self.draws.len())
            .filter(unseen)
            .map(|at| Arc::clone(&self.scene.draws[at].material.field))
            .collect()
    }

    fn take(&mut self, ticket: Ticket) -> Option<UnderWay> {
        let at = self.under_way.iter().position(|work| work.ticket == ticket)?;
        self.under_way.remove(at)
    }

    /// Submits the band that begins at a row.
    fn draw(&mut self, camera: &Camera, calls: &[Call], first_row: u32) -> Result<Band, RenderError> {
        let rows = self.rows_at_once.min(self.request.height - first_row);
        let readback = match self.spare.pop() {
            Some(readback) => readback,
            None => {
                let set = TargetSet::of(self.request.aovs);
                Readback::new(&self.device, set, self.request.width, self.rows_at_once)?
            }
        };
        let device = &self.device;
        let submitted = Instant::now();
        let (drawn, copied) = device.guard("drawing", || {
            self.frame.write(device, &self.scene, &self.request, camera, first_row, self.rows_at_once);
            let encode = || device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let mut encoder = encode();
            self.encode(&mut encoder, calls, readback.timer.as_ref());
            if let Some(timer) = &readback.timer {
                timer.resolve(&mut encoder);
            }
            let drawn = device.queue.submit([encoder.finish()]);
            let mut encoder = encode();
            self.targets.copy(&mut encoder, rows, &readback);
            let copied = device.queue.submit([encoder.finish()]);
            readback.map(rows);
            Ok((drawn, copied))
        })?;
        Ok(Band { readback, first_row, rows, submitted, drawn, copied })
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, calls: &[Call], timer: Option<&Timer>) {
        let attachments = self.targets.color_attachments(self.scene.background);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surfaces"),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(self.targets.depth_attachment()),
            timestamp_writes: timer.map(Timer::render_writes),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_bind_group(0, &self.frame.group, &[]);
        for call in calls {
            if let Some(prepared) = &self.draws[call.draw] {
                call.encode(&mut pass, prepared);
            }
        }
    }

    /// Waits for a band and unpacks it.
    fn collect(&mut self, band: Band, unpacker: &mut Unpacker, stats: &mut Stats) -> Result<(), RenderError> {
        let device = &self.device;
        let Band { readback, first_row, rows, submitted, drawn, copied } = band;
        stats.draw_ms += device.guard("drawing", || {
            device.wait_for(drawn, "drawing")?;
            let waited = submitted.elapsed().as_secs_f64() * 1e3;
            readback.timer.as_ref().map_or(Ok(waited), |timer| timer.read_ms(device))
        })?;
        let before = Instant::now();
        device.guard("reading the picture back", || {
            device.wait_for(copied, "reading the picture back")?;
            readback.read(rows, |target, row, bytes| unpacker.row(target, first_row + row, bytes))
        })?;
        stats.readback_ms += before.elapsed().as_secs_f64() * 1e3;
        self.spare.push(readback);
        Ok(())
    }
}
