//! Baking what searches read, and attaching it to the height field. What was baked before, by whatever
//! process, comes out of the [cache](crate::cache).

use heightfield::technique::Reads;
use heightfield::{BakedMap, ConeKind, ConeMap, DistanceMap, HeightField};

use crate::cache::bake_cached;
use crate::maps::{Map, Value};
use crate::{BakeError, Progress, cone, distance};

/// Bakes all maps that a search reads and attaches those that the field does not have yet.
///
/// # Errors
/// As [`provide`].
pub fn provide_for(field: &HeightField, reads: Reads, mut progress: Progress<'_>) -> Result<(), BakeError> {
    let missing: Vec<BakedMap> = reads.baked().iter().copied().filter(|&map| !field.has(map)).collect();
    let of = missing.len();
    for (at, map) in missing.into_iter().enumerate() {
        let mut part = |done: usize, total: usize| progress.report(at * total + done, of * total).is_ok();
        provide(field, map, Progress::new(&mut part))?;
    }
    Ok(())
}

/// Bakes a map, or takes it out of the cache, and attaches it to the field, unless the field has it already.
///
/// # Errors
/// [`BakeError::Memory`] before anything is allocated, [`BakeError::Interrupted`].
pub fn provide(field: &HeightField, map: BakedMap, progress: Progress<'_>) -> Result<(), BakeError> {
    if field.has(map) {
        return Ok(());
    }
    match map {
        BakedMap::Cone(kind) => {
            field.attach_cone_map(ConeMap::new(field, kind, &cone_ratios(field, kind, progress)?)?);
        }
        BakedMap::Distance => {
            let recipe = &distance::DISTANCE;
            let baked = bake_cached(field, recipe, &recipe.info.defaults(), progress)?;
            for layer in baked.layers {
                field.attach_distance_map(DistanceMap::new(field, layer.depth, &layer.texels)?);
            }
        }
    }
    Ok(())
}

/// Cone ratios, UV per unit height, as they are baked: row by row, not yet as a search stores them.
///
/// # Errors
/// As [`provide`].
pub fn cone_ratios(
    field: &HeightField,
    kind: ConeKind,
    progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let (recipe, mode) = recipe(kind);
    let options = recipe.info.defaults().with("mode", Value::Choice(mode.to_owned()))?;
    let baked = bake_cached(field, recipe, &options, progress)?;
    Ok(baked.layers.into_iter().flat_map(|layer| layer.texels).collect())
}

fn recipe(kind: ConeKind) -> (&'static Map, &'static str) {
    match kind {
        ConeKind::Cone => (&cone::CONE, "conservative"),
        ConeKind::ConeTexel => (&cone::CONE, "texel"),
        ConeKind::RelaxedCone => (&cone::RELAXED_CONE, "conservative"),
        ConeKind::RelaxedConeTexel => (&cone::RELAXED_CONE, "texel"),
    }
}
