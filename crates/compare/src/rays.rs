//! Seeded rays: the same seed gives the same rays on every machine.

use heightfield::{Extent, HeightField};

use crate::CompareError;

/// Most texels that a ray may cross between the lid and the floor. Flatter rays say nothing about a
/// technique: all of them run out of steps there.
pub const MAX_TEXELS: f64 = 131_072.0;

/// Rays in texture space, stored in `f32` so that CPU, device and reference start from equal numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rays {
    /// Origins, `N * 3`: `u`, `v`, `z`.
    pub origins: Vec<f32>,
    /// Directions, `N * 3`, not normalised.
    pub directions: Vec<f32>,
}

impl Rays {
    /// Number of rays.
    pub fn len(&self) -> usize {
        self.origins.len() / 3
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.origins.is_empty()
    }

    /// Origin of ray `i`.
    #[inline]
    pub fn origin(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(self.origins[3 * i + axis]))
    }

    /// Direction of ray `i`.
    #[inline]
    pub fn direction(&self, i: usize) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(self.directions[3 * i + axis]))
    }

    /// Point of ray `i` at parameter `t`.
    #[inline]
    pub fn at(&self, i: usize, t: f64) -> [f64; 3] {
        let (o, d) = (self.origin(i), self.direction(i));
        std::array::from_fn(|axis| d[axis].mul_add(t, o[axis]))
    }
}

/// A small counter-based generator (SplitMix64, Steele, Lea and Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A stream for this seed; `stream` separates uses of one seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = Self(seed ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        random.next_u64();
        random
    }

    fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// Uniform in 0..1, 1 excluded.
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Lateral UV distance per unit of height for a direction at this azimuth and elevation.
///
/// `elevation_deg` is measured in mesh units above the mean plane, so it goes through the relief's
/// scale and tile size. A relief without height (`scale = 0`) is met straight below the origin from
/// any elevation.
pub fn lateral_per_height(extent: &Extent, azimuth_rad: f64, elevation_deg: f64) -> [f64; 2] {
    if elevation_deg >= 90.0 {
        return [0.0, 0.0];
    }
    let run = f64::from(extent.scale) / elevation_deg.to_radians().tan();
    let (sin, cos) = azimuth_rad.sin_cos();
    [run * cos / f64::from(extent.tile_size[0]), run * sin / f64::from(extent.tile_size[1])]
}

/// `count` rays from random points of the tile on the lid, at random azimuths, downwards.
///
/// Directions have a `z` of -1, so `t` is the drop below the lid, 0 to 1.
///
/// # Errors
/// [`CompareError::Setting`] unless `0 < elevation_deg <= 90` and a ray crosses at most
/// [`MAX_TEXELS`] texels, and for no rays at all.
pub fn planar(
    field: &HeightField,
    elevation_deg: f64,
    count: usize,
    seed: u64,
) -> Result<Rays, CompareError> {
    check_elevation(field, elevation_deg)?;
    let extent = field.extent();
    if count == 0 {
        return Err(CompareError::setting("rays", 0, "at least one ray is needed"));
    }
    let mut random = Random::new(seed, elevation_deg.to_bits());
    let mut rays = Rays { origins: Vec::with_capacity(3 * count), directions: Vec::with_capacity(3 * count) };
    for _ in 0..count {
        rays.origins.extend([random.unit() as f32, random.unit() as f32, 1.0]);
        let [u, v] = lateral_per_height(extent, random.unit() * std::f64::consts::TAU, elevation_deg);
        rays.directions.extend([u as f32, v as f32, -1.0]);
    }
    Ok(rays)
}

fn check_elevation(field: &HeightField, elevation_deg: f64) -> Result<(), CompareError> {
    if !(elevation_deg > 0.0 && elevation_deg <= 90.0) {
        return Err(CompareError::setting(
            "elevation",
            elevation_deg,
            "it must be above 0 and at most 90 degrees",
        ));
    }
    let [u, _] = lateral_per_height(field.extent(), 0.0, elevation_deg);
    let [_, v] = lateral_per_height(field.extent(), std::f64::consts::FRAC_PI_2, elevation_deg);
    let texels = (u * field.width() as f64).max(v * field.height() as f64);
    if texels > MAX_TEXELS {
        return Err(CompareError::setting(
            "elevation",
            elevation_deg,
            format!(
                "with this scale and tile size a ray would cross {texels:.3e} texels; at most {MAX_TEXELS:.0}"
            ),
        ));
    }
    Ok(())
}

/// Directions towards four lights at elevations of 60, 45, 30 and 15 degrees, azimuths by seed.
/// Texture space, `z` = 1.
pub fn lights(extent: &Extent, seed: u64) -> [[f64; 3]; 4] {
    let mut random = Random::new(seed, 0x6c69_6768_7473);
    [60.0, 45.0, 30.0, 15.0].map(|elevation| {
        let [u, v] = lateral_per_height(extent, random.unit() * std::f64::consts::TAU, elevation);
        [u, v, 1.0]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::Wrap;

    fn flat(extent: Extent) -> HeightField {
        HeightField::new(&[0.5; 4], 2, 2, Wrap::Repeat).unwrap().with_extent(extent).unwrap()
    }

    #[test]
    fn elevation_is_measured_in_mesh_units() {
        let extent = Extent { scale: 0.25, base: 1.0, tile_size: [2.0, 0.5] };
        let rays = planar(&flat(extent), 20.0, 500, 7).unwrap();
        for i in 0..rays.len() {
            let [u, v, z] = rays.direction(i);
            let lateral = (u * 2.0).hypot(v * 0.5);
            let elevation = (-z * 0.25).atan2(lateral).to_degrees();
            assert!((elevation - 20.0).abs() < 1e-4, "{elevation}");
            assert!(
                (f64::from(extent.cos_theta(rays.direction(i))) - 20_f64.to_radians().sin()).abs() < 1e-6
            );
        }
    }

    #[test]
    fn the_seed_fixes_the_rays() {
        let field = flat(Extent::default());
        assert_eq!(planar(&field, 10.0, 64, 1).unwrap(), planar(&field, 10.0, 64, 1).unwrap());
        assert_ne!(planar(&field, 10.0, 64, 1).unwrap(), planar(&field, 10.0, 64, 2).unwrap());
        assert_ne!(
            planar(&field, 10.0, 64, 1).unwrap().origins,
            planar(&field, 20.0, 64, 1).unwrap().origins
        );
    }

    #[test]
    fn origins_cover_the_tile_evenly() {
        let rays = planar(&flat(Extent::default()), 90.0, 10_000, 3).unwrap();
        let mean: f32 = rays.origins.chunks(3).map(|o| o[0] + o[1]).sum::<f32>() / 1e4;
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        assert!(rays.origins.chunks(3).all(|o| (0.0..=1.0).contains(&o[0]) && o[2] == 1.0));
        assert!(rays.directions.chunks(3).all(|d| d == [0.0, 0.0, -1.0]));
    }

    #[test]
    fn a_relief_without_height_is_met_straight_below() {
        let extent = Extent { scale: 0.0, ..Extent::default() };
        let rays = planar(&flat(extent), 5.0, 4, 3).unwrap();
        assert!(rays.directions.chunks(3).all(|d| d == [0.0, 0.0, -1.0]));
    }

    #[test]
    fn senseless_settings_are_refused() {
        let field = flat(Extent::default());
        for elevation in [0.0, -5.0, 90.1, f64::NAN, 1e-9] {
            assert!(planar(&field, elevation, 4, 3).is_err(), "{elevation}");
        }
        assert!(planar(&field, 45.0, 0, 3).is_err());
        let deep = flat(Extent { scale: 1e6, ..Extent::default() });
        assert!(planar(&deep, 5.0, 4, 3).is_err());
    }
}
