//! Files that are written by rows.

use std::cell::Cell;
use std::io::Write;
use std::marker::PhantomData;
use std::rc::Rc;

use ::png::{BitDepth, ColorType, Compression, Encoder, EncodingError, Filter};

use crate::BakeError;
use crate::encode::Sample;
use crate::files::replace::Guarded;

/// Which file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Png,
    Npy,
}

/// Samples that are written by rows.
pub(super) trait StreamSample: Sample {
    /// Bits in a PNG.
    const BITS: BitDepth;

    /// The samples as the file has them: big-endian integers, little-endian floats.
    fn put(self, bytes: &mut Vec<u8>);
}

impl StreamSample for u8 {
    const BITS: BitDepth = BitDepth::Eight;

    fn put(self, bytes: &mut Vec<u8>) {
        bytes.push(self);
    }
}

impl StreamSample for u16 {
    const BITS: BitDepth = BitDepth::Sixteen;

    fn put(self, bytes: &mut Vec<u8>) {
        bytes.extend(self.to_be_bytes());
    }
}

impl StreamSample for f32 {
    // Never asked for: there is no PNG of floats.
    const BITS: BitDepth = BitDepth::Sixteen;

    fn put(self, bytes: &mut Vec<u8>) {
        bytes.extend(self.to_le_bytes());
    }
}

/// A file that takes rows.
pub(super) struct Sink<'a, S> {
    target: &'a mut dyn Write,
    /// Where the rows that are done are told to whoever reports them.
    rows: Rc<Cell<(usize, usize)>>,
    /// Whether a blue channel of 0 is added.
    widen: bool,
    bytes: Vec<u8>,
    sample: PhantomData<S>,
}

/// Writes a picture of `[width, height, channels]`: what comes before its rows, the rows that `fill`
/// gives, and what comes after them.
pub(super) fn write_rows<S: StreamSample>(
    file: &mut Guarded<'_, '_>,
    format: Format,
    [width, height, channels]: [usize; 3],
    fill: impl FnOnce(&mut Sink<'_, S>) -> Result<(), BakeError>,
) -> Result<(), BakeError> {
    let rows = file.rows();
    rows.set((0, height));
    let widen = format == Format::Png && channels == 2;
    let sink = |target| Sink { target, rows, widen, bytes: Vec::new(), sample: PhantomData };
    match format {
        Format::Png => {
            let mut encoder = Encoder::new(file, width as u32, height as u32);
            encoder.set_color(if channels == 4 { ColorType::Rgba } else { ColorType::Rgb });
            encoder.set_depth(S::BITS);
            encoder.set_compression(Compression::Fast);
            encoder.set_filter(Filter::Adaptive);
            let mut writer = encoder.write_header().map_err(failed)?;
            let mut stream = writer.stream_writer_with_size(1 << 16).map_err(failed)?;
            fill(&mut sink(&mut stream))?;
            stream.finish().map_err(failed)?;
            writer.finish().map_err(failed)
        }
        Format::Npy => {
            let text = format!(
                "{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}, {channels}), }}"
            );
            // The numbers start at a multiple of 64 bytes; a line break ends the header.
            let length = (10 + text.len() + 1).next_multiple_of(64) - 10;
            let mut head = b"\x93NUMPY\x01\x00".to_vec();
            head.extend((length as u16).to_le_bytes());
            head.extend(format!("{text:<0$}\n", length - 1).into_bytes());
            file.write_all(&head).map_err(|error| failed(error.into()))?;
            fill(&mut sink(file))
        }
    }
}

impl<S: StreamSample> Sink<'_, S> {
    /// Writes whole rows, up to but not including row `done`.
    pub fn write(&mut self, samples: &[S], done: usize) -> Result<(), BakeError> {
        self.bytes.clear();
        if self.widen {
            for texel in samples.chunks_exact(2) {
                for sample in [texel[0], texel[1], S::default()] {
                    sample.put(&mut self.bytes);
                }
            }
        } else {
            samples.iter().for_each(|sample| sample.put(&mut self.bytes));
        }
        self.rows.set((done, self.rows.get().1));
        self.target.write_all(&self.bytes).map_err(|error| failed(error.into()))
    }
}

/// Whatever the system said is kept by the file itself.
fn failed(error: EncodingError) -> BakeError {
    BakeError::Unwritable {
        what: "a map made by rows".to_owned(),
        format: "PNG".to_owned(),
        problem: error.to_string(),
    }
}
