//! What is asked of a rendering.

use heightfield::Technique;

use crate::RenderError;
use crate::layouts::MaterialMaps;

/// How the relief is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TechniqueChoice {
    /// The bare mesh.
    Flat,
    /// Normals bent by the heights as they are read.
    Bump,
    /// Normals from a map.
    Normal,
    /// 8-bit fixed-function diffuse.
    Dot3,
    /// A search along the view ray.
    Search(Technique),
}

/// Names of the techniques that do not search, with one line for users each.
pub const PLAIN_TECHNIQUES: [(&str, &str); 4] = [
    ("flat", "the bare mesh, no relief"),
    ("bump", "normals bent by the heights, read at each point (Blinn 1978)"),
    ("normal", "normals from a map baked from the heights, or the material's own"),
    ("dot3", "8-bit fixed-function diffuse with a normalisation cube map, one light"),
];

impl TechniqueChoice {
    /// A technique by its name, with its default parameters.
    ///
    /// # Errors
    /// [`RenderError::UnknownTechnique`] lists the names.
    pub fn named(name: &str) -> Result<Self, RenderError> {
        Ok(match name {
            "flat" => Self::Flat,
            "bump" => Self::Bump,
            "normal" => Self::Normal,
            "dot3" => Self::Dot3,
            _ => Self::Search(Technique::named(name).map_err(|_| RenderError::UnknownTechnique {
                name: name.to_owned(),
                known: Self::names().collect::<Vec<_>>().join(", "),
            })?),
        })
    }

    /// All names.
    pub fn names() -> impl Iterator<Item = &'static str> {
        PLAIN_TECHNIQUES.iter().map(|(name, _)| *name).chain(Technique::all().iter().map(|info| info.name))
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Bump => "bump",
            Self::Normal => "normal",
            Self::Dot3 => "dot3",
            Self::Search(technique) => technique.info.name,
        }
    }

    /// Whether it moves what is seen, and so depth.
    pub fn displaces(&self) -> bool {
        matches!(self, Self::Search(_))
    }

    /// Whether it can show self-shadows.
    pub fn casts_shadows(&self) -> bool {
        matches!(self, Self::Search(technique) if technique.info.casts_shadows)
    }

    /// Whether a horizon map can shadow it: it has a relief and more than one fixed-function light.
    pub fn takes_horizon(&self) -> bool {
        !matches!(self, Self::Flat | Self::Dot3)
    }

    /// The shader files it is made of. `own_normals`: the material has a normal map.
    pub(crate) fn program(&self, own_normals: bool) -> Program {
        let (entry, surface, maps) = match (self, own_normals) {
            (Self::Flat, _) => ("plain", "flat", MaterialMaps::None),
            (Self::Bump, _) => ("sloped", "bump", MaterialMaps::None),
            (Self::Normal, false) => ("sloped", "normal", MaterialMaps::Map),
            (Self::Normal, true) => ("mapped", "tangent", MaterialMaps::Map),
            (Self::Dot3, _) => ("dot3", "dot3", MaterialMaps::MapAndCube),
            (Self::Search(_), false) => ("relief", "normal", MaterialMaps::Map),
            (Self::Search(_), true) => ("relief_mapped", "tangent", MaterialMaps::Map),
        };
        let search = if let Self::Search(technique) = self { Some(technique.info.name) } else { None };
        Program { entry, search, surface, maps, horizon: false }
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
    /// All.
    pub const ALL: Self = Self((1 << 10) - 1);

    /// Names with their sets.
    pub const NAMED: [(&'static str, Self); 10] = [
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
    /// Additional outputs.
    pub aovs: AovSet,
}

impl Request {
    /// A picture with no further outputs.
    pub fn new(technique: TechniqueChoice, width: u32, height: u32) -> Self {
        Self { technique, width, height, shadows: None, horizon: None, aovs: AovSet::NONE }
    }
}
