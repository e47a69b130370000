//! The registry of techniques: their names, parameters and searches.
//!
//! A technique is one file here in `search/` and one of the same name in `shaders_wgsl/search/`.
//! Adding one takes those two files and a line in [`search`](crate::search).

use glam::Vec3;

use crate::chunk::Chunk;
use crate::search::REGISTRY;
use crate::{Found, HeightField, HeightFieldError};

/// Most parameters a technique may have.
pub const MAX_PARAMETERS: usize = 4;

/// Parameter values in the order of [`TechniqueInfo::parameters`].
pub type Values = [f64; MAX_PARAMETERS];

/// One parameter of a technique. In WGSL it is an `override` constant of the same name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in Rust, WGSL and Python.
    pub name: &'static str,
    /// What it does.
    pub summary: &'static str,
    /// Value when nothing is said.
    pub default: f64,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
}

/// What a technique reads; nothing else is baked, uploaded or bound for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Reads {
    /// The height texture through a filtering sampler.
    Heights,
    /// The corner heights and the max pyramid.
    Pyramid,
    /// The corner heights and the cone map.
    Cone,
    /// The corner heights and the cone map as published.
    ConeTexel,
    /// The corner heights, the cone map and the relaxed cone map.
    RelaxedCone,
    /// The corner heights and both maps as published.
    RelaxedConeTexel,
    /// The corner heights and the distance map.
    Distance,
}

/// Everything known about a technique that searches a height field.
pub struct TechniqueInfo {
    /// Name used everywhere.
    pub name: &'static str,
    /// One line for users.
    pub summary: &'static str,
    /// Paper or book, with the year.
    pub source: &'static str,
    /// Its parameters, at most [`MAX_PARAMETERS`]; all are integers.
    pub parameters: &'static [Parameter],
    /// What it reads.
    pub reads: Reads,
    /// Whether it can search from the surface towards a light.
    pub casts_shadows: bool,
    /// The search over one segment in `f32`: the twin of the WGSL function `search`.
    pub search: fn(&HeightField, Vec3, Vec3, f32, &Values) -> Found,
    /// Whether a ray from the surface towards a light is blocked: the twin of WGSL `occluded`.
    pub occluded: fn(&HeightField, Vec3, Vec3, f32, &Values) -> bool,
    /// The same search over many rays, as `march` runs it.
    pub march: fn(&HeightField, &Values, &mut Chunk<'_>),
}

impl std::fmt::Debug for TechniqueInfo {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TechniqueInfo").field("name", &self.name).finish_non_exhaustive()
    }
}

/// A technique with its parameter values.
#[derive(Debug, Clone, Copy)]
pub struct Technique {
    /// Which technique.
    pub info: &'static TechniqueInfo,
    /// Values in the order of its parameters; the rest are 0.
    pub values: Values,
}

impl PartialEq for Technique {
    fn eq(&self, other: &Self) -> bool {
        self.info.name == other.info.name && self.values == other.values
    }
}

impl Technique {
    /// All techniques, cheapest guarantee first.
    pub fn all() -> &'static [&'static TechniqueInfo] {
        REGISTRY
    }

    /// The technique of that name with its default parameters.
    ///
    /// # Errors
    /// [`HeightFieldError::UnknownTechnique`], which lists the known names.
    pub fn named(name: &str) -> Result<Self, HeightFieldError> {
        let info = REGISTRY.iter().find(|info| info.name == name).ok_or_else(|| {
            let known: Vec<_> = REGISTRY.iter().map(|info| info.name).collect();
            HeightFieldError::UnknownTechnique { name: name.to_owned(), known: known.join(", ") }
        })?;
        let mut values = [0.0; MAX_PARAMETERS];
        for (value, parameter) in values.iter_mut().zip(info.parameters) {
            *value = parameter.default;
        }
        Ok(Self { info, values })
    }

    /// The same technique with one parameter changed.
    ///
    /// # Errors
    /// [`HeightFieldError::Parameter`] for an unknown name, a fraction, or a value out of range.
    pub fn with(mut self, parameter: &str, value: f64) -> Result<Self, HeightFieldError> {
        let fail = |problem: String| HeightFieldError::Parameter {
            technique: self.info.name,
            parameter: parameter.to_owned(),
            problem,
        };
        let Some(at) = self.info.parameters.iter().position(|p| p.name == parameter) else {
            let known: Vec<_> = self.info.parameters.iter().map(|p| p.name).collect();
            return Err(fail(if known.is_empty() {
                "unknown; this technique has no parameters".to_owned()
            } else {
                format!("unknown; this technique has: {}", known.join(", "))
            }));
        };
        let known = &self.info.parameters[at];
        if !(known.min..=known.max).contains(&value) || value.fract() != 0.0 {
            return Err(fail(format!("must be a whole number in {}..{}, got {value}", known.min, known.max)));
        }
        self.values[at] = value;
        Ok(self)
    }

    /// Checks that the field carries the maps that the technique reads.
    ///
    /// # Errors
    /// [`HeightFieldError::MapMissing`] names the first that is missing.
    pub fn check_maps(&self, field: &HeightField) -> Result<(), HeightFieldError> {
        match self.info.reads.baked().iter().find(|&&map| !field.has(map)) {
            None => Ok(()),
            Some(map) => Err(HeightFieldError::MapMissing { technique: self.info.name, map: map.name() }),
        }
    }

    /// Parameter names with their values.
    pub fn settings(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.info.parameters.iter().zip(self.values).map(|(p, v)| (p.name, v))
    }

    /// Searches one segment. See [`TechniqueInfo::search`].
    #[inline]
    pub fn search(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> Found {
        (self.info.search)(field, start, delta, cos_theta, &self.values)
    }

    /// Tests a shadow ray. See [`TechniqueInfo::occluded`].
    #[inline]
    pub fn occluded(&self, field: &HeightField, start: Vec3, delta: Vec3, cos_theta: f32) -> bool {
        (self.info.occluded)(field, start, delta, cos_theta, &self.values)
    }
}

impl std::fmt::Display for Technique {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.info.name)?;
        for (at, (name, value)) in self.settings().enumerate() {
            write!(f, "{}{name}={value}", if at == 0 { "(" } else { ", " })?;
        }
        if self.info.parameters.is_empty() { Ok(()) } else { write!(f, ")") }
    }
}
