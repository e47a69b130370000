//! Baking by name and saving: what is in the files.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::fs;

use bake::encode::{Range, decode};
use bake::{BakeError, BakeOptions, Baked, FileFormat, Map, Progress, Samples, bake, read_image, save};
use common::{angle, noise};
use heightfield::{Extent, HeightField, Wrap};

fn field() -> HeightField {
    HeightField::new(&noise(33 * 18, 21), 33, 18, Wrap::Repeat).unwrap()
}

fn baked(field: &HeightField, map: Map) -> Baked {
    bake(field, &Extent::default(), map, BakeOptions::default(), Progress::none()).unwrap()
}

#[test]
fn files_hold_what_was_baked() {
    let folder = tempfile::tempdir().unwrap();
    let field = field();
    for map in Map::ALL {
        let baked = baked(&field, map);
        for (format, step) in
            [(FileFormat::Png8, 1.0 / 255.0), (FileFormat::Png16, 1.0 / 65535.0), (FileFormat::Exr, 0.0)]
        {
            let paths = save(&baked, folder.path(), "wall", format).unwrap();
            assert_eq!(paths.len(), baked.layers.len());
            for (path, layer) in paths.iter().zip(&baked.layers) {
                let image = read_image(path).unwrap();
                assert_eq!((image.width, image.height), (layer.width, layer.height));
                let ranges = map.ranges();
                let two_in_png = ranges.len() == 2 && format != FileFormat::Exr;
                assert_eq!(image.channels, if two_in_png { 3 } else { ranges.len() });
                assert_eq!(image.names, ["R", "G", "B", "A"][..image.channels]);
                let padded = [ranges, &[Range::Unit]].concat();
                let read = decode(&image.samples, &padded[..image.channels]);
                for (read, texel) in read.chunks(image.channels).zip(layer.texels.chunks(ranges.len())) {
                    for ((&read, &value), range) in read.iter().zip(texel).zip(ranges) {
                        let slack = if *range == Range::Signed { step } else { 0.5 * step } + 1e-7;
                        match range {
                            Range::LowerBound => assert!(read <= value && value - read <= step + 1e-7),
                            Range::UpperBound => assert!(read >= value && read - value <= step + 1e-7),
                            _ => assert!((read - value).abs() <= slack, "{map:?} {format:?}: {read} {value}"),
                        }
                    }
                    if two_in_png {
                        assert_eq!(read[2], 0.0);
                    }
                }
            }
        }
    }
    let mut names: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".exr"))
        .collect();
    names.sort();
    let expected = ["wall_normal.exr", "wall_normal_xy.exr", "wall_pyramid_00.exr", "wall_pyramid_01.exr"];
    assert_eq!(names[..4], expected);
    assert_eq!(names.len(), 3 + 7);
}

#[test]
fn flat_maps_are_the_usual_blue() {
    let folder = tempfile::tempdir().unwrap();
    let field = HeightField::new(&[0.25; 12], 4, 3, Wrap::Clamp).unwrap();
    let texel = |map, format| {
        let path = &save(&baked(&field, map), folder.path(), "", format).unwrap()[0];
        match read_image(path).unwrap().samples {
            Samples::U8(samples) => samples[..4].iter().map(|&v| u16::from(v)).collect::<Vec<_>>(),
            Samples::U16(samples) => samples[..4].to_vec(),
            Samples::F32(_) => panic!("floats in a PNG"),
        }
    };
    assert_eq!(texel(Map::Normal, FileFormat::Png8), [128, 128, 255, 128]);
    assert_eq!(texel(Map::Normal, FileFormat::Png16), [32768, 32768, 65535, 32768]);
    assert_eq!(texel(Map::Relief, FileFormat::Png8), [128, 128, 255, 64]);
    assert_eq!(texel(Map::NormalXy, FileFormat::Png8), [128, 128, 0, 128]);
    assert!(folder.path().join("normal.png").exists(), "an empty stem leaves no underscore");
}

#[test]
fn eight_bits_cost_less_than_half_a_degree() {
    let field = HeightField::new(&vec![0.0; 64 * 64], 64, 64, Wrap::Repeat).unwrap();
    let flat = baked(&field, Map::Normal);
    let image = flat.image(0, FileFormat::Png8).unwrap();
    let read = decode(&image.samples, Map::Normal.ranges());
    let error = angle([read[0], read[1], read[2]].map(f64::from), [0.0, 0.0, 1.0]);
    // No code stands for 0: half a step along x and y.
    assert!((0.31..0.325).contains(&error), "{error}");
}

#[test]
fn names_round_trip_and_missing_folders_are_an_error() {
    for map in Map::ALL {
        assert_eq!(Map::named(map.name()).unwrap(), map);
        assert!(!map.summary().is_empty());
    }
    let error = Map::named("cones").unwrap_err().to_string();
    assert!(error.contains("normal, normal_xy, relief, pyramid"), "{error}");
    let folder = tempfile::tempdir().unwrap().path().join("missing");
    let error = save(&baked(&field(), Map::Normal), &folder, "a", FileFormat::Png8).unwrap_err();
    assert!(matches!(error, BakeError::Io { action: "write", .. }), "{error}");
}
