//! Normal maps: the unit normal of the displaced surface at each texel.
//!
//! With height per tile `hu = dh/du`, `hv = dh/dv` (`v` down), `S` mesh units of height and a tile of
//! `tu x tv` mesh units the normal in tangent space (+X right, +Y **up** the image, +Z out) is
//!
//! `n = normalize(-S hu / tu, +S hv / tv, 1)`
//!
//! because `y = -v`. The DirectX convention stores `-y` in green. Source: Blinn 1978, "Simulation
//! of wrinkled surfaces"; Cohen, Olano, Manocha 1998 for normals kept in a map.

use std::marker::PhantomData;

use heightfield::{Extent, HeightField};

use crate::encode::{Range, Sample};
use crate::maps::{Channel, Form, Kind, Layer, Map, MapInfo, MapOption, Options, Plan};
use crate::rows::{Block, CHUNK, Fill, for_each_row_of};
use crate::texels::Texels;
use crate::{BakeError, Kernel, Progress};

/// Steepest slope kept, as the tangent of the angle: its square still fits a float, so a senseless
/// scale gives a horizontal normal and not a NaN.
const STEEPEST: f64 = 1e18;

/// Which way the green channel points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Convention {
    /// +Y is up the image: OpenGL, glTF, Blender.
    #[default]
    OpenGl,
    /// +Y is down the image: DirectX, Unreal.
    DirectX,
}

impl Convention {
    /// The names of both.
    pub const NAMES: &'static [&'static str] = &["opengl", "directx"];

    /// The convention's name: `"opengl"` or `"directx"`.
    pub fn name(self) -> &'static str {
        match self {
            Convention::OpenGl => "opengl",
            Convention::DirectX => "directx",
        }
    }

    /// The convention of that name.
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str) -> Result<Self, BakeError> {
        [Convention::OpenGl, Convention::DirectX]
            .into_iter()
            .find(|convention| convention.name() == name)
            .ok_or_else(|| BakeError::UnknownName {
                what: "convention",
                name: name.to_owned(),
                known: Self::NAMES.join(", "),
            })
    }
}

/// Options of every map that holds normals.
pub(crate) const OPTIONS: &[MapOption] = &[
    MapOption {
        name: "kernel",
        summary: "how slopes are taken from texels",
        kind: Kind::Choice { default: "sobel3", choices: Kernel::NAMES },
    },
    MapOption {
        name: "convention",
        summary: "whether green points up (opengl) or down the image",
        kind: Kind::Choice { default: "opengl", choices: Convention::NAMES },
    },
];

/// Normal x, y, z.
pub static NORMAL: Map = Map {
    info: MapInfo {
        name: "normal",
        summary: "unit normal x, y, z in -1..1",
        source: "Blinn 1978; Cohen, Olano, Manocha 1998",
        version: 2,
        costly: false,
        form: Form::Single,
        channels: &[
            Channel::fixed("x", Range::SIGNED),
            Channel::fixed("y", Range::SIGNED),
            Channel::fixed("z", Range::SIGNED),
        ],
        options: OPTIONS,
    },
    plan: |grid, _| Plan::single(grid),
    bake: |field, options, progress| {
        let (kernel, convention) = settings(options)?;
        single(field, normal_map(field, kernel, convention, progress)?)
    },
};

/// Normal x, y.
pub static NORMAL_XY: Map = Map {
    info: MapInfo {
        name: "normal_xy",
        summary: "unit normal x, y in -1..1; z = sqrt(1 - x^2 - y^2)",
        source: "Blinn 1978; Cohen, Olano, Manocha 1998",
        version: 2,
        costly: false,
        form: Form::Single,
        channels: &[Channel::fixed("x", Range::SIGNED), Channel::fixed("y", Range::SIGNED)],
        options: OPTIONS,
    },
    plan: |grid, _| Plan::single(grid),
    bake: |field, options, progress| {
        let (kernel, convention) = settings(options)?;
        single(field, normal_xy(field, kernel, convention, progress)?)
    },
};

pub(crate) fn settings(options: &Options) -> Result<(Kernel, Convention), BakeError> {
    Ok((Kernel::named(options.choice("kernel"))?, Convention::named(options.choice("convention"))?))
}

pub(crate) fn single(field: &HeightField, texels: Vec<f32>) -> Result<Vec<Layer>, BakeError> {
    Ok(vec![Layer::flat(field.width(), field.height(), texels)])
}

/// Factors that turn height per texel into normal x and y before normalisation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Factors {
    x: f32,
    y: f32,
}

impl Factors {
    pub(crate) fn of(field: &HeightField, convention: Convention) -> Self {
        Self::new([field.width(), field.height()], field.extent(), convention)
    }

    pub(crate) fn new(size: [usize; 2], extent: &Extent, convention: Convention) -> Self {
        let factor = |axis: usize| {
            let tile = f64::from(extent.tile_size[axis]);
            (f64::from(extent.scale) * size[axis] as f64 / tile).min(STEEPEST) as f32
        };
        let y = factor(1);
        Self { x: -factor(0), y: if convention == Convention::OpenGl { y } else { -y } }
    }

    /// Slopes of the normal, `nx / nz` and `ny / nz`, from height per texel.
    #[inline(always)]
    pub(crate) fn slopes(self, gx: f32, gy: f32) -> [f32; 2] {
        // Adding 0 turns -0 into 0: a flat map has no sign.
        [gx * self.x + 0.0, gy * self.y + 0.0]
    }

    /// The unit normal in single precision.
    #[inline(always)]
    fn normal(self, gx: f32, gy: f32) -> [f32; 3] {
        let [nx, ny] = self.slopes(gx, gy);
        let inverse = 1.0 / (nx * nx + ny * ny + 1.0).sqrt();
        [nx * inverse, ny * inverse, inverse]
    }
}

/// Fills texels of `C` samples: x, y; then z from three on; then the height.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Normals<S, const C: usize> {
    factors: Factors,
    sample: PhantomData<S>,
}

impl<S: Sample, const C: usize> Normals<S, C> {
    pub(crate) fn new(factors: Factors) -> Self {
        Self { factors, sample: PhantomData }
    }

    /// The whole map.
    pub(crate) fn bake(
        self,
        field: &HeightField,
        kernel: Kernel,
        progress: Progress<'_>,
    ) -> Result<Vec<S>, BakeError> {
        let mut map = vec![S::default(); field.width() * field.height() * C];
        self.bake_into(&Texels::of(field), kernel, &mut map, progress)?;
        Ok(map)
    }

    /// The whole map into memory of the caller's, `height * width * C` samples.
    pub(crate) fn bake_into(
        self,
        texels: &Texels<'_>,
        kernel: Kernel,
        map: &mut [S],
        mut progress: Progress<'_>,
    ) -> Result<(), BakeError> {
        for_each_row_of(texels, kernel, map, &mut progress, &self)
    }
}

impl<S: Sample, const C: usize> Fill for Normals<S, C> {
    type Sample = S;
    const SAMPLES: usize = C;

    #[inline(always)]
    fn fill(&self, block: &Block<'_>, out: &mut [S]) {
        if let (3, Some(bytes)) = (C, S::as_bytes_mut(out)) {
            return self.fill_rgb8(block, bytes);
        }
        let [mut x, mut y, mut z] = [[S::default(); CHUNK]; 3];
        for i in 0..CHUNK {
            let normal = self.factors.normal(block.gx[i], block.gy[i]);
            (x[i], y[i], z[i]) = (S::signed(normal[0]), S::signed(normal[1]), S::signed(normal[2]));
        }
        for (i, texel) in out.as_chunks_mut::<C>().0.iter_mut().take(CHUNK).enumerate() {
            texel[0] = x[i];
            texel[1] = y[i];
            if C > 2 {
                texel[2] = z[i];
            }
            if C > 3 {
                texel[3] = S::unit(block.heights[i]);
            }
        }
    }
}

impl<S, const C: usize> Normals<S, C> {
    /// A texel is made in 32 bits, of which the last eight are then dropped: that takes one shuffle of
    /// bytes for as many texels as a register holds, where three planes of bytes would take many.
    #[inline(always)]
    fn fill_rgb8(&self, block: &Block<'_>, out: &mut [u8]) {
        const TOGETHER: usize = 16;
        let mut packed = [0_u32; CHUNK];
        for ((packed, &gx), &gy) in packed.iter_mut().zip(block.gx).zip(block.gy) {
            let [x, y, z] = self.factors.normal(gx, gy);
            *packed = code(x) | code(y) << 8 | code(z) << 16;
        }
        let texels = out.as_chunks_mut::<{ 3 * TOGETHER }>().0.iter_mut();
        for (texels, packed) in texels.zip(packed.as_chunks::<TOGETHER>().0) {
            let mut bytes = [0; 4 * TOGETHER];
            for i in 0..TOGETHER {
                let texel = packed[i].to_le_bytes();
                for k in 0..4 {
                    bytes[4 * i + k] = texel[k];
                }
            }
            for k in 0..3 * TOGETHER {
                texels[k] = bytes[k / 3 * 4 + k % 3];
            }
        }
    }
}

/// A component as an integer of 8 bits.
#[inline(always)]
fn code(component: f32) -> u32 {
    u8::signed(component).into()
}

/// The normal map in the field's extent, `height * width * 3` floats in -1..1, z above 0.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn normal_map(
    field: &HeightField,
    kernel: Kernel,
    convention: Convention,
    progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    Normals::<f32, 3>::new(Factors::of(field, convention)).bake(field, kernel, progress)
}

/// The normal map without z, `height * width * 2` floats in -1..1; `z = sqrt(1 - x^2 - y^2)`.
///
/// # Errors
/// See [`normal_map`].
pub fn normal_xy(
    field: &HeightField,
    kernel: Kernel,
    convention: Convention,
    progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    Normals::<f32, 2>::new(Factors::of(field, convention)).bake(field, kernel, progress)
}
