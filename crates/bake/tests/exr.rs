//! EXR varieties: channel names, sample types, tiles, compressions, windows, parts.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::io::Cursor;

use bake::{BakeError, Samples, decode_image};
use common::noise;
use exr::prelude::*;

const SIZE: (usize, usize) = (70, 41);

fn floats(seed: u64) -> Vec<f32> {
    noise(SIZE.0 * SIZE.1, seed)
}

fn layer(channels: &[(&str, FlatSamples)], encoding: Encoding) -> Layer<AnyChannels<FlatSamples>> {
    let list = channels.iter().map(|(name, samples)| AnyChannel::new(*name, samples.clone())).collect();
    Layer::new(SIZE, LayerAttributes::named("main"), encoding, AnyChannels::sort(list))
}

fn bytes(layer: Layer<AnyChannels<FlatSamples>>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn lossless_compressions_scan_lines_and_tiles() {
    let samples = floats(1);
    for compression in
        [Compression::Uncompressed, Compression::RLE, Compression::ZIP1, Compression::ZIP16, Compression::PIZ]
    {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 32))] {
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let file = bytes(layer(&[("Y", FlatSamples::F32(samples.clone()))], encoding));
            let image =
                decode_image(&file).unwrap_or_else(|error| panic!("{compression:?} {blocks:?}: {error}"));
            assert_eq!((image.width, image.height), SIZE);
            assert_eq!(image.samples, Samples::F32(samples.clone()), "{compression:?} {blocks:?}");
            assert!(image.warnings.is_empty());
        }
    }
}

#[test]
fn channels_of_all_types_in_a_sensible_order() {
    let half: Vec<f16> = floats(2).into_iter().map(f16::from_f32).collect();
    let whole: Vec<u32> = (0..SIZE.0 * SIZE.1).map(|i| i as u32 * 3).collect();
    let single = floats(3);
    let channel = || FlatSamples::F16(half.clone());
    let file = |channels: &[(&str, FlatSamples)]| bytes(layer(channels, Encoding::FAST_LOSSLESS));
    let names = |names: &[&str]| {
        let channels: Vec<_> = names.iter().map(|&name| (name, channel())).collect();
        decode_image(&file(&channels)).unwrap().names
    };
    assert_eq!(names(&["R", "G", "B", "A"]), ["R", "G", "B", "A"]);
    assert_eq!(names(&["A", "B", "G", "R", "Z"]), ["R", "G", "B", "A", "Z"]);
    assert_eq!(names(&["A", "Y"]), ["Y", "A"]);
    assert_eq!(names(&["X", "Y", "Z"]), ["X", "Y", "Z"]);
    assert_eq!(names(&["diffuse.R", "diffuse.G", "diffuse.B"]), ["diffuse.R", "diffuse.G", "diffuse.B"]);
    assert_eq!(names(&["height", "ao"]), ["ao", "height"]);
    let image = decode_image(&file(&[
        ("Z", FlatSamples::F32(single.clone())),
        ("height", channel()),
        ("id", FlatSamples::U32(whole.clone())),
    ]))
    .unwrap();
    assert_eq!(image.names, ["Z", "height", "id"]);
    assert_eq!(image.channel_f32(0).unwrap(), single);
    assert_eq!(image.channel_f32(1).unwrap(), half.iter().map(|h| h.to_f32()).collect::<Vec<_>>());
    assert_eq!(image.channel_f32(2).unwrap(), whole.iter().map(|&v| v as f32).collect::<Vec<_>>());
}

#[test]
fn the_image_is_the_display_window() {
    let samples = floats(4);
    for (at, display) in
        [((-5, -7), (60, 30)), ((3, 2), (100, 50)), ((-69, -40), (1, 1)), ((200, 0), (20, 20))]
    {
        let mut layer = layer(&[("Y", FlatSamples::F32(samples.clone()))], Encoding::SMALL_LOSSLESS);
        layer.attributes.layer_position = Vec2(at.0, at.1);
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = IntegerBounds::new((0, 0), display);
        let mut file = Cursor::new(Vec::new());
        image.write().to_buffered(&mut file).unwrap();
        let image = decode_image(file.get_ref()).unwrap();
        assert_eq!((image.width, image.height), display);
        assert!(image.warnings[0].contains("missing pixels are 0"), "{:?}", image.warnings);
        let Samples::F32(found) = &image.samples else { panic!() };
        for (i, &value) in found.iter().enumerate() {
            let (x, y) = ((i % display.0) as i32 - at.0, (i / display.0) as i32 - at.1);
            let inside = (0..SIZE.0 as i32).contains(&x) && (0..SIZE.1 as i32).contains(&y);
            let expected = if inside { samples[y as usize * SIZE.0 + x as usize] } else { 0.0 };
            assert_eq!(value, expected, "{at:?} {display:?} {x} {y}");
        }
    }
}

#[test]
fn of_several_parts_the_first_is_read_and_of_levels_the_largest() {
    let mut parts =
        [5, 6].map(|seed| layer(&[("Y", FlatSamples::F32(floats(seed)))], Encoding::FAST_LOSSLESS));
    parts[1].attributes.layer_name = Some(Text::from("other"));
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(SIZE));
    let mut file = Cursor::new(Vec::new());
    Image::empty(attributes)
        .with_layer(parts[0].clone())
        .with_layer(parts[1].clone())
        .write()
        .to_buffered(&mut file)
        .unwrap();
    let image = decode_image(file.get_ref()).unwrap();
    assert_eq!(image.samples, Samples::F32(floats(5)));
    assert!(image.warnings[0].contains("2 parts"), "{:?}", image.warnings);

    let large = noise(32 * 32, 7);
    let level_data: Vec<FlatSamples> =
        [32, 16, 8, 4, 2, 1].iter().map(|&n| FlatSamples::F32(large[..n * n].to_vec())).collect();
    let levels = Levels::Mip { rounding_mode: exr::math::RoundingMode::Down, level_data };
    let channels = AnyChannels::sort(SmallVec::from_iter([AnyChannel::new("Y", levels)]));
    let encoding = Encoding { blocks: Blocks::Tiles(Vec2(8, 8)), ..Encoding::FAST_LOSSLESS };
    let mut file = Cursor::new(Vec::new());
    let layer = Layer::new((32, 32), LayerAttributes::default(), encoding, channels);
    Image::from_layer(layer).write().to_buffered(&mut file).unwrap();
    assert_eq!(decode_image(file.get_ref()).unwrap().samples, Samples::F32(large));
}

/// A small file and where its one channel is described: name, type, flags, sampling.
fn patchable() -> (Vec<u8>, usize) {
    let file = bytes(layer(&[("Y", FlatSamples::F32(floats(8)))], Encoding::UNCOMPRESSED));
    let at = file.windows(7).position(|window| window == b"chlist\0").unwrap() + 7 + 4;
    assert_eq!(&file[at..at + 2], b"Y\0");
    (file, at + 2)
}

#[test]
fn subsampled_and_inconsistent_files_are_refused() {
    let (file, channel) = patchable();
    let mut subsampled = file.clone();
    subsampled[channel + 8] = 2;
    let error = decode_image(&subsampled).unwrap_err();
    assert!(error.to_string().contains("sampl"), "{error}");

    // The offset table follows the header's closing zero; its first two entries made equal.
    let last = 8 * SIZE.1 + SIZE.1 * (8 + 4 * SIZE.0);
    let table = file.len() - last;
    let mut twice = file.clone();
    twice.copy_within(table..table + 8, table + 8);
    let error = decode_image(&twice).unwrap_err();
    assert!(matches!(error, BakeError::Malformed { format: "EXR", .. }), "{error}");
    assert!(error.to_string().contains("chunk table"), "{error}");

    let mut huge = file.clone();
    let window = file.windows(11).position(|window| window == b"dataWindow\0").unwrap() + 11 + 6 + 4;
    huge[window + 8..window + 16].copy_from_slice(&[0x9f, 0x86, 1, 0, 0x9f, 0x86, 1, 0]);
    assert!(decode_image(&huge).is_err());
    let display = file.windows(14).position(|window| window == b"displayWindow\0").unwrap() + 14 + 6 + 4;
    let mut huge = file.clone();
    huge[display + 8..display + 16].copy_from_slice(&[0x9f, 0x86, 1, 0, 0x9f, 0x86, 1, 0]);
    let error = decode_image(&huge).unwrap_err();
    assert!(matches!(error, BakeError::TooLarge { bytes: 40_000_000_000, .. }), "{error}");

    for length in (0..file.len()).step_by(13) {
        decode_image(&file[..length]).unwrap_err();
    }
}
