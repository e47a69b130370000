//! From the numbers of a file to heights in 0..1, row by row, as `HeightMap` does for a whole.

use std::path::Path;

use super::source::{Numbers, Shape, Source, open};
use crate::{BakeError, Progress};

/// Resampling filters overshoot by up to this much; such heights are clipped.
const OVERSHOOT: f64 = 0.01;

/// Which numbers become height 0 and height 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Values {
    /// What the type says: integers of 8 and 16 bits fill 0..1, floats are heights.
    #[default]
    Natural,
    /// The smallest and the largest number of the file, which is read once more for that.
    Auto,
    /// These two, the lower first.
    Span([f64; 2]),
}

/// How samples of a file become heights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HeightSettings {
    /// The channel to read; needed when there are several.
    pub channel: Option<usize>,
    /// Which numbers become height 0 and 1.
    pub values: Values,
    /// For depth maps, where 1 is low.
    pub invert: bool,
}

/// The heights of a file, row by row.
pub(super) struct Heights {
    source: Box<dyn Source>,
    shape: Shape,
    channel: usize,
    span: Option<[f64; 2]>,
    invert: bool,
    row: usize,
    /// Rows from here on were not yet counted as clipped.
    counted: usize,
    clipped: usize,
    numbers: Vec<f64>,
}

impl Heights {
    /// Opens a file, and reads it through where its range is asked for.
    pub fn open(
        path: &Path,
        settings: &HeightSettings,
        progress: &mut Progress<'_>,
    ) -> Result<Self, BakeError> {
        let source = open(path)?;
        let shape = source.shape();
        let channel = match settings.channel {
            Some(channel) if channel < shape.channels => channel,
            None if shape.channels == 1 => 0,
            None => {
                return stream(format!(
                    "it has {} channels; say which one holds the heights",
                    shape.channels
                ));
            }
            Some(channel) => {
                return stream(format!("channel {channel} does not exist: it has {}", shape.channels));
            }
        };
        let (row, counted, clipped) = (0, 0, 0);
        let numbers = vec![0.0; shape.width];
        let invert = settings.invert;
        let mut heights = Self { source, shape, channel, span: None, invert, row, counted, clipped, numbers };
        heights.span = match settings.values {
            Values::Natural if shape.numbers == Numbers::Integers => {
                return stream(
                    "only integers of 8 and 16 bits have a meaning of their own: say which values become \
                     height 0 and 1"
                        .to_owned(),
                );
            }
            Values::Natural => None,
            Values::Auto => Some(heights.find_range(progress)?),
            Values::Span([low, high]) if low < high && (high - low).is_finite() => Some([low, high]),
            Values::Span([low, high]) => {
                return stream(format!(
                    "the range must be two finite numbers, low < high, got {low} and {high}"
                ));
            }
        };
        Ok(heights)
    }

    pub fn width(&self) -> usize {
        self.shape.width
    }

    pub fn height(&self) -> usize {
        self.shape.height
    }

    /// Heights clipped so far.
    pub fn clipped(&self) -> usize {
        self.clipped
    }

    /// The numbers that became height 0 and 1.
    pub fn range(&self) -> [f64; 2] {
        match (self.span, self.shape.numbers) {
            (Some(span), _) => span,
            (None, Numbers::U8) => [0.0, 255.0],
            (None, Numbers::U16) => [0.0, 65535.0],
            (None, _) => [0.0, 1.0],
        }
    }

    /// Makes `row` the next one.
    pub fn seek(&mut self, row: usize) -> Result<(), BakeError> {
        self.row = row;
        self.source.seek(row)
    }

    /// The heights of the next row.
    pub fn next_row(&mut self, out: &mut [f32]) -> Result<(), BakeError> {
        self.source.next_row(self.channel, &mut self.numbers)?;
        let row = self.row;
        let mut clipped = 0;
        for (column, (out, &value)) in out.iter_mut().zip(&self.numbers).enumerate() {
            let height = match (self.span, self.shape.numbers) {
                (Some([low, high]), _) => (value - low) / (high - low),
                (None, Numbers::U8) => value / 255.0,
                (None, Numbers::U16) => value / 65535.0,
                (None, _) => value,
            };
            let inside = (0.0..=1.0).contains(&height);
            if !inside {
                if !height.is_finite() {
                    return stream(format!(
                        "height at row {row}, column {column} is {value}; fill holes first"
                    ));
                }
                if self.span.is_none() && !(-OVERSHOOT..=1.0 + OVERSHOOT).contains(&height) {
                    return stream(format!(
                        "height at row {row}, column {column} is {value}; floats must be in 0..1, or say which \
                         values become height 0 and 1"
                    ));
                }
                clipped += 1;
            }
            let height = (height as f32).clamp(0.0, 1.0);
            *out = if self.invert { 1.0 - height } else { height };
        }
        if row >= self.counted {
            self.counted = row + 1;
            self.clipped += clipped;
        }
        self.row += 1;
        Ok(())
    }

    fn find_range(&mut self, progress: &mut Progress<'_>) -> Result<[f64; 2], BakeError> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for row in 0..self.shape.height {
            if row % 64 == 0 {
                progress.report(0, self.shape.height)?;
            }
            self.source.next_row(self.channel, &mut self.numbers)?;
            for (column, &value) in self.numbers.iter().enumerate() {
                if !value.is_finite() {
                    return stream(format!(
                        "height at row {row}, column {column} is {value}; fill holes first"
                    ));
                }
                (low, high) = (low.min(value), high.max(value));
            }
        }
        self.seek(0)?;
        if !(high - low).is_finite() {
            return stream(format!("it spans {low} to {high}, too wide for 64-bit floats"));
        }
        // A constant map is height 0 throughout.
        Ok(if low < high { [low, high] } else { [low, low + 1.0] })
    }
}

fn stream<T>(problem: String) -> Result<T, BakeError> {
    Err(BakeError::Stream { problem })
}
