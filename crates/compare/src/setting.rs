//! What can be chosen: a technique with its parameters, and in which format its maps are stored.

use half::f16;
use heightfield::technique::Reads;
use heightfield::{BakedMap, HeightField, Technique};

use crate::CompareError;

/// How a texture stores numbers from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, PartialOrd, Ord)]
pub enum Format {
    /// 32-bit floats: what is marched unless something else is said.
    #[default]
    R32Float,
    /// 16-bit floats.
    R16Float,
    /// 16-bit integers.
    R16Unorm,
    /// 8-bit integers.
    R8Unorm,
}

impl Format {
    /// All of them, widest first.
    pub const ALL: [Self; 4] = [Self::R32Float, Self::R16Float, Self::R16Unorm, Self::R8Unorm];

    /// The name that graphics interfaces use.
    pub fn name(self) -> &'static str {
        match self {
            Self::R32Float => "r32float",
            Self::R16Float => "r16float",
            Self::R16Unorm => "r16unorm",
            Self::R8Unorm => "r8unorm",
        }
    }

    /// The format of that name.
    ///
    /// # Errors
    /// [`CompareError::Setting`], which lists the known names.
    pub fn named(name: &str) -> Result<Self, CompareError> {
        Self::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            CompareError::setting("format", format!("{name:?}"), format!("known: {known}"))
        })
    }

    /// Bytes a texel.
    pub fn bytes(self) -> usize {
        match self {
            Self::R32Float => 4,
            Self::R16Float | Self::R16Unorm => 2,
            Self::R8Unorm => 1,
        }
    }

    /// The stored value nearest to this one, 0..1.
    pub fn nearest(self, value: f32) -> f32 {
        match self {
            Self::R32Float => value,
            Self::R16Float => f16::from_f32(value).to_f32(),
            Self::R16Unorm => (f64::from(value) * 65535.0).round() as f32 / 65535.0,
            Self::R8Unorm => (f64::from(value) * 255.0).round() as f32 / 255.0,
        }
    }

    /// The largest stored value that is not above this one: how lower bounds, such as cone ratios, are kept.
    pub fn below(self, value: f32) -> f32 {
        match self {
            Self::R32Float => value,
            Self::R16Float => {
                let near = f16::from_f32(value);
                let down = if near.to_f32() > value { f16::from_bits(near.to_bits() - 1) } else { near };
                down.to_f32()
            }
            Self::R16Unorm => floor_to(value, 65535.0),
            Self::R8Unorm => floor_to(value, 255.0),
        }
    }
}

/// The largest `k / levels` whose `f32` is not above the value.
fn floor_to(value: f32, levels: f32) -> f32 {
    let code = (f64::from(value) * f64::from(levels)).round() as f32;
    if code / levels > value { (code - 1.0) / levels } else { code / levels }
}

/// A technique and the formats of the maps it reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The technique with its parameters.
    pub technique: Technique,
    /// How the heights are stored.
    pub heights: Format,
    /// How cone ratios are stored; [`Format::R32Float`] for techniques that read none.
    pub cones: Format,
}

impl From<Technique> for Setting {
    fn from(technique: Technique) -> Self {
        Self { technique, heights: Format::R32Float, cones: Format::R32Float }
    }
}

impl Setting {
    /// Whether the technique reads cone maps.
    pub fn reads_cones(&self) -> bool {
        self.technique.info.reads.baked().iter().any(|map| matches!(map, BakedMap::Cone(_)))
    }

    /// The same technique with its maps in other formats; that of cones counts only where some are read.
    pub fn stored(self, heights: Format, cones: Format) -> Self {
        let cones = if self.reads_cones() { cones } else { Format::R32Float };
        Self { heights, cones, ..self }
    }

    /// Whether all maps are stored as 32-bit floats.
    pub fn is_plain(&self) -> bool {
        self.heights == Format::R32Float && self.cones == Format::R32Float
    }

    /// Bytes of texture that the technique reads on a device: heights, and the maps baked from them.
    ///
    /// Cone ratios take one value a texel and map, the max pyramid of the exact search 32 bits a node, and
    /// a distance map, which must be baked already to be counted, 16 bits a voxel.
    pub fn memory_bytes(&self, field: &HeightField) -> usize {
        let texels = field.width() * field.height();
        let heights = texels * self.heights.bytes();
        let maps: usize = self
            .technique
            .info
            .reads
            .baked()
            .iter()
            .map(|map| match map {
                BakedMap::Cone(_) => texels * self.cones.bytes(),
                BakedMap::Distance => field.distance_map().map_or(0, |map| 2 * map.codes().len()),
            })
            .sum();
        let pyramid = match self.technique.info.reads {
            Reads::Pyramid => 4 * field.skip_pyramid().maxima().len(),
            _ => 0,
        };
        heights + maps + pyramid
    }
}

/// `relief(linear=32, refine=8)`, with the formats behind it where they are not 32-bit floats.
impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.technique)?;
        if self.heights != Format::R32Float {
            write!(f, " {}", self.heights.name())?;
        }
        if self.cones != Format::R32Float {
            write!(f, " cones {}", self.cones.name())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::Random;
    use heightfield::Wrap;

    #[test]
    fn rounding_is_to_the_nearest_or_down_and_stays_put() {
        let mut random = Random::new(1, 9);
        for format in Format::ALL {
            for _ in 0..20_000 {
                let value = random.unit() as f32;
                let (near, below) = (format.nearest(value), format.below(value));
                assert!(below <= value && below >= 0.0, "{format:?} {value} {below}");
                assert!((near - value).abs() <= value - below + 1e-7, "{format:?} {value} {near} {below}");
                assert_eq!(format.nearest(near), near);
                assert_eq!(format.below(below), below, "{format:?}");
            }
            assert_eq!((format.below(1.0), format.nearest(0.0)), (1.0, 0.0));
            assert_eq!(Format::named(format.name()), Ok(format));
        }
        assert!(Format::named("bc5").is_err());
    }

    #[test]
    fn memory_counts_what_a_technique_reads() {
        let field = HeightField::new(&[0.5; 64], 8, 8, Wrap::Repeat).unwrap();
        let of = |name: &str| Setting::from(Technique::named(name).unwrap());
        assert_eq!(of("relief").memory_bytes(&field), 256);
        assert_eq!(of("relief").stored(Format::R8Unorm, Format::R8Unorm).memory_bytes(&field), 64);
        assert_eq!(of("cone").stored(Format::R16Unorm, Format::R8Unorm).memory_bytes(&field), 128 + 64);
        assert!(of("exact").memory_bytes(&field) > 256 + 256);
        assert_eq!(of("relief").stored(Format::R8Unorm, Format::R8Unorm).cones, Format::R32Float);
    }
}
