//! Maps from a detailed mesh: normals, heights and occlusion of a fine surface on the UVs of a plain one.
//!
//! Each texel of a chart starts a ray above the plain mesh, along its interpolated normal or from a
//! cage, downwards. What the ray meets first is stored: its normal in the plain mesh's tangent frame,
//! its height above the plain mesh, and how open the sky is over it.
//!
//! Sources: Cohen, Olano and Manocha, "Appearance-Preserving Simplification", SIGGRAPH 1998; Cignoni
//! et al., "A General Method for Preserving Attribute Values on Simplified Meshes", 1998; Mikkelsen,
//! "Simulation of Wrinkled Surfaces Revisited", 2008, for the tangent frame.
//!
//! One tile of the texture is baked. Charts outside 0..1 are moved into it, as a repeating texture
//! shows them, but never over a chart that lies inside: copies moved away to share texels stay away.

mod ao;
mod band;
mod charts;
mod cover;
mod ground;
mod options;
mod padding;
mod raster;
mod reach;
mod surface;
mod tangents;
mod tree;
mod warnings;

use glam::Vec3;
use rayon::prelude::*;

use crate::error::MeshError;
use crate::mesh::Mesh;
use ao::Sky;
use band::{Band, Job, Tally, Worker, band_rows};
use charts::Layout;
use ground::Ground;
use surface::Surface;

pub use options::{
    DetailMaps, DetailOptions, DetailReport, MAX_GRID, MAX_MAP_SIDE, MAX_SKY_RAYS, NormalSpace, SkyOptions,
};
pub use tangents::tangent_map;

/// Coordinates and distances stay below this, so that their products fit a float.
const MAX_COORDINATE: f32 = 1e15;
/// Rays between two progress reports.
const BATCH_RAYS: usize = 1 << 17;

/// Bakes maps of `detail` on the UVs of `plain`.
///
/// `cage` has the triangles of `plain` in the same order and with the same corners, further out; rays
/// start there. `progress` gets `(done, total)` in rows and answers whether to go on; it runs on the
/// calling thread.
///
/// Texels that no chart reaches, and those where all rays miss, hold the plain surface: the normal
/// (0, 0, 1), or 0 in object space where there is no chart; the height of the plain mesh; an open sky.
///
/// # Errors
/// [`MeshError::Parameter`] for an option out of range, [`MeshError::Arrays`] for coordinates beyond
/// 1e15 or a cage that does not fit, [`MeshError::TooLarge`] for maps that do not fit into memory,
/// [`MeshError::Interrupted`].
pub fn bake_detail(
    plain: &Mesh,
    detail: &Mesh,
    cage: Option<&Mesh>,
    options: &DetailOptions,
    progress: &mut dyn FnMut(usize, usize) -> bool,
) -> Result<DetailMaps, MeshError> {
    options.validate()?;
    for (name, mesh) in [("plain mesh", Some(plain)), ("detailed mesh", Some(detail)), ("cage", cage)] {
        mesh.map_or(Ok(()), |mesh| check_coordinates(name, mesh))?;
    }
    let DetailOptions { width, height, grid, .. } = *options;
    let texels = width * height;
    let up = [0.0, 0.0, if options.space == NormalSpace::Tangent { 1.0 } else { 0.0 }];
    let mut covered = place_for(texels, false)?;
    let normal: Option<Vec<[f32; 3]>> = options.normal.then(|| place_for(texels, up)).transpose()?;
    let mut normal = normal.map(Vec::into_flattened);
    let mut heights = options.heights.then(|| place_for(texels, 0.0_f32)).transpose()?;
    let mut ao = options.sky.map(|_| place_for(texels, 1.0_f32)).transpose()?;

    let layout = Layout::new(plain, width, height, band_rows(grid))?;
    let mut go_on = || progress(0, height);
    let surface = Surface::new(detail, &mut go_on).ok_or(MeshError::Interrupted)?;
    let ground = distances(plain, &surface, cage, options, &mut go_on)?;
    let sky = options.sky.map(|sky| Sky::new(&surface, sky.rays, sky.distance, sky.seed));
    let job = Job { ground, surface, layout, sky, options: *options };

    if let Some(heights) = &mut heights {
        heights.fill(ground.unit(0.0));
    }
    let mut tally = Tally::NOTHING;
    let bands = split(width * band_rows(grid), &mut covered, &mut normal, &mut heights, &mut ao);
    let rays = width * band_rows(grid) * grid * grid * (1 + options.sky.map_or(0, |sky| sky.rays as usize));
    let batch = (BATCH_RAYS / rays).max(2 * rayon::current_num_threads());
    let mut bands = bands.into_iter();
    loop {
        let mut some: Vec<Band<'_>> = bands.by_ref().take(batch).collect();
        let Some(last) = some.last().map(|band| band.index) else { break };
        let found = some.par_iter_mut().map_init(Worker::default, |worker, band| job.bake(band, worker));
        tally = tally.and(found.reduce(|| Tally::NOTHING, Tally::and));
        if !progress(((last + 1) * band_rows(grid)).min(height - 1), height) {
            return Err(MeshError::Interrupted);
        }
    }
    let sources = padding::sources(&covered, width, options.padding);
    for (map, channels) in [(&mut normal, 3), (&mut heights, 1), (&mut ao, 1)] {
        if let Some(map) = map {
            padding::fill(map, channels, &sources);
        }
    }
    let report = warnings::report(&job, &tally);
    if !progress(height, height) {
        return Err(MeshError::Interrupted);
    }
    Ok(DetailMaps { normal, heights, ao, report })
}

/// Where rays start and end.
fn distances<'a>(
    plain: &'a Mesh,
    surface: &Surface<'_>,
    cage: Option<&'a Mesh>,
    options: &DetailOptions,
    mut go_on: impl FnMut() -> bool,
) -> Result<Ground<'a>, MeshError> {
    let mut ground = Ground { mesh: plain, cage, front: 0.0, rear: 0.0, slack: 0.0 };
    let mut found = (options.front.unwrap_or(0.0), options.rear.unwrap_or(0.0));
    if let Some(cage) = cage {
        if cage.indices.len() != plain.indices.len() {
            return Err(MeshError::arrays(format!(
                "the cage has {} triangles, the plain mesh {}; they must be the same ones",
                cage.indices.len(),
                plain.indices.len()
            )));
        }
        found.0 = ground.cage_height();
        found.1 = options.rear.unwrap_or(found.0);
    } else if options.front.is_none() || options.rear.is_none() {
        let measured = reach::measured(plain, surface, &mut go_on).ok_or(MeshError::Interrupted)?;
        found = (options.front.unwrap_or(measured.0), options.rear.unwrap_or(measured.1));
    }
    if found.0 + found.1 <= 0.0 {
        return Err(MeshError::Parameter {
            name: "front + rear",
            value: "0".to_owned(),
            expected: "expected more than 0 mesh units: rays need a length",
        });
    }
    (ground.front, ground.rear) = found;
    ground.slack = ground.slack_of(found.0 + found.1);
    Ok(ground)
}

/// Cuts the maps into bands of `texels`.
fn split<'a>(
    texels: usize,
    covered: &'a mut [bool],
    normal: &'a mut Option<Vec<f32>>,
    heights: &'a mut Option<Vec<f32>>,
    ao: &'a mut Option<Vec<f32>>,
) -> Vec<Band<'a>> {
    let mut normal = normal.as_mut().map(|map| map.chunks_mut(texels * 3));
    let mut heights = heights.as_mut().map(|map| map.chunks_mut(texels));
    let mut ao = ao.as_mut().map(|map| map.chunks_mut(texels));
    let bands = covered.chunks_mut(texels).enumerate();
    bands
        .map(|(index, covered)| Band {
            index,
            covered,
            normal: normal.as_mut().and_then(Iterator::next),
            heights: heights.as_mut().and_then(Iterator::next),
            ao: ao.as_mut().and_then(Iterator::next),
        })
        .collect()
}

/// Fails unless every coordinate is small enough to be computed with.
fn check_coordinates(name: &str, mesh: &Mesh) -> Result<(), MeshError> {
    let fits = |p: &Vec3| p.abs().max_element() < MAX_COORDINATE;
    match mesh.positions.iter().position(|p| !fits(p)) {
        Some(vertex) => Err(MeshError::arrays(format!(
            "{name}: vertex {vertex} is at {}; coordinates below 1e15 can be baked",
            mesh.positions[vertex]
        ))),
        None => Ok(()),
    }
}

/// Memory for a map, or the number of bytes that could not be had.
fn place_for<T: Clone + Send>(count: usize, value: T) -> Result<Vec<T>, MeshError> {
    let mut place = Vec::new();
    place
        .try_reserve_exact(count)
        .map_err(|_| MeshError::NoMemory { what: "the map", bytes: count as u64 * size_of::<T>() as u64 })?;
    // By all threads: most of the time goes into the first touch of each page.
    place.par_extend(rayon::iter::repeat_n(value, count).with_min_len(1 << 16));
    Ok(place)
}
