//! The registry of maps: what each is, what it takes, how it is baked and stored.
//!
//! A map made from heights is one [`Map`] in the file with its algorithm and one line in
//! [`REGISTRY`]. Python's `bake`, the command line, the docs and the tests that walk all maps follow
//! from that. Maps that come from elsewhere (a detailed mesh) have a [`MapInfo`] only.

mod encoded;
mod from_mesh;
mod options;
mod plan;
mod store;

use heightfield::HeightField;

use crate::encode::{Range, Rounding};
use crate::{
    BakeError, Progress, cone, curvature, distance, horizon, mips, moments, normal, occlusion, pyramid,
    relief,
};

pub use encoded::{Encoded, EncodedLayer, bake_encoded, bake_rows};
pub use from_mesh::{FROM_MESH, HEIGHT, TANGENTS, about};
pub use options::{Kind, MapOption, Options, Value};
pub use plan::{Grid, Plan};
pub use store::{FileFormat, Storable, Stored, save};

/// All maps that are made from heights, in the order users see them.
pub static REGISTRY: &[&Map] = &[
    &normal::NORMAL,
    &normal::NORMAL_XY,
    &relief::RELIEF,
    &pyramid::PYRAMID,
    &cone::CONE,
    &cone::RELAXED_CONE,
    &mips::NORMAL_MIPS,
    &moments::MOMENTS,
    &moments::TOKSVIG,
    &curvature::CURVATURE,
    &horizon::HORIZON,
    &occlusion::AO,
    &occlusion::BENT_NORMAL,
    &distance::DISTANCE,
];

/// Which pictures a map consists of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// One picture of the size of the height map or another.
    Single,
    /// Pictures that halve, finest first: one [`Layer`] each.
    Levels,
    /// Slices of one size in one [`Layer`] of that depth.
    Stack {
        /// What the slices are: `"height"`, `"azimuth"`.
        axis: &'static str,
    },
}

/// The numbers a channel can hold, which decides how integers stand for them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Span {
    /// Always these.
    Fixed(Range),
    /// From the smallest to the largest number that the bake gave; both are noted beside the files.
    Found(Rounding),
}

/// One channel of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Channel {
    /// What it holds, in a word: `"x"`, `"height"`.
    pub name: &'static str,
    /// Its numbers.
    pub span: Span,
}

impl Channel {
    /// A channel whose numbers stay inside `range`.
    pub const fn fixed(name: &'static str, range: Range) -> Self {
        Self { name, span: Span::Fixed(range) }
    }

    /// A channel whose range is that of the data.
    pub const fn found(name: &'static str, rounding: Rounding) -> Self {
        Self { name, span: Span::Found(rounding) }
    }
}

/// What a map is.
#[derive(Debug, PartialEq)]
pub struct MapInfo {
    /// Name used everywhere.
    pub name: &'static str,
    /// What it holds, in one line, with units and range.
    pub summary: &'static str,
    /// Paper or book, with the year.
    pub source: &'static str,
    /// Counts up whenever the numbers change that the same input gives; what was kept of an earlier
    /// version is not used again.
    pub version: u32,
    /// Whether a bake takes so long that its result is worth keeping on disk.
    pub costly: bool,
    /// Which pictures it consists of.
    pub form: Form,
    /// Its channels.
    pub channels: &'static [Channel],
    /// Its options.
    pub options: &'static [MapOption],
}

impl MapInfo {
    /// The defaults of all options.
    pub fn defaults(&self) -> Options {
        Options::defaults(self.name, self.options)
    }

    /// The ranges of the channels, the whole of the floats where the data decides.
    pub(crate) fn fixed_ranges(&self) -> Vec<Range> {
        self.channels
            .iter()
            .map(|channel| match channel.span {
                Span::Fixed(range) => range,
                Span::Found(rounding) => Range { low: f32::MIN, high: f32::MAX, rounding },
            })
            .collect()
    }
}

/// A map that is made from heights.
#[derive(Debug)]
pub struct Map {
    /// What it is.
    pub info: MapInfo,
    /// The size of its pictures and of what the bake needs besides, before anything is allocated.
    pub plan: fn(Grid, &Options) -> Plan,
    /// Bakes it. The options are complete and valid, and the pictures are those of `plan`.
    pub bake: fn(&HeightField, &Options, Progress<'_>) -> Result<Vec<Layer>, BakeError>,
}

impl Map {
    /// The map of that name.
    ///
    /// # Errors
    /// [`BakeError::UnknownName`].
    pub fn named(name: &str) -> Result<&'static Self, BakeError> {
        REGISTRY.iter().copied().find(|map| map.info.name == name).ok_or_else(|| BakeError::UnknownName {
            what: "map",
            name: name.to_owned(),
            known: REGISTRY.iter().map(|map| map.info.name).collect::<Vec<_>>().join(", "),
        })
    }
}

/// One picture of a baked map, or several of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Slices; 1 but in a [`Form::Stack`].
    pub depth: usize,
    /// `depth * height * width * channels` floats.
    pub texels: Vec<f32>,
}

impl Layer {
    /// A single picture.
    pub fn flat(width: usize, height: usize, texels: Vec<f32>) -> Self {
        Self { width, height, depth: 1, texels }
    }
}

/// A baked map.
#[derive(Debug, Clone, PartialEq)]
pub struct Baked {
    /// Which map.
    pub info: &'static MapInfo,
    /// The options it was baked with.
    pub options: Options,
    /// Its pictures; at least one.
    pub layers: Vec<Layer>,
}

impl Baked {
    /// The range of each channel.
    pub fn ranges(&self) -> Vec<Range> {
        let channels = self.info.channels.len();
        let of = |(at, channel): (usize, &Channel)| match channel.span {
            Span::Fixed(range) => range,
            Span::Found(rounding) => {
                let values =
                    self.layers.iter().flat_map(|layer| layer.texels.iter().skip(at).step_by(channels));
                let (low, high) =
                    values.fold((f32::MAX, f32::MIN), |(low, high), &v| (low.min(v), high.max(v)));
                Range { low, high, rounding }
            }
        };
        self.info.channels.iter().enumerate().map(of).collect()
    }
}

/// Makes sure that the machine can hold a map, with that many bytes a sample, and what its bake needs.
///
/// # Errors
/// [`BakeError::Memory`].
pub fn check_memory(map: &Map, grid: Grid, options: &Options, sample_bytes: usize) -> Result<(), BakeError> {
    (map.plan)(grid, options).check_samples(&map.info, sample_bytes)
}

/// Bakes a map.
///
/// # Errors
/// [`BakeError::Memory`], before anything is allocated, when the machine has not enough of it;
/// [`BakeError::Interrupted`]; what the map itself says.
pub fn bake(
    field: &HeightField,
    map: &'static Map,
    options: &Options,
    progress: Progress<'_>,
) -> Result<Baked, BakeError> {
    let plan = (map.plan)(Grid::of(field), options);
    plan.check(&map.info)?;
    let layers = (map.bake)(field, options, progress)?;
    debug_assert_eq!(plan.layers, layers.iter().map(|l| [l.width, l.height, l.depth]).collect::<Vec<_>>());
    Ok(Baked { info: &map.info, options: options.clone(), layers })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names that an option may not have: settings of height maps, of files, of the command line.
    const TAKEN: [&str; 34] = [
        "source",
        "maps",
        "output",
        "format",
        "bits",
        "dtype",
        "prefix",
        "scale",
        "base",
        "tile_size",
        "wrap",
        "channel",
        "invert",
        "height_range",
        "json",
        "quiet",
        "verbose",
        "help",
        "progress",
        "cache",
        "detail",
        "cage",
        "size",
        "front",
        "rear",
        "samples",
        "padding",
        "space",
        "back_faces",
        "rays",
        "distance",
        "folder",
        "name",
        "field",
    ];

    #[test]
    fn names_are_unique_plain_words_and_defaults_are_accepted() {
        for (at, map) in REGISTRY.iter().enumerate() {
            let info = &map.info;
            assert!(REGISTRY[..at].iter().all(|other| other.info.name != info.name), "{}", info.name);
            assert!(std::ptr::eq(Map::named(info.name).unwrap(), *map));
            assert!(!info.summary.is_empty() && !info.source.is_empty() && !info.channels.is_empty());
            let options = info.defaults();
            for (at, option) in info.options.iter().enumerate() {
                assert!(option.name.bytes().all(|c| c.is_ascii_lowercase() || c == b'_'), "{}", option.name);
                assert!(!TAKEN.contains(&option.name) && !option.summary.is_empty(), "{}", option.name);
                assert!(info.options[..at].iter().all(|other| other.name != option.name));
                assert_eq!(options.clone().with(option.name, option.default()).unwrap(), options);
            }
        }
        assert!(Map::named("cones").unwrap_err().to_string().contains("normal, normal_xy, relief, pyramid"));
    }

    #[test]
    fn one_option_name_is_one_kind_of_thing() {
        // The command line has one flag for all maps that take the option.
        for map in REGISTRY {
            for other in REGISTRY {
                for (a, b) in
                    map.info.options.iter().flat_map(|a| other.info.options.iter().map(move |b| (a, b)))
                {
                    let same = std::mem::discriminant(&a.kind) == std::mem::discriminant(&b.kind);
                    assert!(a.name != b.name || same, "{} of {}", a.name, map.info.name);
                }
            }
        }
    }
}
