//! From a draw to what the device needs for it, whatever the view: maps, buffers, bind groups, pipelines. Draws of
//! the same mesh share its buffers, those of materials that look alike their maps.

use std::collections::HashMap;
use std::num::NonZeroU64;
use std::sync::Arc;

use glam::DVec3;
use heightfield::technique::Reads;
use mesh::Mesh;

use crate::clusters::{Cluster, Clusters};
use crate::geometry::{Attributes, CUBOID, Geometry};
use crate::heights::bind;
use crate::layouts::{BOUNDS, BesideDraw};
use crate::materials::{MaterialKey, material_group};
use crate::pipeline::{PipelineKey, attributes, constants_of, reads_of};
use crate::plain::FLAT;
use crate::request::Program;
use crate::shell::SceneSolids;
use crate::sparing::Sparing;
use crate::targets::TargetSet;
use crate::uniforms::DrawInfo;
use crate::{Device, Draw, RenderError, Request, Scene, Stats, TechniqueChoice};

/// What is drawn of a draw the same way in all views.
pub(crate) struct Fixed {
    /// Compiled when a view first needs it.
    pub key: PipelineKey,
    /// What takes its place in views that need no march.
    pub spared: Option<PipelineKey>,
    pub geometry: Geometry,
    /// Groups that may be left out; none where all is drawn or nothing.
    pub groups: Option<Arc<[Cluster]>>,
    pub triangles: u32,
}

/// What is cut anew for each view; its pipeline is compiled when the first cut gives anything.
pub(crate) struct Cutting {
    pub key: PipelineKey,
}

/// What a draw is in its scene.
pub(crate) struct InScene<'a> {
    /// Middle of its mesh.
    pub middle: DVec3,
    /// Whether it is sorted by its mesh.
    pub apart: bool,
    /// The solids of the scene and the number of its own, where rays are traced through shells.
    pub solids: Option<(&'a SceneSolids, u32)>,
}

/// A draw, ready.
pub(crate) struct Prepared {
    pub field: Option<wgpu::BindGroup>,
    pub material: wgpu::BindGroup,
    /// Group 3, at an offset that the view chooses.
    pub place: wgpu::BindGroup,
    pub fixed: Option<Fixed>,
    pub cutting: Option<Cutting>,
    pub sparing: Sparing,
}

/// A run of a mesh's triangles on the device.
#[derive(Clone)]
struct Run {
    indices: wgpu::Buffer,
    groups: Arc<[Cluster]>,
}

/// What draws share. Everything is known by where it is in memory, which the scene keeps alive.
pub(crate) struct Shared {
    /// Places of the draws in a view, [`Shared::stride`] bytes apart.
    pub places: wgpu::Buffer,
    /// Bytes from one draw's place to the next one's.
    pub stride: u64,
    meshes: HashMap<(usize, &'static [usize]), Attributes>,
    runs: HashMap<(usize, u32, u32), Run>,
    /// Boxes around solids, by the solids' numbers.
    boxes: HashMap<u32, Geometry>,
    /// Places with the bounds of a map beside them.
    grounds: HashMap<usize, wgpu::BindGroup>,
    materials: HashMap<MaterialKey, wgpu::BindGroup>,
    place: wgpu::BindGroup,
    /// Whether light rays are traced.
    shadows: bool,
    /// Lights of the scene.
    lights: usize,
}

/// Where a mesh is in memory.
pub(crate) fn address(mesh: &Mesh) -> usize {
    std::ptr::from_ref(mesh) as usize
}

/// The entry of a map, made if there is none.
fn entry<K: Eq + std::hash::Hash, V: Clone>(
    known: &mut HashMap<K, V>,
    key: K,
    make: impl FnOnce() -> Result<V, RenderError>,
) -> Result<V, RenderError> {
    if let Some(value) = known.get(&key) {
        return Ok(value.clone());
    }
    let value = make()?;
    known.insert(key, value.clone());
    Ok(value)
}

impl Shared {
    /// Room for the draws of a scene. `shadows`: whether light rays are traced.
    pub fn new(device: &Device, scene: &Scene<'_>, shadows: bool) -> Result<Self, RenderError> {
        let limits = device.device.limits();
        let alignment =
            limits.min_storage_buffer_offset_alignment.max(limits.min_uniform_buffer_offset_alignment);
        let alignment = u64::from(alignment.max(16));
        let stride = (size_of::<DrawInfo>() as u64).next_multiple_of(alignment);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let places = device.buffer("places", stride * scene.draws.len().max(1) as u64, usage)?;
        let place = place_group(device, &places, BesideDraw::Nothing, Vec::new())?;
        Ok(Self {
            places,
            stride,
            place,
            shadows,
            lights: scene.lights.len(),
            meshes: HashMap::new(),
            runs: HashMap::new(),
            boxes: HashMap::new(),
            grounds: HashMap::new(),
            materials: HashMap::new(),
        })
    }

    /// Prepares a draw.
    pub fn prepare(
        &mut self,
        device: &Device,
        draw: &Draw<'_>,
        InScene { middle, apart, solids }: InScene<'_>,
        request: &Request,
        stats: &mut Stats,
    ) -> Result<Prepared, RenderError> {
        let mut program = request.technique.program(draw.material.normal.is_some());
        program.horizon = solids.is_none()
            && request.horizon.is_some()
            && request.shadows != Some(false)
            && request.technique.takes_horizon();
        let mut reads = reads_of(&request.technique).filter(|_| solids.is_none());
        let light = (self.shadows, self.lights);
        let sparing = Sparing::of(device, draw, request)?;
        if !program.horizon && sparing.shows_no_relief(draw, request) {
            program = TechniqueChoice::Plain(&FLAT).program(false);
            reads = None;
        }
        let key = |program: Program, marches| {
            let apart = apart && BesideDraw::of(program.entry) == BesideDraw::Bounds;
            key(draw, request, program, reads, light, apart, sparing.constants(program, request, marches))
        };

        let field = reads.map(|reads| device.field_group(&draw.material.field, reads)).transpose()?;
        let material = entry(&mut self.materials, MaterialKey::new(&draw.material, program), || {
            material_group(device, &draw.material, program, request.horizon, stats)
        })?;
        if let Some((solids, own)) = solids {
            let place = solids.group();
            if request.technique.draws_geometry() {
                let cutting = Some(Cutting { key: key(program, true) });
                return Ok(Prepared { field, material, place, fixed: None, cutting, sparing });
            }
            let geometry = entry(&mut self.boxes, own, || {
                let [low, high] = solids.bounds(own);
                Geometry::cuboid(device, low, high)
            })?;
            let fixed = Some(Fixed {
                key: key(Program { entry: "shell", ..program }, true),
                spared: None,
                geometry,
                triangles: CUBOID.len() as u32,
                groups: None,
            });
            return Ok(Prepared { field, material, place, fixed, cutting: None, sparing });
        }
        let locations = attributes(program.entry);
        let geometry = entry(&mut self.meshes, (address(&draw.mesh), locations), || {
            Attributes::new(device, &draw.mesh, middle, locations)
        })?;
        let Run { indices, groups } = self.run(device, draw, middle)?;
        let fixed = Fixed {
            key: key(program, true),
            spared: program.search.map(|_| key(program, false)),
            geometry: Geometry { attributes: geometry, indices },
            triangles: draw.triangles.end - draw.triangles.start,
            groups: Some(groups),
        };
        let place = if BesideDraw::of(program.entry) == BesideDraw::Bounds {
            let map = Arc::as_ptr(&draw.material.field) as usize;
            let (places, nodes) = (&self.places, sparing.ground.nodes.as_entire_binding());
            entry(&mut self.grounds, map, || {
                place_group(device, places, BesideDraw::Bounds, vec![bind(BOUNDS, nodes)])
            })?
        } else {
            self.place.clone()
        };
        Ok(Prepared { field, material, place, fixed: Some(fixed), cutting: None, sparing })
    }

    fn run(&mut self, device: &Device, draw: &Draw<'_>, middle: DVec3) -> Result<Run, RenderError> {
        let known = (address(&draw.mesh), draw.triangles.start, draw.triangles.end);
        entry(&mut self.runs, known, || {
            let Clusters { triangles, groups } = Clusters::new(&draw.mesh, draw.triangles.clone(), middle);
            let bytes = bytemuck::cast_slice(&triangles);
            let indices = device.buffer_with("triangles", bytes, wgpu::BufferUsages::INDEX)?;
            Ok(Run { indices, groups: groups.into() })
        })
    }
}

fn key(
    draw: &Draw<'_>,
    request: &Request,
    program: Program,
    reads: Option<Reads>,
    (shadows, lights): (bool, usize),
    apart: bool,
    sparing: Vec<(&'static str, i64)>,
) -> PipelineKey {
    let mut constants = vec![
        ("albedo_map", i64::from(draw.material.albedo.is_some())),
        ("single_light", i64::from(lights == 1)),
    ];
    if let (TechniqueChoice::Search(technique), Some(_)) = (&request.technique, reads) {
        constants.extend(constants_of(technique, &draw.material.field));
    }
    if program.entry != "dot3" {
        constants.push(("specular_aa", i64::from(request.specular_aa)));
    }
    if program.search.is_some() && !program.horizon {
        constants.push(("cast_shadows", i64::from(shadows)));
    }
    constants.extend(sparing);
    if program.entry == "shell" {
        constants.push(("sees_inside", i64::from(draw.material.double_sided)));
    }
    PipelineKey {
        program,
        reads,
        constants,
        targets: TargetSet::of(request.aovs),
        apart,
        double_sided: draw.material.double_sided,
        mirrored: draw.world_from_object.determinant() < 0.0,
    }
}

/// Group 3, with what stands beside the place.
pub(crate) fn place_group(
    device: &Device,
    places: &wgpu::Buffer,
    beside: BesideDraw,
    others: Vec<wgpu::BindGroupEntry<'_>>,
) -> Result<wgpu::BindGroup, RenderError> {
    let place = wgpu::BufferBinding {
        buffer: places,
        offset: 0,
        size: NonZeroU64::new(size_of::<DrawInfo>() as u64),
    };
    let mut entries = vec![bind(0, wgpu::BindingResource::Buffer(place))];
    entries.extend(others);
    device.guard("binding a draw", || {
        Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("draw"),
            layout: device.layouts.draw(beside),
            entries: &entries,
        }))
    })
}
