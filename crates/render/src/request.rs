//! What is asked of a rendering.

use heightfield::Technique;

use crate::layouts::MaterialMaps;
use crate::plain::{PLAIN_TECHNIQUES, PlainTechnique};
use crate::{RenderError, SkipError, Skips};

/// How the relief is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TechniqueChoice {
    /// On the mesh, by its normals at most.
    Plain(&'static PlainTechnique),
    /// A search along the view ray.
    Search(Technique),
}

impl TechniqueChoice {
    /// A technique by its name, with its default parameters.
    ///
    /// # Errors
    /// [`RenderError::UnknownTechnique`] lists the names.
    pub fn named(name: &str) -> Result<Self, RenderError> {
        if let Some(plain) = PLAIN_TECHNIQUES.iter().find(|plain| plain.name == name) {
            return Ok(Self::Plain(plain));
        }
        Technique::named(name).map(Self::Search).map_err(|_| RenderError::UnknownTechnique {
            name: name.to_owned(),
            known: Self::names().collect::<Vec<_>>().join(", "),
        })
    }

    /// All names.
    pub fn names() -> impl Iterator<Item = &'static str> {
        PLAIN_TECHNIQUES.iter().map(|plain| plain.name).chain(Technique::all().iter().map(|info| info.name))
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Plain(plain) => plain.name,
            Self::Search(technique) => technique.info.name,
        }
    }

    /// Whether it moves what is seen, and so depth.
    pub fn displaces(&self) -> bool {
        match self {
            Self::Plain(plain) => plain.displaces,
            Self::Search(_) => true,
        }
    }

    /// Whether it can show self-shadows.
    pub fn casts_shadows(&self) -> bool {
        match self {
            Self::Plain(plain) => plain.displaces,
            Self::Search(technique) => technique.info.casts_shadows,
        }
    }

    /// Whether the mesh itself is displaced.
    pub fn draws_geometry(&self) -> bool {
        matches!(self, Self::Plain(plain) if plain.displaces)
    }

    /// Whether it can be traced through the shell around the mesh, with true outlines.
    pub fn has_silhouettes(&self) -> bool {
        matches!(self, Self::Search(technique) if technique.info.name == "exact")
    }

    /// Whether a horizon map can shadow it: it has a relief, the axes of the texture mapping, and more than
    /// one fixed-function light.
    pub fn takes_horizon(&self) -> bool {
        !matches!(self, Self::Plain(plain) if ["plain", "dot3", "displaced"].contains(&plain.entry))
    }

    /// The shader files it is made of. `own_normals`: the material has a normal map.
    pub(crate) fn program(&self, own_normals: bool) -> Program {
        match self {
            Self::Plain(plain) => {
                let own = plain.own_normals.filter(|_| own_normals);
                let (entry, surface) = own.unwrap_or((plain.entry, plain.surface));
                // Its shadow rays go through the shell.
                let search = plain.displaces.then_some("exact");
                Program { entry, search, surface, maps: plain.maps, horizon: false }
            }
            Self::Search(technique) => {
                let (entry, surface) =
                    if own_normals { ("relief_mapped", "tangent") } else { ("relief", "displaced") };
                let search = Some(technique.info.name);
                Program { entry, search, surface, maps: MaterialMaps::Map, horizon: false }
            }
        }
    }
}

/// Names of the files of a program, and what it binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) struct Program {
    pub entry: &'static str,
    pub search: Option<&'static str>,
    pub surface: &'static str,
    pub maps: MaterialMaps,
    /// Whether shadows come from a horizon map.
    pub horizon: bool,
}

/// A set of additional outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct AovSet(u16);

impl AovSet {
    /// None.
    pub const NONE: Self = Self(0);
    /// Texture coordinates of what is seen.
    pub const UV: Self = Self(1);
    /// Distance along the view axis, world units.
    pub const DEPTH: Self = Self(1 << 1);
    /// World position.
    pub const POSITION: Self = Self(1 << 2);
    /// Shading normal, world axes.
    pub const NORMAL: Self = Self(1 << 3);
    /// Height of what is seen, 0..1.
    pub const HEIGHT: Self = Self(1 << 4);
    /// Steps of the search.
    pub const STEPS: Self = Self(1 << 5);
    /// Share of the lights facing the point that the relief hides.
    pub const SHADOW: Self = Self(1 << 6);
    /// Where there is anything.
    pub const MASK: Self = Self(1 << 7);
    /// Start of the texture-space segment that was searched.
    pub const RAY_START: Self = Self(1 << 8);
    /// End minus start of that segment.
    pub const RAY_DELTA: Self = Self(1 << 9);
    /// What was left out of a pixel's work.
    pub const SKIP: Self = Self(1 << 10);
    /// All.
    pub const ALL: Self = Self((1 << 11) - 1);

    /// Names with their sets.
    pub const NAMED: [(&'static str, Self); 11] = [
        ("uv", Self::UV),
        ("depth", Self::DEPTH),
        ("position", Self::POSITION),
        ("normal", Self::NORMAL),
        ("height", Self::HEIGHT),
        ("steps", Self::STEPS),
        ("shadow", Self::SHADOW),
        ("mask", Self::MASK),
        ("ray_start", Self::RAY_START),
        ("ray_delta", Self::RAY_DELTA),
        ("skip", Self::SKIP),
    ];

    /// The set of one output by name.
    pub fn named(name: &str) -> Option<Self> {
        Self::NAMED.iter().find(|(known, _)| *known == name).map(|(_, set)| *set)
    }

    /// Whether all of `other` is in the set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether any of `other` is in the set.
    pub fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

impl std::ops::BitOr for AovSet {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl std::ops::BitOrAssign for AovSet {
    fn bitor_assign(&mut self, other: Self) {
        *self = *self | other;
    }
}

/// Self-shadows looked up in a horizon map that is baked for the purpose (Max 1988).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HorizonShadows {
    /// Azimuths of the map, at most what the device has texture layers (256 or more).
    pub azimuths: u32,
    /// Width of every light as an angle in radians; 0 gives hard edges.
    pub softness: f32,
}

impl Default for HorizonShadows {
    fn default() -> Self {
        Self { azimuths: 32, softness: 0.0 }
    }
}

/// How to render.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// How the relief is shown.
    pub technique: TechniqueChoice,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Self-shadows: where the technique can (`None`), or as said; `Some(true)` on a technique that
    /// cannot is a warning.
    pub shadows: Option<bool>,
    /// Self-shadows from a horizon map in place of rays, also for techniques that cast none.
    pub horizon: Option<HorizonShadows>,
    /// Whether rays are traced through the shell around the mesh, so that outlines, depth and shadows are those
    /// of the displaced mesh; on a technique that cannot it is a warning.
    pub silhouettes: bool,
    /// Samples a pixel: 1, or 4 or 16 in a square grid, searched and shaded each for itself and averaged in linear
    /// light. Additional outputs are those of one sample in the middle of each pixel.
    pub samples: u32,
    /// Whether highlights widen by the slopes of the relief that a pixel averages over.
    pub specular_aa: bool,
    /// Additional outputs.
    pub aovs: AovSet,
    /// What may be left out where the picture does not need it.
    pub skips: Skips,
    /// How far what is seen may be off for it.
    pub skip_error: SkipError,
}

impl Request {
    /// Samples along a side of a pixel.
    pub(crate) fn samples_across(&self) -> Result<u32, RenderError> {
        match self.samples {
            1 => Ok(1),
            4 => Ok(2),
            16 => Ok(4),
            other => Err(RenderError::Scene(format!("samples is {other}; it must be 1, 4 or 16"))),
        }
    }

    /// The request of a picture that has a pixel for each sample.
    pub(crate) fn of_samples(self, across: u32) -> Self {
        if across == 1 {
            return self;
        }
        let [width, height] = [self.width, self.height].map(|side| side.saturating_mul(across));
        Self { width, height, samples: 1, aovs: AovSet::NONE, ..self }
    }

    /// Whether programs read meshes and heights as solids: to trace rays through them, or to shade what is displaced.
    pub(crate) fn reads_solids(&self) -> bool {
        self.in_shell() || self.technique.draws_geometry()
    }

    /// Whether rays are traced through shells: for what is seen, or for shadows of what is displaced.
    pub(crate) fn traces_solids(&self) -> bool {
        self.in_shell() || (self.technique.draws_geometry() && self.traces_light())
    }

    /// Whether light rays are traced.
    pub(crate) fn traces_light(&self) -> bool {
        self.shadows.unwrap_or(true) && self.technique.casts_shadows()
    }

    /// Whether rays are traced through the shell.
    pub(crate) fn in_shell(&self) -> bool {
        self.silhouettes && self.technique.has_silhouettes()
    }

    /// Whether nothing of a draw shows nearer than the geometry that is drawn, or its displaced surface.
    pub(crate) fn is_solid(&self, material: &crate::Material) -> bool {
        let on_mesh = !self.in_shell() && !self.technique.draws_geometry();
        !on_mesh || !self.technique.displaces() || material.field.extent().base >= 1.0
    }

    /// A picture with no further outputs.
    pub fn new(technique: TechniqueChoice, width: u32, height: u32) -> Self {
        Self {
            technique,
            width,
            height,
            shadows: None,
            horizon: None,
            silhouettes: false,
            samples: 1,
            specular_aa: true,
            aovs: AovSet::NONE,
            skips: Skips::ALL,
            skip_error: SkipError::default(),
        }
    }
}
