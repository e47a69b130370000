//! Bilinear height reads, many at once.

// Unchecked table reads.
#![allow(unsafe_code)]

use crate::HeightField;
use crate::lanes::Lanes;

/// A field to read heights from: [`HeightField::sample`] for lanes, to the same bits.
#[derive(Clone, Copy)]
pub struct Heights<'a, L: Lanes> {
    /// The field itself, for its extent.
    pub field: &'a HeightField,
    periodic: bool,
    stride: L::I,
    x: Axis<L>,
    y: Axis<L>,
}

#[derive(Clone, Copy)]
struct Axis<L: Lanes> {
    texels: L::F,
    first: L::F,
    cells: L::F,
    inverse: L::F,
    last: L::F,
}

impl<L: Lanes> Axis<L> {
    #[inline(always)]
    fn new(texels: usize, cells: usize, first: i64) -> Self {
        Self {
            texels: L::splat(texels as f32),
            first: L::splat(first as f32),
            cells: L::splat(cells as f32),
            inverse: L::splat((cells as f32).recip()),
            last: L::splat((cells - 1) as f32),
        }
    }

    /// Cell and position inside it. The cell is one of the field's, whatever the coordinate.
    #[inline(always)]
    fn locate(&self, coordinate: L::F, periodic: bool) -> (L::I, L::F) {
        let (zero, half, one) = (L::splat(0.0), L::splat(0.5), L::splat(1.0));
        let x = coordinate * self.texels - half - self.first;
        let floor = L::floor(x);
        if periodic {
            // Half a cell keeps the quotient of whole numbers off whole numbers, so rounding is harmless.
            let tile = L::floor((floor + half) * self.inverse);
            let cell = L::max(L::min(floor - tile * self.cells, self.last), zero);
            (L::to_int(cell), x - floor)
        } else {
            let cell = L::max(L::min(floor, self.last), zero);
            (L::to_int(cell), L::max(L::min(x - cell, one), zero))
        }
    }
}

impl<'a, L: Lanes> Heights<'a, L> {
    /// Prepares to read from a field.
    #[inline(always)]
    pub fn new(field: &'a HeightField) -> Self {
        let [nx, ny] = field.cells();
        Self {
            field,
            periodic: field.is_periodic(),
            stride: L::splat_int(nx as i32 + 1),
            x: Axis::new(field.width(), nx, field.first_texel()),
            y: Axis::new(field.height(), ny, field.first_texel()),
        }
    }

    /// Bilinear height at `(u, v)`.
    #[inline(always)]
    pub fn sample(&self, u: L::F, v: L::F) -> L::F {
        let (i, x) = self.x.locate(u, self.periodic);
        let (j, y) = self.y.locate(v, self.periodic);
        let at = j * self.stride + i;
        let corners = self.field.corners();
        // SAFETY: the four corners of one of the field's cells; a field has fewer corners than 2^31.
        let (upper, lower) =
            unsafe { (L::gather_pairs(corners, at), L::gather_pairs(corners, at + self.stride)) };
        let top = upper.0 + (upper.1 - upper.0) * x;
        let bottom = lower.0 + (lower.1 - lower.0) * x;
        top + (bottom - top) * y
    }
}
