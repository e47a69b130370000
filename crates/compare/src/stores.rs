//! The height field as each format stores it, with the maps that techniques read.

use bake::Progress;
use heightfield::{BakedMap, ConeKind, ConeMap, HeightField};

use crate::setting::{Format, Setting};
use crate::{CompareError, DeviceMarch};

/// One stored form of the heights, and one of the cones that belong to them.
struct Stored {
    heights: Format,
    cones: Format,
    field: HeightField,
}

/// A height field and its rounded copies, made when they are first asked for.
pub struct Stores<'a> {
    original: &'a HeightField,
    copies: Vec<Stored>,
    /// Ratios by the format of the heights they were baked from.
    ratios: Vec<(Format, ConeKind, Vec<f32>)>,
}

impl<'a> Stores<'a> {
    /// Nothing but the original.
    pub fn new(original: &'a HeightField) -> Self {
        Self { original, copies: Vec::new(), ratios: Vec::new() }
    }

    /// The original.
    pub fn original(&self) -> &'a HeightField {
        self.original
    }

    /// The field that a setting marches; [`Self::prepare`] made it. The original for one that was not
    /// prepared.
    pub fn field(&self, setting: &Setting) -> &HeightField {
        let found = |stored: &&Stored| stored.heights == setting.heights && stored.cones == setting.cones;
        self.copies.iter().find(found).map_or(self.original, |stored| &stored.field)
    }

    /// Makes the copy and bakes the maps that a setting reads.
    ///
    /// # Errors
    /// What keeps a map from being baked, [`CompareError::Interrupted`].
    pub fn prepare(
        &mut self,
        setting: &Setting,
        progress: &mut dyn FnMut(usize, usize) -> bool,
    ) -> Result<(), CompareError> {
        let known = |s: &Stored| s.heights == setting.heights && s.cones == setting.cones;
        if !setting.is_plain() && !self.copies.iter().any(known) {
            let field = rounded(self.original, setting.heights)?;
            self.copies.push(Stored { heights: setting.heights, cones: setting.cones, field });
        }
        for &map in setting.technique.info.reads.baked() {
            if self.field(setting).has(map) {
                continue;
            }
            match map {
                BakedMap::Cone(kind) => self.attach_cones(setting, kind, progress)?,
                BakedMap::Distance => bake::provide(self.field(setting), map, Progress::new(progress))?,
            }
        }
        Ok(())
    }

    fn attach_cones(
        &mut self,
        setting: &Setting,
        kind: ConeKind,
        progress: &mut dyn FnMut(usize, usize) -> bool,
    ) -> Result<(), CompareError> {
        let at = match self.ratios.iter().position(|known| known.0 == setting.heights && known.1 == kind) {
            Some(at) => at,
            None => {
                let field = self.field(setting);
                let ratios = bake::cone_ratios(field, kind, Progress::new(progress))?;
                self.ratios.push((setting.heights, kind, ratios));
                self.ratios.len() - 1
            }
        };
        let stored: Vec<f32> = self.ratios[at].2.iter().map(|&ratio| setting.cones.below(ratio)).collect();
        let field = self.field(setting);
        field.attach_cone_map(ConeMap::new(field, kind, &stored)?);
        Ok(())
    }
}

/// The field with its texels as the format stores them.
fn rounded(field: &HeightField, format: Format) -> Result<HeightField, CompareError> {
    let texels: Vec<f32> = field.texels().into_iter().map(|h| format.nearest(h)).collect();
    let copy = HeightField::new(&texels, field.width(), field.height(), field.wrap())?;
    Ok(copy.with_extent(*field.extent())?)
}

/// Marches on the device what a setting reads.
pub(crate) fn device_march(
    device: &dyn DeviceMarch,
    stores: &Stores<'_>,
    setting: &Setting,
    rays: &crate::Rays,
) -> Result<(heightfield::Hits, f64), CompareError> {
    device.march(stores.field(setting), &setting.technique, rays).map_err(CompareError::Device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bake::ConeMode;
    use heightfield::{Technique, Wrap};

    #[test]
    fn stored_cones_are_never_wider_and_belong_to_the_stored_heights() {
        let mut random = crate::rays::Random::new(5, 5);
        let texels: Vec<f32> = (0..24 * 16).map(|_| random.unit() as f32).collect();
        let field = HeightField::new(&texels, 24, 16, Wrap::Repeat).unwrap();
        let plain = Setting::from(Technique::named("cone").unwrap());
        let small = plain.stored(Format::R16Unorm, Format::R8Unorm);
        let mut stores = Stores::new(&field);
        stores.prepare(&small, &mut |_, _| true).unwrap();
        let stored = stores.field(&small);
        for (a, b) in stored.texels().iter().zip(&texels) {
            assert!((a - b).abs() <= 0.5 / 65535.0 + 1e-7);
        }
        let fine = bake::cone_map(stored, ConeMode::Conservative, Progress::none()).unwrap();
        let fine = ConeMap::new(stored, ConeKind::Cone, &fine).unwrap();
        let coarse = stored.cone_map(ConeKind::Cone).unwrap();
        let narrower = coarse.values().iter().zip(fine.values()).map(|(a, b)| b - a);
        assert!(narrower.clone().all(|gap| (0.0..=1.01 / 255.0).contains(&gap)));
        assert!(narrower.sum::<f32>() > 0.0);
        assert!(!field.has(BakedMap::Cone(ConeKind::Cone)), "the original was not asked for");
    }
}
