//! TIFF files built byte by byte.
#![allow(dead_code, missing_docs, clippy::unwrap_used)] // each test binary uses some of it

use bake::{Samples, decode_image};

/// A little-endian TIFF of uncompressed chunks.
pub struct Tiff {
    pub width: u32,
    pub height: u32,
    pub bits: u32,
    pub samples: u32,
    /// 1 unsigned, 2 signed, 3 float.
    pub format: u32,
    /// 0 white is zero, 1 black is zero, 2 RGB, 3 palette.
    pub photometric: u32,
    /// 1 interleaved, 2 planes.
    pub planar: u32,
    /// Size of tiles, or rows a strip with a width of 0.
    pub chunk: (u32, u32),
    pub chunks: Vec<Vec<u8>>,
    /// 1 none, 2 horizontal, 3 floating point.
    pub predictor: u32,
}

impl Tiff {
    pub fn grey(width: u32, height: u32, bits: u32, format: u32, data: Vec<u8>) -> Self {
        let chunk = (0, height);
        Self {
            width,
            height,
            bits,
            samples: 1,
            format,
            photometric: 1,
            planar: 1,
            chunk,
            chunks: vec![data],
            predictor: 1,
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = b"II*\0\0\0\0\0".to_vec();
        let mut offsets = Vec::new();
        for chunk in &self.chunks {
            offsets.push(bytes.len() as u32);
            bytes.extend(chunk);
        }
        let counts: Vec<u32> = self.chunks.iter().map(|chunk| chunk.len() as u32).collect();
        let each = |value: u32| vec![value; self.samples as usize];
        let mut tags: Vec<(u16, Vec<u32>)> = vec![
            (256, vec![self.width]),
            (257, vec![self.height]),
            (258, each(self.bits)),
            (259, vec![1]),
            (262, vec![self.photometric]),
            (277, vec![self.samples]),
            (284, vec![self.planar]),
            (317, vec![self.predictor]),
            (339, each(self.format)),
        ];
        if self.chunk.0 == 0 {
            tags.extend([(273, offsets), (278, vec![self.chunk.1]), (279, counts)]);
        } else {
            tags.extend([
                (322, vec![self.chunk.0]),
                (323, vec![self.chunk.1]),
                (324, offsets),
                (325, counts),
            ]);
        }
        tags.sort();
        let mut entries = (tags.len() as u16).to_le_bytes().to_vec();
        for (tag, values) in tags {
            entries.extend(tag.to_le_bytes());
            entries.extend(4_u16.to_le_bytes());
            entries.extend((values.len() as u32).to_le_bytes());
            if let [value] = values[..] {
                entries.extend(value.to_le_bytes());
            } else {
                entries.extend((bytes.len() as u32).to_le_bytes());
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
        }
        let directory = bytes.len() as u32;
        bytes[4..8].copy_from_slice(&directory.to_le_bytes());
        bytes.extend(entries);
        bytes.extend([0; 4]);
        bytes
    }

    pub fn decode(&self) -> Samples {
        decode_image(&self.bytes()).unwrap().samples
    }
}
