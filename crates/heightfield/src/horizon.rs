//! Horizon maps as shading reads them: is a light above what stands around a point?

use std::f32::consts::TAU;

use crate::{HeightField, HeightFieldError, Wrap};

/// Sines of the horizon's elevation around each texel of a height field, one slice an azimuth.
///
/// Azimuth `k` of `n` looks along `(cos a, sin a)`, `a = 2 pi k / n`, x right and y **up** the image, in
/// the mesh space of the field's extent.
#[derive(Debug, Clone, PartialEq)]
pub struct HorizonMap {
    size: [usize; 2],
    azimuths: usize,
    wrap: Wrap,
    sines: Vec<f32>,
}

impl HorizonMap {
    /// Takes `azimuths` slices of one sine a texel of `field`, row by row.
    ///
    /// # Errors
    /// [`HeightFieldError::Length`] when that is not their number.
    pub fn new(field: &HeightField, azimuths: usize, sines: Vec<f32>) -> Result<Self, HeightFieldError> {
        let (width, height) = (field.width(), field.height());
        let expected = azimuths * width * height;
        if azimuths == 0 || sines.len() != expected {
            return Err(HeightFieldError::Length { width, height, expected, got: sines.len() });
        }
        Ok(Self { size: [width, height], azimuths, wrap: field.wrap(), sines })
    }

    /// Slices.
    pub fn azimuths(&self) -> usize {
        self.azimuths
    }

    /// All sines, slice by slice, row by row.
    pub fn sines(&self) -> &[f32] {
        &self.sines
    }

    /// The horizon at a point towards a direction of mesh space, interpolated between texels and
    /// azimuths. The twin of `horizon_sine` in `shaders_wgsl/shading/shadow_horizon.wgsl`.
    pub fn sine_at(&self, uv: [f32; 2], [x, y]: [f32; 2]) -> f32 {
        let turns = y.atan2(x) / TAU;
        let place = (turns - turns.floor()) * self.azimuths as f32;
        let before = place.floor();
        let slice = before as usize % self.azimuths;
        let (a, b) = (self.sample(slice, uv), self.sample((slice + 1) % self.azimuths, uv));
        a + (b - a) * (place - before)
    }

    fn sample(&self, slice: usize, uv: [f32; 2]) -> f32 {
        let [w, h] = self.size;
        let (x, y) = (uv[0] * w as f32 - 0.5, uv[1] * h as f32 - 0.5);
        let (i, j) = (x.floor(), y.floor());
        let texel = |dx: i64, dy: i64| {
            let column = self.wrap.index(i as i64 + dx, w);
            let row = self.wrap.index(j as i64 + dy, h);
            self.sines[(slice * h + row) * w + column]
        };
        let top = texel(0, 0) + (texel(1, 0) - texel(0, 0)) * (x - i);
        let bottom = texel(0, 1) + (texel(1, 1) - texel(0, 1)) * (x - i);
        top + (bottom - top) * (y - j)
    }

    /// The share of a light that the relief hides from a point of it, 0..1.
    ///
    /// `to_light`: mesh space, x right, y up the image, z out, any length. `softness`: the light's
    /// width as an angle in radians; 0 is all or nothing.
    pub fn hides(&self, uv: [f32; 2], to_light: [f32; 3], softness: f32) -> f32 {
        let [x, y, z] = to_light;
        let length = (x * x + y * y + z * z).sqrt();
        if length <= 0.0 || z <= 0.0 {
            return 1.0;
        }
        horizon_hides(z / length, self.sine_at(uv, [x, y]), softness)
    }
}

/// The share hidden of a light at an elevation by a horizon, both as sines.
///
/// The twin of the function of that name in `shaders_wgsl/lib/horizon.wgsl`.
pub fn horizon_hides(light_sine: f32, horizon_sine: f32, softness: f32) -> f32 {
    if softness <= 0.0 {
        return if light_sine < horizon_sine { 1.0 } else { 0.0 };
    }
    let above = light_sine.clamp(0.0, 1.0).asin() - horizon_sine.clamp(0.0, 1.0).asin();
    (0.5 - above / softness).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_between_azimuths_and_points_between_texels_are_interpolated() {
        let field = HeightField::new(&[0.0, 1.0], 2, 1, Wrap::Clamp).unwrap();
        let map = HorizonMap::new(&field, 4, vec![0.8, 0.4, 0.4, 0.2, 0.0, 0.0, 0.0, 0.0]).unwrap();
        let close = |got: f32, expected: f32| assert!((got - expected).abs() < 1e-6, "{got} {expected}");
        close(map.sine_at([0.25, 0.5], [1.0, 0.0]), 0.8);
        close(map.sine_at([0.25, 0.5], [1.0, 1.0]), 0.6);
        close(map.sine_at([0.25, 0.5], [0.0, -1.0]), 0.0);
        close(map.sine_at([0.25, 0.5], [1.0, -1.0]), 0.4);
        close(map.sine_at([0.5, 0.5], [1.0, 0.0]), 0.6);
        assert!(HorizonMap::new(&field, 3, vec![0.0; 5]).is_err());
    }

    #[test]
    fn a_light_sets_behind_the_horizon() {
        assert_eq!(horizon_hides(0.5, 0.4, 0.0), 0.0);
        assert_eq!(horizon_hides(0.4, 0.5, 0.0), 1.0);
        assert_eq!(horizon_hides(0.5, 0.5, 0.1), 0.5);
        let wide = horizon_hides(0.02, 0.0, 0.1);
        assert!((wide - 0.3).abs() < 1e-3, "{wide}");
    }
}
