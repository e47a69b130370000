//! Cone maps as the searches read them.

use crate::{HeightField, HeightFieldError};

/// Which cone map: how its ratios were found, and so what they promise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ConeKind {
    /// Empty cones. The cone of a texel's ratio is empty when it stands on *any* point of the bilinear
    /// surface less than a texel away along both axes.
    Cone,
    /// Empty cones as published (Dummer 2006): they stand on the texel's centre and hold no other
    /// texel. They may cut the surface between texels.
    ConeTexel,
    /// Cones that a ray which does not rise pierces at most once on its way out from their axis, over any
    /// point less than a texel away, as [`Self::Cone`].
    RelaxedCone,
    /// Such cones as published (Policarpo and Oliveira 2007), from sampled rays between texels.
    RelaxedConeTexel,
}

impl ConeKind {
    /// All kinds.
    pub const ALL: [ConeKind; 4] =
        [ConeKind::Cone, ConeKind::ConeTexel, ConeKind::RelaxedCone, ConeKind::RelaxedConeTexel];

    /// The name of the map.
    pub fn name(self) -> &'static str {
        match self {
            ConeKind::Cone => "cone",
            ConeKind::ConeTexel => "cone (mode texel)",
            ConeKind::RelaxedCone => "relaxed_cone",
            ConeKind::RelaxedConeTexel => "relaxed_cone (mode texel)",
        }
    }

    /// Whether a texel's ratio holds for the whole surface around it, and not for its centre alone.
    pub fn is_conservative(self) -> bool {
        matches!(self, ConeKind::Cone | ConeKind::RelaxedCone)
    }
}

/// Cone ratios of a height field: how far a cone that stands on the surface opens, in UV units per
/// height unit, 0..1.
///
/// They are laid out as [`HeightField::corners`] are, so one index finds both. A conservative map is
/// kept by cell: the ratio of a texel holds in all four cells around it, so in each cell the widest of
/// its four corners does. A textbook map is kept by corner and read with bilinear interpolation, as its
/// authors do.
#[derive(Debug, Clone, PartialEq)]
pub struct ConeMap {
    kind: ConeKind,
    values: Vec<f32>,
}

impl ConeMap {
    /// Takes one ratio a texel of `field`, row by row.
    ///
    /// # Errors
    /// [`HeightFieldError::BakedLength`] and [`HeightFieldError::BakedValue`] for ratios outside 0..1.
    pub fn new(field: &HeightField, kind: ConeKind, ratios: &[f32]) -> Result<Self, HeightFieldError> {
        let (width, height) = (field.width(), field.height());
        if ratios.len() != width * height {
            return Err(HeightFieldError::BakedLength {
                map: kind.name(),
                width,
                height,
                expected: width * height,
                got: ratios.len(),
            });
        }
        if let Some(at) = ratios.iter().position(|ratio| !(0.0..=1.0).contains(ratio)) {
            return Err(HeightFieldError::BakedValue {
                map: kind.name(),
                row: at / width,
                column: at % width,
                value: ratios[at],
            });
        }
        let [nx, ny] = field.cells();
        let (first, wrap) = (field.first_texel(), field.wrap());
        let columns: Vec<usize> = (0..=nx).map(|i| wrap.index(i as i64 + first, width)).collect();
        let row_of = |j: usize| &ratios[wrap.index(j as i64 + first, height) * width..][..width];
        let mut values = Vec::with_capacity((nx + 1) * (ny + 1));
        for j in 0..=ny {
            let upper = row_of(j);
            if !kind.is_conservative() {
                values.extend(columns.iter().map(|&i| upper[i]));
            } else if j == ny {
                values.resize((nx + 1) * (ny + 1), 0.0);
            } else {
                let lower = row_of(j + 1);
                values.extend(columns.windows(2).map(|pair| {
                    let widest = |row: &[f32]| row[pair[0]].max(row[pair[1]]);
                    widest(upper).max(widest(lower))
                }));
                values.push(0.0);
            }
        }
        Ok(Self { kind, values })
    }

    /// Which map it is.
    #[inline(always)]
    pub fn kind(&self) -> ConeKind {
        self.kind
    }

    /// Ratios by cell (the last row and column are unused) or by corner, `(cells[0] + 1) *
    /// (cells[1] + 1)`, row by row.
    #[inline(always)]
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}
