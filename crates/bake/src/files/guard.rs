//! Limits on what a file may ask for.

use crate::BakeError;
use crate::memory::available_memory;

/// Most samples an image may have.
const MAX_SAMPLES: u128 = 1 << 31;
/// Images up to this many bytes are decoded without asking whether that makes sense.
const SMALL: u128 = 64 << 20;
/// Most decoded bytes for a byte of file beyond that. Deflate reaches 1032, times 8 when bits are
/// expanded to bytes; only a file made to fill memory goes further.
const MAX_RATIO: u128 = 1 << 14;

/// Size of an image as the header of a file claims it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Claim {
    pub format: &'static str,
    pub width: u64,
    pub height: u64,
    pub channels: u64,
    pub bytes_per_sample: u64,
    /// Bytes in the file.
    pub file_bytes: usize,
}

impl Claim {
    /// Number of samples, once it is sure that they can be had.
    ///
    /// # Errors
    /// [`BakeError::Malformed`] for an empty image, [`BakeError::TooLarge`].
    pub fn samples(&self) -> Result<usize, BakeError> {
        let samples = u128::from(self.width) * u128::from(self.height) * u128::from(self.channels);
        let bytes = samples * u128::from(self.bytes_per_sample);
        let too_large = |limit: String| BakeError::TooLarge {
            width: self.width,
            height: self.height,
            channels: self.channels,
            bytes,
            limit,
        };
        if samples == 0 {
            let problem =
                format!("the image is {} x {} texels x {} samples", self.width, self.height, self.channels);
            return Err(BakeError::Malformed { format: self.format, problem });
        }
        if samples > MAX_SAMPLES {
            return Err(too_large(format!("at most {MAX_SAMPLES} samples are accepted")));
        }
        if bytes > SMALL {
            if bytes > self.file_bytes as u128 * MAX_RATIO {
                return Err(too_large(format!("a file of {} bytes cannot hold that", self.file_bytes)));
            }
            if let Some(free) = available_memory().filter(|&free| bytes > u128::from(free)) {
                return Err(too_large(format!("{free} bytes of memory are available")));
            }
        }
        usize::try_from(samples).map_err(|_| too_large("this machine cannot address that".to_owned()))
    }

    /// A zeroed buffer for all samples.
    ///
    /// # Errors
    /// See [`Claim::samples`]; [`BakeError::TooLarge`] also when the system refuses the memory.
    pub fn buffer<T: Copy + Default>(&self) -> Result<Vec<T>, BakeError> {
        let samples = self.samples()?;
        let mut buffer = Vec::new();
        buffer.try_reserve_exact(samples).map_err(|_| BakeError::TooLarge {
            width: self.width,
            height: self.height,
            channels: self.channels,
            bytes: samples as u128 * size_of::<T>() as u128,
            limit: "the system refused the memory".to_owned(),
        })?;
        buffer.resize(samples, T::default());
        Ok(buffer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(width: u64, height: u64, file_bytes: usize) -> Result<usize, BakeError> {
        Claim { format: "PNG", width, height, channels: 1, bytes_per_sample: 2, file_bytes }.samples()
    }

    #[test]
    fn sensible_claims_pass_and_others_say_how_much_they_want() {
        assert_eq!(claim(4096, 4096, 1000).unwrap(), 1 << 24);
        assert!(matches!(claim(0, 7, 10), Err(BakeError::Malformed { .. })));
        let error = claim(100_000, 100_000, 1 << 30).unwrap_err().to_string();
        assert!(error.contains("20000000000 bytes"), "{error}");
        let error = claim(20_000, 20_000, 100).unwrap_err().to_string();
        assert!(error.contains("800000000 bytes") && error.contains("100 bytes"), "{error}");
        assert!(claim(u64::MAX, u64::MAX, 100).is_err());
    }
}
