//! Random damage to files of every format: an image or an error, never a panic.
//!
//! `PROPTEST_CASES=100000 cargo test --release -p bake --test mutations` digs deeper.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::io::Cursor;
use std::sync::LazyLock;

use bake::{BakeError, decode_image, read_image};
use common::tiff::Tiff;
use common::{data, noise};
use exr::prelude::*;
use image::ImageFormat;
use proptest::prelude::*;
use tiff::encoder::{Compression as TiffCompression, DeflateLevel, Predictor, TiffEncoder, colortype};

fn bytes(n: usize, seed: u64) -> Vec<u8> {
    // Smooth in part, so that every code path of a compressor gets work.
    noise(n, seed)
        .iter()
        .enumerate()
        .map(|(i, v)| if i % 64 < 40 { (i / 7) as u8 } else { (v * 255.0) as u8 })
        .collect()
}

fn raster(format: ImageFormat) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    image::RgbImage::from_raw(19, 11, bytes(19 * 11 * 3, 1)).unwrap().write_to(&mut file, format).unwrap();
    file.into_inner()
}

fn png16() -> Vec<u8> {
    let words = bytes(19 * 11 * 2, 2).chunks(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect();
    let mut file = Cursor::new(Vec::new());
    let image = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_raw(19, 11, words).unwrap();
    image.write_to(&mut file, ImageFormat::Png).unwrap();
    file.into_inner()
}

fn encoded_tiff(compression: TiffCompression, predictor: Predictor) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut encoder =
        TiffEncoder::new(&mut file).unwrap().with_compression(compression).with_predictor(predictor);
    let mut image = encoder.new_image::<colortype::Gray16>(19, 11).unwrap();
    image.rows_per_strip(4).unwrap();
    let words: Vec<u16> = bytes(19 * 11, 3).into_iter().map(|b| u16::from(b) * 200).collect();
    image.write_data(&words).unwrap();
    file.into_inner()
}

fn tiles(planar: u32, format: u32, bits: u32) -> Vec<u8> {
    let bytes_per_tile = 256 * bits as usize / 8 * if planar == 1 { 2 } else { 1 };
    let chunks = (0..if planar == 1 { 4 } else { 8 }).map(|seed| bytes(bytes_per_tile, seed)).collect();
    Tiff { samples: 2, planar, chunk: (16, 16), chunks, ..Tiff::grey(19, 21, bits, format, vec![]) }.bytes()
}

fn openexr(compression: Compression, blocks: Blocks) -> Vec<u8> {
    let n = 37 * 41;
    let single = noise(n, 4);
    let half = single.iter().map(|&v| f16::from_f32(v)).collect();
    let whole = (0..n as u32).collect();
    let list = SmallVec::from_iter([
        AnyChannel::new("B", FlatSamples::F32(single)),
        AnyChannel::new("R", FlatSamples::F16(half)),
        AnyChannel::new("Z", FlatSamples::U32(whole)),
    ]);
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new((37, 41), LayerAttributes::named("main"), encoding, AnyChannels::sort(list));
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut file).unwrap();
    file.into_inner()
}

/// Whole files of every format and compression.
static SEEDS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let mut seeds = vec![png16()];
    for format in [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Bmp, ImageFormat::WebP] {
        seeds.push(raster(format));
    }
    for compression in [
        TiffCompression::Uncompressed,
        TiffCompression::Lzw,
        TiffCompression::Deflate(DeflateLevel::Fast),
        TiffCompression::Packbits,
    ] {
        seeds.push(encoded_tiff(compression, Predictor::Horizontal));
    }
    seeds.extend([tiles(1, 3, 32), tiles(2, 3, 32), tiles(2, 1, 8), tiles(1, 2, 16)]);
    seeds.push(Tiff::grey(19, 11, 1, 1, bytes(33, 5)).bytes());
    let floats = |bits: u32| Tiff::grey(19, 11, bits, 3, bytes(19 * 11 * bits as usize / 8, 6));
    seeds.extend([16, 32, 64].map(|bits| Tiff { predictor: 3, ..floats(bits) }.bytes()));
    let strips = [4, 4, 3, 4, 4, 3].map(|rows| bytes(19 * rows, 7)).to_vec();
    seeds.push(
        Tiff { samples: 2, planar: 2, chunk: (0, 4), chunks: strips, ..Tiff::grey(19, 11, 8, 1, vec![]) }
            .bytes(),
    );
    for path in ["playcanvas/parallax_thumb.webp", "panda3d/layingrock-h.jpg"] {
        seeds.extend(data(path).map(|path| std::fs::read(path).unwrap()));
    }
    for name in ["basi3p02", "tbbn3p08", "basn0g04", "basi6a16", "g03n0g16", "ps2n2c16"] {
        seeds
            .extend(data(&format!("malformed/pngsuite/{name}.png")).map(|path| std::fs::read(path).unwrap()));
    }
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ] {
        seeds.push(openexr(compression, Blocks::ScanLines));
        seeds.push(openexr(compression, Blocks::Tiles(Vec2(16, 16))));
    }
    seeds
});

fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// Makes the checksums of a PNG file right again, so that damage gets past them.
fn mend(file: &mut [u8]) {
    let mut at = 8;
    while let Some(length) = file.get(at..at + 4) {
        let length = u32::from_be_bytes(length.try_into().unwrap()) as usize;
        let Some(end) = length.checked_add(at + 8).filter(|end| end + 4 <= file.len()) else { return };
        let sum = crc(&file[at + 4..end]).to_be_bytes();
        file[end..end + 4].copy_from_slice(&sum);
        at = end + 4;
    }
}

/// One piece of damage: where (as a share of the file, small ones being likelier), what.
#[derive(Debug, Clone)]
enum Damage {
    Set(f64, u8),
    Word(f64, u32),
    Cut(f64),
    Repeat(f64, usize),
}

fn damage() -> impl Strategy<Value = Damage> {
    let place = prop_oneof![0.0..1.0, (0.0_f64..1.0).prop_map(|x| x.powi(4))];
    let byte = prop_oneof![any::<u8>(), Just(0), Just(1), Just(0x7f), Just(0x80), Just(0xff)];
    let word =
        prop_oneof![any::<u32>(), Just(0), Just(1), Just(u32::MAX), Just(1 << 31), Just(100_000), 0..300_u32];
    prop_oneof![
        6 => (place.clone(), byte).prop_map(|(at, byte)| Damage::Set(at, byte)),
        3 => (place.clone(), word).prop_map(|(at, word)| Damage::Word(at, word)),
        1 => place.clone().prop_map(Damage::Cut),
        1 => (place, 1..40_usize).prop_map(|(at, length)| Damage::Repeat(at, length)),
    ]
}

fn apply(file: &mut Vec<u8>, damage: &[Damage]) {
    for damage in damage {
        let at = |share: f64| (share * file.len() as f64) as usize;
        match *damage {
            Damage::Set(share, byte) => {
                if let Some(target) = {
                    let at = at(share);
                    file.get_mut(at)
                } {
                    *target = byte;
                }
            }
            Damage::Word(share, word) => {
                let at = at(share);
                if let Some(target) = file.get_mut(at..at + 4) {
                    target.copy_from_slice(&word.to_le_bytes());
                }
            }
            Damage::Cut(share) => file.truncate(at(share)),
            Damage::Repeat(share, length) => {
                let at = at(share);
                let part = file[at..(at + length).min(file.len())].to_vec();
                file.splice(at..at, part);
            }
        }
    }
}

#[test]
fn the_seeds_are_whole() {
    for (i, seed) in SEEDS.iter().enumerate() {
        decode_image(seed).unwrap_or_else(|error| panic!("seed {i}: {error}"));
    }
}

#[test]
fn a_cut_file_is_never_an_image() {
    for (i, seed) in SEEDS.iter().enumerate() {
        // The very end may be dispensable: padding, trailers, the next directory's offset.
        for length in (0..seed.len().saturating_sub(24)).step_by(7) {
            assert!(decode_image(&seed[..length]).is_err(), "seed {i}, {length} of {} bytes", seed.len());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_an_image_or_an_error(
        seed in 0..SEEDS.len(),
        damage in prop::collection::vec(damage(), 1..5),
    ) {
        let mut file = SEEDS[seed].clone();
        apply(&mut file, &damage);
        if file.starts_with(b"\x89PNG") {
            mend(&mut file);
        }
        if let Ok(image) = decode_image(&file) {
            prop_assert!(image.validate().is_ok());
            prop_assert_eq!(image.names.len(), image.channels);
        }
    }

    #[test]
    fn noise_behind_a_magic_number_is_harmless(
        magic in prop::sample::select(vec![
            &b"\x89PNG\r\n\x1a\n"[..], b"\xff\xd8\xff", b"BM", b"RIFF\x40\0\0\0WEBP", b"II*\0", b"MM\0*", b"II+\0",
            b"\x76\x2f\x31\x01\x02\0\0\0",
        ]),
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let _ = decode_image(&[magic, &noise].concat());
    }

    #[test]
    fn damaged_tga_files(damage in prop::collection::vec(damage(), 1..5)) {
        let mut file = raster(ImageFormat::Tga);
        apply(&mut file, &damage);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("damaged.tga");
        std::fs::write(&path, file).unwrap();
        let read_at_all = !matches!(read_image(&path), Err(BakeError::Io { .. }));
        prop_assert!(read_at_all);
    }
}
