//! Normal maps: the unit normal of the displaced surface at each texel.
//!
//! With height per tile `hu = dh/du`, `hv = dh/dv` (`v` down), `S` mesh units of height and a tile of
//! `tu x tv` mesh units the normal in tangent space (+X right, +Y **up** the image, +Z out) is
//!
//! `n = normalize(-S hu / tu, +S hv / tv, 1)`
//!
//! because `y = -v`. The DirectX convention stores `-y` in green. Source: Blinn 1978, "Simulation
//! of wrinkled surfaces"; Cohen, Olano, Manocha 1998 for normals kept in a map.

use heightfield::HeightField;

use crate::encode::Range;
use crate::maps::{Channel, Form, Kind, Layer, Map, MapInfo, MapOption, Options, Plan};
use crate::rows::{Row, for_each_row};
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
        version: 1,
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
        version: 1,
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
    pub(crate) fn new(field: &HeightField, convention: Convention) -> Self {
        let extent = field.extent();
        let factor = |texels: usize, tile: f32| {
            (f64::from(extent.scale) * texels as f64 / f64::from(tile)).min(STEEPEST) as f32
        };
        let y = factor(field.height(), extent.tile_size[1]);
        Self {
            x: -factor(field.width(), extent.tile_size[0]),
            y: if convention == Convention::OpenGl { y } else { -y },
        }
    }

    /// Slopes of the normal, `nx / nz` and `ny / nz`, from height per texel.
    #[inline]
    pub(crate) fn slopes(self, gx: f32, gy: f32) -> [f32; 2] {
        // Adding 0 turns -0 into 0: a flat map has no sign.
        [gx * self.x + 0.0, gy * self.y + 0.0]
    }

    /// Normal components of a row.
    pub(crate) fn normals(self, row: &Row<'_>, normal: &mut [Vec<f32>; 3]) {
        let [nx, ny, nz] = normal;
        let n = nx.len();
        let (gx, gy, ny, nz) = (&row.gx[..n], &row.gy[..n], &mut ny[..n], &mut nz[..n]);
        for i in 0..n {
            let [x, y] = self.slopes(gx[i], gy[i]);
            let inverse = 1.0 / (x * x + y * y + 1.0).sqrt();
            nx[i] = x * inverse;
            ny[i] = y * inverse;
            nz[i] = inverse;
        }
    }
}

/// The normal map in the field's extent, `height * width * 3` floats in -1..1, z above 0.
///
/// # Errors
/// [`BakeError::Interrupted`].
pub fn normal_map(
    field: &HeightField,
    kernel: Kernel,
    convention: Convention,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let factors = Factors::new(field, convention);
    let mut map = vec![0.0; field.width() * field.height() * 3];
    for_each_row(field, kernel, &mut map, &mut progress, |row, out, normal| {
        factors.normals(row, normal);
        let [nx, ny, nz] = normal;
        for (((texel, x), y), z) in out.chunks_exact_mut(3).zip(nx).zip(ny).zip(nz) {
            texel[0] = *x;
            texel[1] = *y;
            texel[2] = *z;
        }
    })?;
    Ok(map)
}

/// The normal map without z, `height * width * 2` floats in -1..1; `z = sqrt(1 - x^2 - y^2)`.
///
/// # Errors
/// See [`normal_map`].
pub fn normal_xy(
    field: &HeightField,
    kernel: Kernel,
    convention: Convention,
    mut progress: Progress<'_>,
) -> Result<Vec<f32>, BakeError> {
    let factors = Factors::new(field, convention);
    let mut map = vec![0.0; field.width() * field.height() * 2];
    for_each_row(field, kernel, &mut map, &mut progress, |row, out, normal| {
        factors.normals(row, normal);
        let [nx, ny, _] = normal;
        for ((texel, x), y) in out.chunks_exact_mut(2).zip(nx).zip(ny) {
            texel[0] = *x;
            texel[1] = *y;
        }
    })?;
    Ok(map)
}
