//! Relief maps: normal and height in one texture.
//!
//! Red, green and blue hold the normal, alpha the height, as in Policarpo, Oliveira and Comba 2005,
//! "Real-time relief mapping on arbitrary polygonal surfaces". Alpha is the height itself (1 high),
//! not the depth of that paper.

use heightfield::HeightField;

use crate::encode::Range;
use crate::maps::{Channel, Form, Map, MapInfo, Plan};
use crate::normal::{Factors, Normals, OPTIONS, settings, single};
use crate::{BakeError, Convention, Kernel, Progress};

/// Normal x, y, z and height.
pub static RELIEF: Map = Map {
    info: MapInfo {
        name: "relief",
        summary: "unit normal x, y, z in -1..1 and height in 0..1",
        source: "Policarpo, Oliveira, Comba 2005",
        version: 2,
        costly: false,
        form: Form::Single,
        channels: &[
            Channel::fixed("x", Range::SIGNED),
            Channel::fixed("y", Range::SIGNED),
            Channel::fixed("z", Range::SIGNED),
            Channel::fixed("height", Range::UNIT),
        ],
        options: OPTIONS,
    },
    plan: |grid, _| Plan::single(grid),
    bake: |field, options, progress| {
        let (kernel, convention) = settings(options)?;
        single(field, relief_map(field, kernel, convention, progress)?)
    },
};

/// The relief map, `height * width * 4` floats: normal x, y, z in -1..1, height in 0..1.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn relief_map(
    field: &HeightField,
    kernel: Kernel,
    convention: Convention,
    progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    Normals::<f32, 4>::new(Factors::of(field, convention)).bake(field, kernel, progress)
}
