//! An image as it is stored in a file.

use crate::BakeError;

/// Samples of an image, all of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// 0..255 mean 0..1.
    U8(Vec<u8>),
    /// 0..65535 mean 0..1.
    U16(Vec<u16>),
    /// Numbers as they are.
    F32(Vec<f32>),
}

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Samples::U8(samples) => samples.len(),
            Samples::U16(samples) => samples.len(),
            Samples::F32(samples) => samples.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What a sample is called in messages.
    pub fn type_name(&self) -> &'static str {
        match self {
            Samples::U8(_) => "8-bit integers",
            Samples::U16(_) => "16-bit integers",
            Samples::F32(_) => "floats",
        }
    }
}

/// An image: `height * width * channels` samples, row by row from the top, channels interleaved.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Texels across.
    pub width: usize,
    /// Texels down.
    pub height: usize,
    /// Samples a texel.
    pub channels: usize,
    /// The samples.
    pub samples: Samples,
    /// Channel names, one a channel: `R G B A`, `Y` for grey, or what an EXR file calls them.
    pub names: Vec<String>,
    /// What a reader of heights should know about the file, such as "JPEG is lossy". None of it
    /// matters for colour.
    pub warnings: Vec<String>,
}

impl Image {
    /// An image with the usual channel names: `Y`, `Y A`, `R G B`, `R G B A`, else `C0 C1 ...`.
    ///
    /// # Errors
    /// [`BakeError::Shape`] when a side or `channels` is 0 or the number of samples does not match.
    pub fn new(width: usize, height: usize, channels: usize, samples: Samples) -> Result<Self, BakeError> {
        let names = match channels {
            1 => vec!["Y".to_owned()],
            2 => vec!["Y".to_owned(), "A".to_owned()],
            3 | 4 => ["R", "G", "B", "A"][..channels].iter().map(|&name| name.to_owned()).collect(),
            _ => (0..channels).map(|channel| format!("C{channel}")).collect(),
        };
        Self::named(width, height, names, samples)
    }

    /// An image whose channels have the given names.
    ///
    /// # Errors
    /// [`BakeError::Shape`], see [`Image::new`].
    pub fn named(
        width: usize,
        height: usize,
        names: Vec<String>,
        samples: Samples,
    ) -> Result<Self, BakeError> {
        let channels = names.len();
        let image = Self { width, height, channels, samples, names, warnings: Vec::new() };
        image.validate()?;
        Ok(image)
    }

    /// Checks that size and number of samples agree and nothing is empty.
    ///
    /// # Errors
    /// [`BakeError::Shape`].
    pub fn validate(&self) -> Result<(), BakeError> {
        let expected =
            self.width.checked_mul(self.height).and_then(|texels| texels.checked_mul(self.channels));
        if expected == Some(self.samples.len()) && !self.samples.is_empty() {
            return Ok(());
        }
        Err(BakeError::Shape {
            width: self.width,
            height: self.height,
            channels: self.channels,
            got: self.samples.len(),
        })
    }

    /// One channel as floats, integers scaled to 0..1; `None` when there is no such channel.
    pub fn channel_f32(&self, channel: usize) -> Option<Vec<f32>> {
        if channel >= self.channels {
            return None;
        }
        Some(match &self.samples {
            Samples::U8(samples) => {
                samples.iter().skip(channel).step_by(self.channels).map(|&v| unit_u8(v)).collect()
            }
            Samples::U16(samples) => {
                samples.iter().skip(channel).step_by(self.channels).map(|&v| unit_u16(v)).collect()
            }
            Samples::F32(samples) => samples.iter().skip(channel).step_by(self.channels).copied().collect(),
        })
    }

    /// All samples as floats, integers scaled to 0..1.
    pub fn to_f32(&self) -> Vec<f32> {
        match &self.samples {
            Samples::U8(samples) => samples.iter().map(|&v| unit_u8(v)).collect(),
            Samples::U16(samples) => samples.iter().map(|&v| unit_u16(v)).collect(),
            Samples::F32(samples) => samples.clone(),
        }
    }

    /// The index of the channel of that name, upper and lower case alike.
    pub fn channel_named(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|candidate| candidate.eq_ignore_ascii_case(name))
    }
}

// A division, not a product with 1/255: it is correctly rounded, so the result is *the* float
// nearest to k/255 and the way back is exact.
#[inline]
fn unit_u8(value: u8) -> f32 {
    f32::from(value) / 255.0
}

#[inline]
fn unit_u16(value: u16) -> f32 {
    f32::from(value) / 65535.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_come_out_in_order_and_in_range() {
        let image = Image::new(2, 1, 3, Samples::U8(vec![0, 51, 255, 255, 102, 0])).unwrap();
        assert_eq!(image.channel_f32(1).unwrap(), [0.2, 0.4]);
        assert_eq!(image.channel_f32(2).unwrap(), [1.0, 0.0]);
        assert_eq!(image.channel_f32(3), None);
        assert_eq!(image.to_f32()[3], 1.0);
        assert_eq!(image.channel_named("b"), Some(2));
    }

    #[test]
    fn wrong_shapes_are_refused() {
        for (w, h, c, n) in [(2, 2, 1, 3), (0, 2, 1, 0), (2, 2, 0, 0), (usize::MAX, 2, 2, 4)] {
            let error = Image::new(w, h, c, Samples::U8(vec![0; n])).unwrap_err();
            assert!(matches!(error, BakeError::Shape { .. }), "{error}");
        }
    }
}
