//! What the fuzz targets do with bytes; `crates/compare/tests/fuzz_bodies.rs` replays it as ordinary tests.
//! Whatever the bytes say, nothing may panic or hang, and what comes back must make sense.

#![allow(dead_code, reason = "each target takes one of them")]

use bake::{Progress, decode_image};
use heightfield::{Extent, HeightField, MarchOptions, RayArray, Technique, Wrap, march as march_rays};

/// Numbers out of bytes; zeros at the end.
struct Bytes<'a>(std::slice::Iter<'a, u8>);

impl Bytes<'_> {
    fn byte(&mut self) -> u8 {
        self.0.next().copied().unwrap_or(0)
    }

    /// Any float there is, or a tame one: bits alone would be huge or NaN most of the time.
    fn float(&mut self) -> f32 {
        match self.byte() % 4 {
            0 => f32::from_bits(u32::from_le_bytes(std::array::from_fn(|_| self.byte()))),
            1 => f32::from(self.byte()) / 255.0,
            2 => f32::from(self.byte() as i8) / 16.0,
            _ => f32::from(self.byte() as i8) * 1.0e4,
        }
    }

    fn height(&mut self) -> f32 {
        match self.byte() % 8 {
            0 => self.float(),
            1 => f32::from_bits(u32::from(self.byte())),
            2 => 1.0,
            _ => f32::from(self.byte()) / 255.0,
        }
    }

    fn field(&mut self) -> Option<HeightField> {
        let (width, height) = (usize::from(self.byte() % 10), usize::from(self.byte() % 10));
        let wrap = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror][usize::from(self.byte() % 3)];
        let extent = match self.byte() % 3 {
            0 => Extent { scale: self.float(), base: self.float(), tile_size: [self.float(), self.float()] },
            _ => Extent::default(),
        };
        let texels: Vec<f32> = (0..width * height).map(|_| self.height()).collect();
        HeightField::new(&texels, width, height, wrap).ok()?.with_extent(extent).ok()
    }
}

/// Rays of any kind through a map of any kind, by every technique.
pub fn march(data: &[u8]) {
    let mut bytes = Bytes(data.iter());
    let Some(field) = bytes.field() else { return };
    let rays: Vec<f32> = (0..24).map(|_| bytes.float()).collect();
    let (origins, directions) = rays.split_at(12);
    for info in Technique::all() {
        let Ok(technique) = Technique::named(info.name) else { continue };
        if bake::provide_for(&field, info.reads, Progress::none()).is_err() {
            continue;
        }
        let (origins, directions) = (RayArray::F32(origins), RayArray::F32(directions));
        let Ok(hits) = march_rays(&field, &technique, origins, directions, &MarchOptions::default()) else {
            continue;
        };
        let (Some(t), Some(z), Some(status)) = (hits.t, hits.z, hits.status) else { continue };
        for i in 0..t.len() {
            assert!(status[i] <= 2, "{}: status {}", info.name, status[i]);
            assert!(!t[i].is_nan(), "{}: t is NaN", info.name);
            // So far along a ray a hit's parameter may be beyond what 32 bits hold.
            let held = (origins.get(i)[2].abs() + 1.0) / directions.get(i)[2].abs() < 1e37;
            if held {
                assert_eq!(
                    status[i] == 0,
                    t[i].is_finite(),
                    "{}: status {} at {}",
                    info.name,
                    status[i],
                    t[i]
                );
            }
            if status[i] == 0 {
                // A ray that starts below the surface is said to hit at once.
                let ray: [_; 2] = [origins.get(i), directions.get(i)];
                let floor = ray[0][2].min(0.0) as f32 - 1e-5;
                assert!((floor..=1.0 + 1e-5).contains(&z[i]), "{}: z is {} on {ray:?}", info.name, z[i]);
            }
        }
    }
}

/// Every map of a height map of any kind: an error, or finite numbers.
pub fn bake(data: &[u8]) {
    let mut bytes = Bytes(data.iter());
    let Some(field) = bytes.field() else { return };
    for map in bake::maps::REGISTRY {
        let Ok(made) = bake::maps::bake(&field, map, &map.info.defaults(), Progress::none()) else {
            continue;
        };
        for layer in made.layers {
            // Slopes of absurd extents may exceed what 32 bits hold; they must not be NaN.
            assert!(layer.texels.iter().all(|x| !x.is_nan()), "{} has a NaN", map.info.name);
        }
    }
}

/// An image file of any bytes.
pub fn read(data: &[u8]) {
    if let Ok(image) = decode_image(data) {
        assert!(image.width > 0 && image.height > 0);
    }
}
