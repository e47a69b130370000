//! Distance maps as the search reads them.

use glam::Vec3;

use crate::{HeightField, HeightFieldError};

/// Largest code of a distance.
const CODES: f32 = 65535.0;

/// Lower bounds of the distance to the bilinear surface, one for each voxel: a texel's footprint and one of
/// `depth` equal slices of the height, lowest first. They hold wherever in its voxel a point is.
///
/// Distances are kept as 16-bit multiples of one unit, rounded down.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceMap {
    size: [usize; 3],
    metric: Vec3,
    unit: f32,
    codes: Vec<u16>,
}

impl DistanceMap {
    /// Takes `depth` slices of one distance a texel of `field`, row by row, in the mesh units of its
    /// extent.
    ///
    /// # Errors
    /// [`HeightFieldError::BakedLength`] and, for a distance that is negative or not finite,
    /// [`HeightFieldError::BakedValue`].
    pub fn new(field: &HeightField, depth: usize, distances: &[f32]) -> Result<Self, HeightFieldError> {
        let (width, height) = (field.width(), field.height());
        let expected = width * height * depth;
        if depth == 0 || distances.len() != expected {
            return Err(HeightFieldError::BakedLength {
                map: "distance",
                width,
                height,
                expected,
                got: distances.len(),
            });
        }
        if let Some(at) = distances.iter().position(|d| !(d.is_finite() && *d >= 0.0)) {
            let (row, column) = (at / width % height, at % width);
            return Err(HeightFieldError::BakedValue { map: "distance", row, column, value: distances[at] });
        }
        let extent = field.extent();
        let unit = distances.iter().copied().fold(0.0, f32::max) / CODES;
        let code = |distance: f32| {
            let code = if unit > 0.0 { (distance / unit).min(CODES) as u16 } else { 0 };
            // The quotient may have been rounded up to the next whole number.
            if f32::from(code) * unit > distance { code - 1 } else { code }
        };
        Ok(Self {
            size: [width, height, depth],
            metric: Vec3::new(extent.tile_size[0], extent.tile_size[1], extent.scale),
            unit,
            codes: distances.iter().map(|&distance| code(distance)).collect(),
        })
    }

    /// Voxels along u, v and the height.
    #[inline(always)]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The length of one unit of u, v and height, in mesh units: the metric of the distances.
    #[inline(always)]
    pub fn metric(&self) -> Vec3 {
        self.metric
    }

    /// What code 1 stands for, in mesh units.
    #[inline(always)]
    pub fn unit(&self) -> f32 {
        self.unit
    }

    /// All codes, slice by slice, row by row.
    #[inline(always)]
    pub fn codes(&self) -> &[u16] {
        &self.codes
    }

    /// The distance of voxel `(i, j, k)`.
    #[inline(always)]
    pub fn distance(&self, i: usize, j: usize, k: usize) -> f32 {
        f32::from(self.codes[(k * self.size[1] + j) * self.size[0] + i]) * self.unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wrap;

    #[test]
    fn no_distance_comes_back_larger() {
        let field = HeightField::new(&[0.5; 4096], 64, 64, Wrap::Repeat).unwrap();
        let mut state = 7_u32;
        let distances: Vec<f32> = (0..8192)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 * 3.1e-8
            })
            .collect();
        let map = DistanceMap::new(&field, 2, &distances).unwrap();
        for (at, &distance) in distances.iter().enumerate() {
            let kept = map.distance(at % 64, at / 64 % 64, at / 4096);
            assert!(kept <= distance && distance - kept <= 1.01 * map.unit(), "{kept} {distance}");
        }
        assert!(DistanceMap::new(&field, 2, &distances[1..]).is_err());
        assert!(DistanceMap::new(&field, 1, &[f32::NAN; 4096]).is_err());
        assert_eq!(DistanceMap::new(&field, 1, &[0.0; 4096]).unwrap().distance(1, 1, 0), 0.0);
    }
}
