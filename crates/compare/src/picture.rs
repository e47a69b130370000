//! Small pictures of a height map as a technique sees it, made on the CPU: a camera over the plane,
//! looking up the image, so that one picture holds steep and grazing views.

use bake::Progress;
use glam::{DVec3, Vec3};
use heightfield::{HeightField, MarchOptions, OutputSet, RayArray, Segment, Status, Technique, march};
use rayon::prelude::*;

use crate::run::reported;
use crate::{CompareError, RayErrors, Rays, Reference, reference};

/// Elevation of the middle of the picture, degrees.
const PITCH_DEG: f64 = 30.0;
/// Vertical field of view, degrees; the top row still looks down.
const FOV_Y_DEG: f64 = 40.0;
/// Distance to the middle of the picture, in tiles along `u`.
const DISTANCE_TILES: f64 = 0.9;
/// Colour samples a pixel along each axis.
const SUPERSAMPLE: usize = 2;
/// Direction towards the light: x right, y up the image, z out.
const LIGHT: DVec3 = DVec3::new(-0.62, 0.36, 0.70);
/// Colours of the lowest and the highest point, linear.
const LOW: Vec3 = Vec3::new(0.16, 0.13, 0.11);
const HIGH: Vec3 = Vec3::new(0.72, 0.62, 0.50);

/// A picture and where it is wrong.
#[derive(Debug, Clone)]
pub struct Picture {
    /// Columns and rows.
    pub size: [usize; 2],
    /// sRGB, `rows * columns * 3`.
    pub rgb: Vec<u8>,
    /// Distance of the hit from the exact one in texels at each pixel's centre; NaN where nothing was
    /// reported.
    pub error_texels: Vec<f32>,
    /// Height reads of the ray through each pixel's centre.
    pub steps: Vec<f32>,
}

/// The view of a map, with the exact answers of its pixels, shared by the pictures of all techniques.
#[derive(Debug, Clone)]
pub struct View {
    size: [usize; 2],
    centres: Rays,
    samples: Rays,
    reference: Reference,
}

impl View {
    /// Sets the camera up and finds the exact surface at every pixel's centre.
    ///
    /// # Errors
    /// [`CompareError::Setting`] unless both sides are in 1..4096.
    pub fn new(field: &HeightField, size: [usize; 2]) -> Result<Self, CompareError> {
        for side in size {
            if !(1..=4096).contains(&side) {
                return Err(CompareError::setting("picture size", side, "each side must be in 1..4096"));
            }
        }
        let centres = camera_rays(field, size);
        let samples = camera_rays(field, size.map(|side| side * SUPERSAMPLE));
        let reference = Reference::new(field, &centres, &[]);
        Ok(Self { size, centres, samples, reference })
    }

    /// The picture that a technique makes. Maps that it reads are baked when the field lacks them.
    ///
    /// # Errors
    /// Whatever [`march`] refuses, or what keeps a map from being baked.
    pub fn picture(&self, field: &HeightField, technique: &Technique) -> Result<Picture, CompareError> {
        bake::provide_for(field, technique.info.reads, Progress::none())?;
        let all = MarchOptions::default();
        let hits = cast(field, technique, &self.centres, &all)?;
        let errors = RayErrors::measure(field, &self.centres, &self.reference, &reported(&hits))?;
        let mut error_texels = vec![f32::NAN; self.centres.len()];
        let measured = (0..self.centres.len()).filter(|&i| self.reference.truths[i].hit);
        for (i, error) in measured.zip(errors.uv_texels) {
            error_texels[i] = error;
        }
        let steps = hits.steps.unwrap_or_default().into_iter().map(|steps| steps as f32).collect();
        Ok(Picture { size: self.size, rgb: self.shade(field, technique)?, error_texels, steps })
    }

    fn shade(&self, field: &HeightField, technique: &Technique) -> Result<Vec<u8>, CompareError> {
        let outputs = OutputSet::UV | OutputSet::Z | OutputSet::NORMAL | OutputSet::STATUS;
        let hits =
            cast(field, technique, &self.samples, &MarchOptions { outputs, ..MarchOptions::default() })?;
        let hit = reported(&hits);
        let colours: Vec<Vec3> = (0..self.samples.len())
            .into_par_iter()
            .map(|i| {
                let (Some(status), Some(n)) = (hit.status, hit.normal) else { return Vec3::ZERO };
                if status[i] != Status::Hit as u8 {
                    return Vec3::ZERO;
                }
                let position = [hit.uv[2 * i], hit.uv[2 * i + 1], hit.z[i]];
                lit(field, technique, position.map(f64::from), [n[3 * i], n[3 * i + 1], n[3 * i + 2]])
            })
            .collect();
        let width = self.size[0] * SUPERSAMPLE;
        let mut rgb = Vec::with_capacity(self.size[0] * self.size[1] * 3);
        for y in 0..self.size[1] {
            for x in 0..self.size[0] {
                let mut sum = Vec3::ZERO;
                for row in 0..SUPERSAMPLE {
                    let at = (y * SUPERSAMPLE + row) * width + x * SUPERSAMPLE;
                    sum += colours[at..at + SUPERSAMPLE].iter().sum::<Vec3>();
                }
                rgb.extend((sum / (SUPERSAMPLE * SUPERSAMPLE) as f32).to_array().map(srgb));
            }
        }
        Ok(rgb)
    }
}

fn cast(
    field: &HeightField,
    technique: &Technique,
    rays: &Rays,
    options: &MarchOptions<'_>,
) -> Result<heightfield::Hits, CompareError> {
    Ok(march(field, technique, RayArray::F32(&rays.origins), RayArray::F32(&rays.directions), options)?)
}

/// One ray a pixel, from the lid down, `z` of the direction -1.
fn camera_rays(field: &HeightField, size: [usize; 2]) -> Rays {
    let extent = field.extent();
    let tile = extent.tile_size.map(f64::from);
    let scale = f64::from(extent.scale);
    let (sin, cos) = PITCH_DEG.to_radians().sin_cos();
    let forward = DVec3::new(0.0, cos, -sin);
    let up = DVec3::new(0.0, sin, cos);
    let eye = DVec3::new(0.5 * tile[0], 0.5 * tile[1], 0.0) - forward * DISTANCE_TILES * tile[0];
    let reach = (0.5 * FOV_Y_DEG).to_radians().tan();
    let aspect = size[0] as f64 / size[1] as f64;
    let mut rays = Rays::default();
    for y in 0..size[1] {
        for x in 0..size[0] {
            let sx = (2.0 * (x as f64 + 0.5) / size[0] as f64 - 1.0) * reach * aspect;
            let sy = (1.0 - 2.0 * (y as f64 + 0.5) / size[1] as f64) * reach;
            let direction = forward + DVec3::X * sx + up * sy;
            let lid = eye + direction * (-eye.z / direction.z);
            rays.origins.extend([(lid.x / tile[0]) as f32, 1.0 - (lid.y / tile[1]) as f32, 1.0]);
            let run = scale / -direction.z;
            rays.directions.extend([
                (direction.x * run / tile[0]) as f32,
                (-direction.y * run / tile[1]) as f32,
                -1.0,
            ]);
        }
    }
    rays
}

/// Diffuse light with the technique's own shadows, linear.
fn lit(field: &HeightField, technique: &Technique, position: [f64; 3], normal_uvz: [f32; 3]) -> Vec3 {
    let [x, y, z] = normal_uvz.map(f64::from);
    let normal = DVec3::from(reference::normal(field.extent(), [-x / z, -y / z]));
    let light = LIGHT.normalize();
    let facing = normal.dot(light);
    let albedo = LOW.lerp(HIGH, position[2] as f32);
    let lit = facing > 0.0 && !in_shadow(field, technique, position, light);
    let ambient = 0.30 + 0.10 * normal.z as f32;
    albedo * (ambient + if lit { 1.15 * facing as f32 } else { 0.0 })
}

fn in_shadow(field: &HeightField, technique: &Technique, position: [f64; 3], light: DVec3) -> bool {
    if !technique.info.casts_shadows {
        return false;
    }
    let extent = field.extent();
    let run = f64::from(extent.scale) / light.z;
    let [tile_u, tile_v] = extent.tile_size.map(f64::from);
    let towards = [light.x * run / tile_u, -light.y * run / tile_v, 1.0];
    let cos_theta = extent.cos_theta(towards);
    // A hit just above or below the surface must not shadow itself.
    let start = [position[0], position[1], field.height_at(position[0], position[1])];
    Segment::clip(start, towards, cos_theta, heightfield::march::period(field.wrap()))
        .is_some_and(|s| technique.occluded(field, s.start, s.delta, cos_theta))
}

fn srgb(linear: f32) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}
