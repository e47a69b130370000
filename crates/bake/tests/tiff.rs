//! TIFF varieties, from files built here byte by byte.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use bake::{BakeError, Samples, decode_image};
use common::tiff::Tiff;
use half::f16;

fn le<const N: usize, T: Copy>(values: &[T], bytes: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    values.iter().flat_map(|&value| bytes(value)).collect()
}

#[test]
fn every_sample_type() {
    let unit = [0_u32, 1 << 31, u32::MAX];
    let grey = |bits, format, data| Tiff::grey(3, 1, bits, format, data).decode();
    assert_eq!(grey(8, 1, vec![1, 2, 3]), Samples::U8(vec![1, 2, 3]));
    assert_eq!(grey(16, 1, le(&[1, 500, 65535], u16::to_le_bytes)), Samples::U16(vec![1, 500, 65535]));
    assert_eq!(grey(32, 1, le(&unit, u32::to_le_bytes)), Samples::F32(vec![0.0, 0.5, 1.0]));
    let wide = unit.map(|v| u64::from(v) << 32);
    assert_eq!(grey(64, 1, le(&wide, u64::to_le_bytes)), Samples::F32(vec![0.0, 0.5, 1.0]));
    let numbers = Samples::F32(vec![-2.0, 0.5, 1000.0]);
    let values = [-2.0, 0.5, 1000.0];
    assert_eq!(grey(16, 3, le(&values, |v| f16::from_f64(v).to_le_bytes())), numbers);
    assert_eq!(grey(32, 3, le(&values.map(|v| v as f32), f32::to_le_bytes)), numbers);
    assert_eq!(grey(64, 3, le(&values, f64::to_le_bytes)), numbers);
    let metres = Samples::F32(vec![-12.0, 0.0, 120.0]);
    assert_eq!(grey(8, 2, le(&[-12, 0, 120], i8::to_le_bytes)), metres);
    assert_eq!(grey(16, 2, le(&[-12, 0, 120], i16::to_le_bytes)), metres);
    assert_eq!(grey(32, 2, le(&[-12, 0, 120], i32::to_le_bytes)), metres);
    assert_eq!(grey(64, 2, le(&[-12, 0, 120], i64::to_le_bytes)), metres);
    let image = decode_image(&Tiff::grey(1, 1, 16, 2, vec![1, 0]).bytes()).unwrap();
    assert!(image.warnings[0].contains("signed"), "{:?}", image.warnings);
}

#[test]
fn few_bits_are_widened_and_white_may_be_zero() {
    let grey = |bits, data| Tiff::grey(3, 2, bits, 1, data);
    assert_eq!(grey(1, vec![0b1010_0000, 0b0110_0000]).decode(), Samples::U8(vec![255, 0, 255, 0, 255, 255]));
    assert_eq!(grey(2, vec![0b0001_1000, 0b1110_0000]).decode(), Samples::U8(vec![0, 85, 170, 255, 170, 0]));
    assert_eq!(grey(4, vec![0x01, 0x20, 0xf3, 0x40]).decode(), Samples::U8(vec![0, 17, 34, 255, 51, 68]));
    let inverted = Tiff { photometric: 0, ..grey(1, vec![0b1010_0000, 0b0110_0000]) };
    assert_eq!(inverted.decode(), Samples::U8(vec![0, 255, 0, 255, 0, 0]));
    let inverted = Tiff { photometric: 0, ..grey(8, vec![0, 1, 2, 253, 254, 255]) };
    assert_eq!(inverted.decode(), Samples::U8(vec![255, 254, 253, 2, 1, 0]));
}

#[test]
fn strips_tiles_and_planes_give_the_same_picture() {
    let (w, h) = (37_u32, 21_u32);
    let value = |x: u32, y: u32, c: u32| (x * 1000 + y * 37 + c * 7) as f32 / 7.0;
    let region = |x0: u32, y0: u32, rw: u32, rh: u32, channels: &[u32]| -> Vec<u8> {
        let mut data = Vec::new();
        for y in y0..y0 + rh {
            for x in x0..x0 + rw {
                for &c in channels {
                    // Tiles reach beyond the picture; what is there must not matter.
                    let value = if x < w && y < h { value(x, y, c) } else { f32::NAN };
                    data.extend(value.to_le_bytes());
                }
            }
        }
        data
    };
    let all = [0, 1, 2];
    let expected: Vec<f32> =
        (0..h).flat_map(|y| (0..w).flat_map(move |x| all.map(|c| value(x, y, c)))).collect();
    let rgb = |planar, chunk, chunks| Tiff {
        samples: 3,
        photometric: 2,
        planar,
        chunk,
        chunks,
        ..Tiff::grey(w, h, 32, 3, vec![])
    };
    let strips = (0..h).step_by(4).map(|y| region(0, y, w, 4.min(h - y), &all)).collect();
    let tiles = |channels: &[u32]| -> Vec<Vec<u8>> {
        let row = |y| (0..w).step_by(16).map(move |x| (x, y));
        (0..h).step_by(16).flat_map(row).map(|(x, y)| region(x, y, 16, 16, channels)).collect()
    };
    let planes = all.iter().map(|&c| region(0, 0, w, h, &[c])).collect();
    let tiled_planes = all.iter().flat_map(|&c| tiles(&[c])).collect();
    for tiff in [
        rgb(1, (0, 4), strips),
        rgb(1, (16, 16), tiles(&all)),
        rgb(2, (0, h), planes),
        rgb(2, (16, 16), tiled_planes),
    ] {
        assert_eq!(
            tiff.decode(),
            Samples::F32(expected.clone()),
            "planar {} chunk {:?}",
            tiff.planar,
            tiff.chunk
        );
    }
}

#[test]
fn compressed_strips() {
    use tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, colortype};
    let floats: Vec<f32> = (0..64 * 50).map(|i| (i % 97) as f32 / 96.0).collect();
    let words: Vec<u16> = (0..64 * 50).map(|i| (i * 20 % 65521) as u16).collect();
    for compression in [
        Compression::Uncompressed,
        Compression::Lzw,
        Compression::Deflate(DeflateLevel::Best),
        Compression::Packbits,
    ] {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut bytes).unwrap().with_compression(compression);
        encoder.write_image::<colortype::Gray32Float>(64, 50, &floats).unwrap();
        assert_eq!(decode_image(bytes.get_ref()).unwrap().samples, Samples::F32(floats.clone()),);
        let mut bytes = std::io::Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new_big(&mut bytes)
            .unwrap()
            .with_compression(compression)
            .with_predictor(Predictor::Horizontal);
        encoder.write_image::<colortype::Gray16>(64, 50, &words).unwrap();
        assert_eq!(decode_image(bytes.get_ref()).unwrap().samples, Samples::U16(words.clone()),);
    }
}

#[test]
fn several_bands_come_under_neutral_names() {
    let tiff = Tiff { samples: 5, ..Tiff::grey(1, 1, 8, 1, vec![1, 2, 3, 4, 5]) };
    let image = decode_image(&tiff.bytes()).unwrap();
    assert_eq!(image.samples, Samples::U8(vec![1, 2, 3, 4, 5]));
    assert_eq!(image.names[4], "C4");
}

#[test]
fn broken_and_foreign_files_are_refused() {
    let refuse = |tiff: Tiff| decode_image(&tiff.bytes()).unwrap_err();
    let good = || Tiff::grey(3, 2, 8, 1, vec![0; 6]);
    decode_image(&good().bytes()).unwrap();
    let palette = refuse(Tiff { photometric: 3, ..good() });
    assert!(matches!(palette, BakeError::Unsupported { format: "TIFF", .. }), "{palette}");
    assert!(matches!(refuse(Tiff { bits: 12, ..good() }), BakeError::Unsupported { .. }));
    assert!(matches!(refuse(Tiff { width: 0, ..good() }), BakeError::Malformed { .. }));
    assert!(matches!(
        refuse(Tiff { width: 100_000, height: 100_000, chunk: (0, 100_000), ..good() }),
        BakeError::TooLarge { .. }
    ));
    assert!(matches!(refuse(Tiff { chunk: (0, 1), ..good() }), BakeError::Malformed { .. }));
    assert!(matches!(refuse(Tiff { chunk: (0, 0), ..good() }), BakeError::Malformed { .. }));
    assert!(matches!(refuse(Tiff { chunk: (1 << 30, 1 << 30), ..good() }), BakeError::TooLarge { .. }));
    let bytes = good().bytes();
    for length in 0..bytes.len() - 4 {
        decode_image(&bytes[..length]).unwrap_err();
    }
}
