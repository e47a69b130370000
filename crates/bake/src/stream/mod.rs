//! Maps of height maps larger than memory: files are read, baked and written by blocks of rows.
//!
//! Only maps whose rows need but a few rows of heights can be made like this
//! ([`Map::is_by_rows`](crate::Map::is_by_rows)). At any time there are two blocks of heights and one of
//! the map in memory, a few million texels. What comes out is bit for bit what reading, baking and
//! writing the whole would give. A repeating map starts with the neighbours of its first row, which
//! are the last rows of the file: they are read first.

mod heights;
mod npy;
mod png;
mod sink;
mod source;
mod tiff;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use heightfield::{Extent, Wrap};
use rayon::prelude::*;

use crate::encode::Depth;
use crate::files::replace::{Guarded, replace};
use crate::kernel::Kernel;
use crate::maps::{Map, Options};
use crate::normal::{Factors, Normals, settings};
use crate::rows::{REACH, TASK_TEXELS, fill_rows};
use crate::texels::RowSource;
use crate::{BakeError, Progress};

use heights::Heights;
pub use heights::{HeightSettings, Values};
use sink::{StreamSample, write_rows};

/// Texels of a block.
const BLOCK_TEXELS: usize = 1 << 20;

/// What was found while a file was baked by rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Streamed {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Heights that lay outside 0..1, or outside the given range, and were clipped.
    pub clipped: usize,
    /// The values that became height 0 and 1, in the units of the data.
    pub range: [f64; 2],
}

/// What to make of a file.
#[derive(Debug)]
pub struct StreamRequest<'a> {
    /// The map; one that is [made by rows](crate::Map::is_by_rows).
    pub map: &'static Map,
    /// Its options.
    pub options: &'a Options,
    /// What lies beyond the edge.
    pub wrap: Wrap,
    /// Size of the relief in mesh units.
    pub extent: Extent,
    /// How samples of the file become heights.
    pub settings: HeightSettings,
}

/// Bakes a map of the height map in file `from` into file `to`, by rows.
///
/// Read are `.npy` files (2-D, or with channels), PNG that is not interlaced, and TIFF in strips or
/// tiles; written are `.png` with 8 or 16 bits and `.npy` with floats (`depth` `None`). Progress is
/// in rows.
///
/// # Errors
/// [`BakeError::Unsupported`] for a file that has no rows in order, saying why; [`BakeError::Stream`]
/// for heights that make no sense; what readers and writers say; [`BakeError::Interrupted`], after
/// which `to` is what it was.
pub fn bake_file(
    from: &Path,
    to: &Path,
    depth: Option<Depth>,
    request: &StreamRequest<'_>,
    mut progress: Progress<'_>,
) -> Result<Streamed, BakeError> {
    request.extent.validate()?;
    if !request.map.is_by_rows() {
        return Err(BakeError::Stream {
            problem: format!("map {:?} needs the whole height map at once", request.map.info.name),
        });
    }
    let within = |error| match error {
        error @ (BakeError::Io { .. } | BakeError::Interrupted) => error,
        source => BakeError::File { path: from.to_owned(), source: Box::new(source) },
    };
    let mut heights = Heights::open(from, &request.settings, &mut progress).map_err(within)?;
    let suffix = to.extension().map(|suffix| suffix.to_string_lossy().to_ascii_lowercase());
    let format = match (suffix.as_deref(), depth) {
        (Some("png"), Some(_)) => sink::Format::Png,
        (Some("npy"), None) => sink::Format::Npy,
        _ => {
            return Err(BakeError::Unwritable {
                what: "a map made by rows".to_owned(),
                format: to.display().to_string(),
                problem: "the suffix must be .png for integers or .npy for floats".to_owned(),
            });
        }
    };
    let (width, height) = (heights.width(), heights.height());
    replace(to, &mut progress, |file| {
        let written = match depth {
            None => write::<f32>(&mut heights, file, format, request),
            Some(Depth::U8) => write::<u8>(&mut heights, file, format, request),
            Some(Depth::U16) => write::<u16>(&mut heights, file, format, request),
        };
        written.map_err(
            |error| if matches!(error, BakeError::Unwritable { .. }) { error } else { within(error) },
        )
    })?;
    Ok(Streamed { width, height, clipped: heights.clipped(), range: heights.range() })
}

fn write<S: StreamSample>(
    heights: &mut Heights,
    file: &mut Guarded<'_, '_>,
    format: sink::Format,
    request: &StreamRequest<'_>,
) -> Result<(), BakeError> {
    let (kernel, convention) = settings(request.options)?;
    let factors = Factors::new([heights.width(), heights.height()], &request.extent, convention);
    match request.map.info.channels.len() {
        2 => blocks(heights, file, format, request.wrap, kernel, &Normals::<S, 2>::new(factors)),
        3 => blocks(heights, file, format, request.wrap, kernel, &Normals::<S, 3>::new(factors)),
        _ => blocks(heights, file, format, request.wrap, kernel, &Normals::<S, 4>::new(factors)),
    }
}

/// Rows of heights around a block: those of the block with `REACH` more above and below.
struct Window {
    width: usize,
    wrap: Wrap,
    rows: Vec<f32>,
}

impl RowSource for Window {
    /// Row 0 is the first of the block.
    #[inline(always)]
    fn row(&self, at: i64) -> &[f32] {
        &self.rows[(at + REACH as i64) as usize * self.width..][..self.width]
    }

    #[inline(always)]
    fn wrap(&self) -> Wrap {
        self.wrap
    }
}

fn blocks<S: StreamSample, const C: usize>(
    heights: &mut Heights,
    file: &mut Guarded<'_, '_>,
    format: sink::Format,
    wrap: Wrap,
    kernel: Kernel,
    fill: &Normals<S, C>,
) -> Result<(), BakeError> {
    let (width, height) = (heights.width(), heights.height());
    let block = (BLOCK_TEXELS / width).max(1);
    let task = (TASK_TEXELS / width).max(1);
    let mut rows = RowsInOrder::new(heights, wrap)?;
    let mut window = Window { width, wrap, rows: Vec::new() };
    rows.append(&mut window, -(REACH as i64), block.min(height) + 2 * REACH)?;
    let mut out = Vec::new();
    write_rows(file, format, [width, height, C], |sink| {
        for first in (0..height).step_by(block) {
            let count = block.min(height - first);
            let after = block.min(height - first - count);
            out.resize(count * width * C, S::default());
            // The next block is read while this one is made and written.
            let mut next = Window { width, wrap, rows: window.rows[count * width..].to_vec() };
            let mut read = Ok(());
            rayon::in_place_scope(|scope| {
                let (next, rows, read) = (&mut next, &mut rows, &mut read);
                scope.spawn(move |_| *read = rows.append(next, (first + count + REACH) as i64, after));
                out.par_chunks_mut(task * width * C).enumerate().for_each(|(at, out)| {
                    fill_rows(&window, (at * task) as i64, kernel, fill, out);
                });
                sink.write(&out, first + count)
            })?;
            read?;
            window = next;
        }
        Ok(())
    })
}

/// The rows of the file in order, with those before the first and after the last.
struct RowsInOrder<'a> {
    heights: &'a mut Heights,
    wrap: Wrap,
    /// Rows that are needed again, or before their time.
    kept: BTreeMap<usize, Vec<f32>>,
}

impl<'a> RowsInOrder<'a> {
    /// Reads what the first row needs from beyond the edge, then goes to the start.
    fn new(heights: &'a mut Heights, wrap: Wrap) -> Result<Self, BakeError> {
        let height = heights.height();
        let needed: BTreeSet<usize> = (1..=REACH as i64).map(|k| wrap.index(-k, height)).collect();
        let mut kept = BTreeMap::new();
        for row in needed {
            heights.seek(row)?;
            let mut texels = vec![0.0; heights.width()];
            heights.next_row(&mut texels)?;
            kept.insert(row, texels);
        }
        heights.seek(0)?;
        Ok(Self { heights, wrap, kept })
    }

    /// Adds `count` rows from row `from` on. Rows of the map have to come in order, each once.
    fn append(&mut self, window: &mut Window, from: i64, count: usize) -> Result<(), BakeError> {
        let (width, height) = (self.heights.width(), self.heights.height());
        for row in from..from + count as i64 {
            let at = window.rows.len();
            match usize::try_from(row) {
                Ok(row) if row < height => {
                    window.rows.resize(at + width, 0.0);
                    let texels = &mut window.rows[at..];
                    self.heights.next_row(texels)?;
                    if row < REACH || row + REACH >= height {
                        self.kept.insert(row, texels.to_vec());
                    }
                }
                // Beyond the edges lie none but the first and last rows.
                _ => window.rows.extend_from_slice(&self.kept[&self.wrap.index(row, height)]),
            }
        }
        Ok(())
    }
}
