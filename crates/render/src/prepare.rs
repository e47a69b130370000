//! From a scene to what the device draws: maps, buffers, bind groups, pipelines.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

use glam::{DMat4, Vec4};
use mesh::Mesh;

use crate::geometry::{CUBOID, Geometry, ball, centre};
use crate::heights::bind;
use crate::layouts::MaterialMaps;
use crate::micro::{self, View};
use crate::pipeline::{Pipeline, PipelineKey, attributes, constants_of, endless, reads_of};
use crate::request::Program;
use crate::shell::Shell;
use crate::targets::TargetSet;
use crate::texture;
use crate::triangles::Triangles;
use crate::uniforms::{DrawInfo, HorizonInfo, LightInfo, MaterialInfo, wrap_code};
use crate::uploads::{Kind, Resource};
use crate::{
    Device, Draw, HorizonShadows, Light, Material, RenderError, Request, Scene, Skips, Stats, TechniqueChoice,
};

/// One draw, ready.
pub(crate) struct Prepared {
    pub pipeline: Arc<Pipeline>,
    pub geometry: Arc<Geometry>,
    pub locations: &'static [usize],
    pub triangles: std::ops::Range<u32>,
    pub field: Option<wgpu::BindGroup>,
    pub material: wgpu::BindGroup,
    pub draw: wgpu::BindGroup,
}

/// One pipeline's share of a draw: its program and what it draws.
struct Part {
    program: Program,
    geometry: Arc<Geometry>,
    triangles: std::ops::Range<u32>,
}

/// Meshes that have been uploaded, by the attributes they have there.
type Meshes = HashMap<(*const Mesh, &'static [usize]), Arc<Geometry>>;

/// Prepares all draws that may be in the picture.
pub(crate) fn draws(
    device: &Device,
    scene: &Scene<'_>,
    request: &Request,
    shadows: bool,
    stats: &mut Stats,
    warnings: &mut Vec<String>,
) -> Result<Vec<Prepared>, RenderError> {
    let size = [request.width, request.height];
    let aspect = f64::from(request.width) / f64::from(request.height);
    let mut meshes = Meshes::new();
    let mut prepared = Vec::new();
    for (index, draw) in scene.draws.iter().enumerate() {
        let middle = centre(&draw.mesh);
        let relative_from_object = DMat4::from_translation(-scene.camera.eye)
            * draw.world_from_object
            * DMat4::from_translation(middle);
        let count = u64::from(draw.triangles.end - draw.triangles.start);
        let (ball_centre, radius) = ball(draw, relative_from_object);
        let unseen =
            request.skips.contains(Skips::FRUSTUM) && scene.camera.misses_ball(aspect, ball_centre, radius);
        if count == 0 || unseen {
            stats.triangles_culled += count;
            stats.skipped.add(Skips::FRUSTUM, count);
            continue;
        }
        let view = View { camera: &scene.camera, relative_from_object, centre: middle, size };
        // A shell of no height holds nothing; on the mesh itself the search sees the same.
        let in_shell = request.in_shell() && draw.material.field.extent().scale > 0.0;
        let shell = if in_shell || request.technique.draws_geometry() {
            Some(Shell::new(device, draw, middle)?)
        } else {
            None
        };
        let seen_in = shell.as_ref().filter(|_| in_shell);
        let parts = parts(device, draw, request, &view, seen_in, &mut meshes, |coarser| {
            warnings.push(format!(
                "draw {index}: micro-polygons are up to {coarser:.1} pixels wide, to keep their number down"
            ));
        })?;
        let reads = reads_of(&request.technique);
        let field = reads.map(|reads| device.field_group(&draw.material.field, reads)).transpose()?;
        // Light rays through a relief of no height meet nothing.
        let shadows = shadows && !(shell.is_some() && draw.material.field.extent().scale == 0.0);
        let draw_group = draw_group(device, draw, &view, shell.as_ref())?;
        for Part { program, geometry, triangles } in parts {
            stats.triangles_drawn += u64::from(triangles.end - triangles.start);
            let material = material_group(device, &draw.material, program, request.horizon, stats)?;
            let before = Instant::now();
            let pipeline = device.pipeline(key(draw, request, program, shadows))?;
            stats.compile_ms += before.elapsed().as_secs_f64() * 1e3;
            let (field, draw) = (field.clone(), draw_group.clone());
            let locations = attributes(program.entry);
            prepared.push(Prepared { pipeline, geometry, locations, triangles, field, material, draw });
        }
    }
    Ok(prepared)
}

/// What is drawn of a draw, and by which programs. `shell`: where rays are traced through it.
fn parts(
    device: &Device,
    draw: &Draw<'_>,
    request: &Request,
    view: &View<'_>,
    shell: Option<&Shell>,
    meshes: &mut Meshes,
    mut coarsened: impl FnMut(f64),
) -> Result<Vec<Part>, RenderError> {
    let own_normals = draw.material.normal.is_some();
    let mut program = request.technique.program(own_normals);
    let mut micro = |program: Program, only_bridges: bool| -> Result<Part, RenderError> {
        let (displaced, coarser) = micro::displaced(draw, view, only_bridges)?;
        if coarser > 1.0 {
            coarsened(coarser);
        }
        let geometry = Arc::new(Geometry::micro(device, &displaced)?);
        Ok(Part { program, geometry, triangles: 0..displaced.indices.len() as u32 })
    };
    if let Some(shell) = shell {
        let [low, high] = shell.bounds;
        let shell = Part {
            program: Program { entry: "shell", ..program },
            geometry: Arc::new(Geometry::cuboid(device, low, high)?),
            triangles: 0..CUBOID.len() as u32,
        };
        let bridges = micro(Program { entry: "displaced", ..program }, true)?;
        return Ok([shell, bridges].into_iter().filter(|part| !part.triangles.is_empty()).collect());
    }
    if request.technique.draws_geometry() {
        return Ok(vec![micro(program, false)?]);
    }
    program.horizon =
        request.horizon.is_some() && request.shadows != Some(false) && request.technique.takes_horizon();
    let locations = attributes(program.entry);
    let known = (std::ptr::from_ref::<Mesh>(&draw.mesh), locations);
    let geometry = match meshes.get(&known) {
        Some(geometry) => Arc::clone(geometry),
        None => {
            let geometry = Arc::new(Geometry::new(device, &draw.mesh, view.centre, locations)?);
            meshes.insert(known, Arc::clone(&geometry));
            geometry
        }
    };
    Ok(vec![Part { program, geometry, triangles: draw.triangles.clone() }])
}

fn key(draw: &Draw<'_>, request: &Request, program: Program, shadows: bool) -> PipelineKey {
    let mut constants = Vec::new();
    if let TechniqueChoice::Search(technique) = &request.technique {
        constants = constants_of(technique, &draw.material.field);
    }
    if request.technique.draws_geometry() {
        constants.push(endless(&draw.material.field));
    }
    if program.search.is_some() && !program.horizon {
        constants.push(("cast_shadows", i64::from(shadows)));
    }
    if program.entry == "shell" {
        constants.push(("sees_inside", i64::from(draw.material.double_sided)));
    }
    PipelineKey {
        program,
        reads: reads_of(&request.technique),
        constants,
        targets: TargetSet::of(request.aovs),
        double_sided: draw.material.double_sided,
        mirrored: draw.world_from_object.determinant() < 0.0,
    }
}

/// Group 3, with the mesh and its shell where there is one.
fn draw_group(
    device: &Device,
    draw: &Draw<'_>,
    view: &View<'_>,
    shell: Option<&Shell>,
) -> Result<wgpu::BindGroup, RenderError> {
    let object_from_relative = view.relative_from_object.inverse();
    let info = DrawInfo {
        relative_from_object: view.relative_from_object.as_mat4(),
        object_from_relative: object_from_relative.as_mat4(),
        eye: object_from_relative.w_axis.as_vec4(),
    };
    let buffer = device.buffer_with("draw", bytemuck::bytes_of(&info), wgpu::BufferUsages::STORAGE)?;
    let mut entries = vec![bind(0, buffer.as_entire_binding())];
    let triangles = shell.map(|_| Triangles::new(device, &draw.mesh, view.centre)).transpose()?;
    if let (Some(triangles), Some(shell)) = (&triangles, shell) {
        entries.push(bind(1, triangles.vertices.as_entire_binding()));
        entries.push(bind(2, triangles.indices.as_entire_binding()));
        entries.push(bind(3, shell.nodes.as_entire_binding()));
        entries.push(bind(4, shell.prisms.as_entire_binding()));
    }
    device.guard("binding a draw", || {
        Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("draw"),
            layout: device.layouts.draw(shell.is_some()),
            entries: &entries,
        }))
    })
}

/// The lights as the shaders want them; never empty, since a buffer must not be.
pub(crate) fn light_infos(scene: &Scene<'_>) -> Vec<LightInfo> {
    let mut infos: Vec<LightInfo> = scene
        .lights
        .iter()
        .map(|light| {
            let (place, color, intensity) = match *light {
                Light::Directional { direction, color, intensity } => {
                    ((-direction.as_dvec3().normalize()).extend(0.0).as_vec4(), color, intensity)
                }
                Light::Point { position, color, intensity } => {
                    ((position - scene.camera.eye).extend(1.0).as_vec4(), color, intensity)
                }
            };
            let [r, g, b] = color;
            LightInfo { place, color: Vec4::new(r, g, b, 0.0) * intensity }
        })
        .collect();
    if infos.is_empty() {
        infos.push(LightInfo { place: Vec4::Z, color: Vec4::ZERO });
    }
    infos
}

fn material_group(
    device: &Device,
    material: &Material,
    program: Program,
    horizon: Option<HorizonShadows>,
    stats: &mut Stats,
) -> Result<wgpu::BindGroup, RenderError> {
    let field = &material.field;
    let extent = field.extent();
    let info = MaterialInfo {
        albedo_factor: Vec4::from(material.albedo_factor),
        map_width: field.width() as f32,
        map_height: field.height() as f32,
        scale: extent.scale,
        base: extent.base,
        specular: material.specular,
        shininess: material.shininess,
        period: heightfield::march::period(field.wrap()) as f32,
        wrap: wrap_code(field.wrap()),
    };
    let info = device.buffer_with("material", bytemuck::bytes_of(&info), wgpu::BufferUsages::UNIFORM)?;
    let albedo = match &material.albedo {
        Some(image) => {
            view(device.keep(image, Kind::Albedo, || {
                let levels = texture::albedo(image);
                texture::upload(device, "albedo", wgpu::TextureFormat::Rgba8UnormSrgb, &levels, false)
                    .map(Resource::View)
            })?)?
            .0
        }
        None => device.keep_white(|| {
            texture::upload(device, "white", wgpu::TextureFormat::Rgba8UnormSrgb, &texture::white(), false)
        })?,
    };
    let sampler = texture::sampler(device, field.wrap(), true);
    let map = if program.maps == MaterialMaps::None {
        None
    } else {
        Some(surface_map(device, material, program, stats)?)
    };
    let cube =
        if program.maps == MaterialMaps::MapAndCube {
            let levels = texture::normalization_cube();
            Some(device.keep_cube(|| {
                texture::upload(device, "cube", wgpu::TextureFormat::Rgba8Unorm, &levels, true)
            })?)
        } else {
            None
        };
    let cube_sampler = texture::sampler(device, heightfield::Wrap::Clamp, true);

    let mut entries = vec![
        bind(0, info.as_entire_binding()),
        bind(1, wgpu::BindingResource::TextureView(&albedo)),
        bind(2, wgpu::BindingResource::Sampler(&sampler)),
    ];
    if let Some(map) = &map {
        entries.push(bind(3, wgpu::BindingResource::TextureView(map)));
        entries.push(bind(4, wgpu::BindingResource::Sampler(&sampler)));
    }
    if let Some(cube) = &cube {
        entries.push(bind(5, wgpu::BindingResource::TextureView(cube)));
        entries.push(bind(6, wgpu::BindingResource::Sampler(&cube_sampler)));
    }
    let horizon = horizon.filter(|_| program.horizon);
    let horizon = horizon.map(|horizon| HorizonBinding::new(device, material, horizon, stats)).transpose()?;
    if let Some(horizon) = &horizon {
        entries.push(bind(7, wgpu::BindingResource::TextureView(&horizon.map)));
        entries.push(bind(8, wgpu::BindingResource::Sampler(&sampler)));
        entries.push(bind(9, horizon.info.as_entire_binding()));
    }
    device.guard("binding a material", || {
        Ok(device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("material"),
            layout: device.layouts.material(program.maps, program.horizon),
            entries: &entries,
        }))
    })
}

/// What shading/shadow_horizon binds.
struct HorizonBinding {
    map: wgpu::TextureView,
    info: wgpu::Buffer,
}

impl HorizonBinding {
    fn new(
        device: &Device,
        material: &Material,
        horizon: HorizonShadows,
        stats: &mut Stats,
    ) -> Result<Self, RenderError> {
        let field = &material.field;
        let HorizonShadows { azimuths, softness } = horizon;
        let (map, made) = view(device.keep(field, Kind::Horizon(azimuths), || {
            texture::horizon(device, field, azimuths).map(Resource::View)
        })?)?;
        stats.maps_baked += u32::from(made);
        let info = HorizonInfo { tile_size: field.extent().tile_size, softness: softness.max(0.0), azimuths };
        let info = device.buffer_with("horizon", bytemuck::bytes_of(&info), wgpu::BufferUsages::UNIFORM)?;
        Ok(Self { map, info })
    }
}

/// The map at binding 3, baked if the device does not have it.
fn surface_map(
    device: &Device,
    material: &Material,
    program: Program,
    stats: &mut Stats,
) -> Result<wgpu::TextureView, RenderError> {
    let field = &material.field;
    let eight_bits = program.surface == "dot3";
    let upload = |label, format, levels: &[texture::MipLevel]| {
        texture::upload(device, label, format, levels, false).map(Resource::View)
    };
    let (view, made) = view(match (&material.normal, eight_bits) {
        (Some(image), false) => device.keep(image, Kind::OwnNormals, || {
            upload("normals", wgpu::TextureFormat::Rgba16Float, &texture::own(image))
        })?,
        (Some(image), true) => device.keep(image, Kind::OwnNormals8Bit, || {
            upload("normals", wgpu::TextureFormat::Rgba8Unorm, &texture::own_8_bit(image))
        })?,
        (None, false) => device.keep(field, Kind::Slopes, || {
            upload("slopes", wgpu::TextureFormat::Rg16Float, &texture::slopes(field)?)
        })?,
        (None, true) => device.keep(field, Kind::Baked8Bit, || {
            upload("normals", wgpu::TextureFormat::Rgba8Unorm, &texture::baked_8_bit(field)?)
        })?,
    })?;
    stats.maps_baked += u32::from(made && material.normal.is_none());
    Ok(view)
}

fn view((resource, made): (Resource, bool)) -> Result<(wgpu::TextureView, bool), RenderError> {
    match resource {
        Resource::View(view) => Ok((view, made)),
        Resource::Group(_) => Err(RenderError::Device {
            during: "looking up a map",
            message: "a bind group was kept in its place".to_owned(),
        }),
    }
}
