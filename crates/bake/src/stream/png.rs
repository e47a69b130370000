//! Rows of a PNG file. They come in order only: going back starts again.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use ::png::{BitDepth, DecodingError, Reader, Transformations};

use super::source::{Numbers, Shape, Source, check_size, convert, reader};
use crate::BakeError;

const FORMAT: &str = "PNG";

/// An open PNG file.
pub(super) struct Png {
    path: PathBuf,
    decoder: Reader<BufReader<File>>,
    shape: Shape,
    row: usize,
}

impl Png {
    pub fn open(path: &Path) -> Result<Self, BakeError> {
        let decoder = start(path)?;
        let info = decoder.info();
        check_size(FORMAT, info.width.into(), info.height.into(), 1)?;
        if info.interlaced {
            return Err(BakeError::Unsupported {
                format: FORMAT,
                feature: "an interlaced picture has its rows in seven passes; save it without interlacing, \
                          or bake it as a whole"
                    .to_owned(),
            });
        }
        // The decoder makes less than 8 bits and palettes plain 8-bit channels.
        let (color, depth) = decoder.output_color_type();
        let shape = Shape {
            width: info.width as usize,
            height: info.height as usize,
            channels: color.samples(),
            numbers: if depth == BitDepth::Sixteen { Numbers::U16 } else { Numbers::U8 },
        };
        Ok(Self { path: path.to_owned(), decoder, shape, row: 0 })
    }
}

fn start(path: &Path) -> Result<Reader<BufReader<File>>, BakeError> {
    let mut decoder = ::png::Decoder::new(reader(path)?);
    decoder.set_transformations(Transformations::EXPAND);
    decoder.read_info().map_err(|error| explain(path, error))
}

impl Source for Png {
    fn shape(&self) -> Shape {
        self.shape
    }

    fn seek(&mut self, row: usize) -> Result<(), BakeError> {
        if row < self.row {
            self.decoder = start(&self.path)?;
            self.row = 0;
        }
        while self.row < row {
            self.decoder.next_row().map_err(|error| explain(&self.path, error))?;
            self.row += 1;
        }
        Ok(())
    }

    fn next_row(&mut self, channel: usize, out: &mut [f64]) -> Result<(), BakeError> {
        let row = self.decoder.next_row().map_err(|error| explain(&self.path, error))?;
        let Some(row) = row else {
            return Err(BakeError::Malformed { format: FORMAT, problem: "rows are missing".to_owned() });
        };
        self.row += 1;
        let channels = self.shape.channels;
        match self.shape.numbers {
            Numbers::U16 => {
                convert(&row.data()[2 * channel..], 2 * channels, out, |b| f64::from(u16::from_be_bytes(b)))
            }
            _ => convert::<1>(&row.data()[channel..], channels, out, |b| f64::from(b[0])),
        }
        Ok(())
    }
}

fn explain(path: &Path, error: DecodingError) -> BakeError {
    match error {
        DecodingError::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            BakeError::Io { action: "read", path: path.to_owned(), source }
        }
        other => BakeError::Malformed { format: FORMAT, problem: other.to_string() },
    }
}
