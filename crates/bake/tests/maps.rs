//! Baking by name and saving: what is in the files.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::fs;
use std::path::{Path, PathBuf};

use bake::encode::{Depth, Range, Rounding, decode};
use bake::maps::REGISTRY;
use bake::{
    BakeError, Baked, FileFormat, Form, Map, Progress, Samples, Texels, bake, bake_encoded, bake_rows,
    read_image, save,
};
use common::{angle, noise};
use heightfield::{HeightField, Wrap};

const FORMATS: [(FileFormat, f32); 6] = [
    (FileFormat::Png8, 1.0 / 255.0),
    (FileFormat::Png16, 1.0 / 65535.0),
    (FileFormat::Tiff8, 1.0 / 255.0),
    (FileFormat::Tiff16, 1.0 / 65535.0),
    (FileFormat::Tiff32, 0.0),
    (FileFormat::Exr, 0.0),
];

fn field() -> HeightField {
    HeightField::new(&noise(33 * 18, 21), 33, 18, Wrap::Repeat).unwrap()
}

fn baked(field: &HeightField, map: &str) -> Baked {
    let map = Map::named(map).unwrap();
    bake(field, map, &map.info.defaults(), Progress::none()).unwrap()
}

fn written(baked: &Baked, folder: &Path, stem: &str, format: FileFormat) -> Vec<PathBuf> {
    let files = save(baked, folder, stem, format, Progress::none()).unwrap();
    files.into_iter().map(|file| file.path).collect()
}

/// The texels of all files of a slice as `channels` interleaved floats, as another program reads them.
fn read(paths: &[PathBuf], ranges: &[Range], format: FileFormat) -> Vec<f32> {
    let channels = ranges.len();
    let image = read_image(&paths[0]).unwrap();
    if channels > 4 && format != FileFormat::Exr {
        assert_eq!(paths.len(), channels, "a file each");
        let planes: Vec<Vec<f32>> = paths
            .iter()
            .zip(ranges)
            .map(|(path, range)| decode(&read_image(path).unwrap().samples, &[*range]))
            .collect();
        return (0..planes[0].len()).flat_map(|at| planes.iter().map(move |plane| plane[at])).collect();
    }
    assert_eq!(paths.len(), 1);
    let padded = channels == 2 && format != FileFormat::Exr;
    assert_eq!(image.channels, if padded { 3 } else { channels }, "{}", paths[0].display());
    let names = if channels == 1 { &["Y"][..] } else { &["R", "G", "B", "A"] };
    assert!(channels > 4 || image.names == names[..image.channels], "{:?}", image.names);
    let all = [ranges, &[Range::UNIT]].concat();
    let texels = decode(&image.samples, &all[..image.channels]);
    if padded {
        assert!(texels.iter().skip(2).step_by(3).all(|&blue| blue == 0.0));
        return texels.chunks_exact(3).flat_map(|t| [t[0], t[1]]).collect();
    }
    texels
}

#[test]
fn files_hold_what_was_baked() {
    let folder = tempfile::tempdir().unwrap();
    let field = field();
    for map in REGISTRY {
        let name = map.info.name;
        let baked = baked(&field, name);
        let ranges = baked.ranges();
        assert_eq!(ranges.len(), map.info.channels.len());
        for (format, step) in FORMATS {
            let mut paths = written(&baked, folder.path(), "wall", format);
            let slices: usize = baked.layers.iter().map(|layer| layer.depth).sum();
            let files = paths.len() / slices;
            for layer in &baked.layers {
                for texels in layer.texels.chunks_exact(layer.texels.len() / layer.depth) {
                    let rest = paths.split_off(files);
                    let found = read(&paths, &ranges, format);
                    paths = rest;
                    assert_eq!(found.len(), texels.len());
                    for (at, (&found, &value)) in found.iter().zip(texels).enumerate() {
                        let range = ranges[at % ranges.len()];
                        let step = step * (range.high - range.low);
                        let slack = 1e-6 * range.high.abs().max(range.low.abs());
                        let good = match range.rounding {
                            Rounding::Nearest => (found - value).abs() <= 0.5 * step + slack,
                            Rounding::Down => found <= value && value - found <= step + slack,
                            Rounding::Up => found >= value && found - value <= step + slack,
                        };
                        assert!(good, "{name} {format:?} at {at}: {found} {value}");
                    }
                }
            }
            assert!(paths.is_empty());
        }
    }
    let mut names: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| {
            ["wall_normal.", "wall_normal_xy", "wall_p"].iter().any(|start| name.starts_with(start))
                && name.ends_with(".exr")
        })
        .collect();
    names.sort();
    let expected = ["wall_normal.exr", "wall_normal_xy.exr", "wall_pyramid_00.exr", "wall_pyramid_01.exr"];
    assert_eq!(names[..4], expected);
    assert_eq!(names.len(), 2 + 7);
}

#[test]
fn plans_are_what_the_bakes_give() {
    for (w, h) in [(1, 1), (1, 7), (6, 1), (13, 8)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let field = HeightField::new(&noise(w * h, 3), w, h, wrap).unwrap();
            for map in REGISTRY {
                let options = map.info.defaults();
                let plan = (map.plan)(bake::Grid::of(&field), &options);
                let layers = (map.bake)(&field, &options, Progress::none()).unwrap();
                let name = map.info.name;
                let found: Vec<_> = layers.iter().map(|l| [l.width, l.height, l.depth]).collect();
                assert_eq!(plan.layers, found, "{name} {w}x{h} {wrap:?}");
                let floats: usize = layers.iter().map(|l| l.texels.len()).sum();
                assert_eq!(plan.bytes(map.info.channels.len()), 4 * floats as u128, "{name}");
                assert!(layers.iter().all(|l| l.texels.iter().all(|v| v.is_finite())), "{name}");
                let stack = matches!(map.info.form, Form::Stack { .. });
                assert!(stack || layers.iter().all(|l| l.depth == 1), "{name}");
                assert!(map.info.form == Form::Levels || layers.len() == 1, "{name}");
            }
        }
    }
}

#[test]
fn constant_maps_bake() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for level in [0.0, 0.25, 1.0] {
            let field = HeightField::new(&[level; 35], 7, 5, wrap).unwrap();
            for map in REGISTRY {
                let folder = tempfile::tempdir().unwrap();
                let baked = baked(&field, map.info.name);
                assert!(baked.layers.iter().all(|l| l.texels.iter().all(|v| v.is_finite())));
                written(&baked, folder.path(), "", FileFormat::Png8);
            }
        }
    }
}

#[test]
fn flat_maps_are_the_usual_blue() {
    let folder = tempfile::tempdir().unwrap();
    let field = HeightField::new(&[0.25; 12], 4, 3, Wrap::Clamp).unwrap();
    let texel = |map: &str, format| {
        let path = &written(&baked(&field, map), folder.path(), "", format)[0];
        match read_image(path).unwrap().samples {
            Samples::U8(samples) => samples[..4].iter().map(|&v| u16::from(v)).collect::<Vec<_>>(),
            Samples::U16(samples) => samples[..4].to_vec(),
            Samples::F32(_) => panic!("floats in a PNG"),
        }
    };
    assert_eq!(texel("normal", FileFormat::Png8), [128, 128, 255, 128]);
    assert_eq!(texel("normal", FileFormat::Png16), [32768, 32768, 65535, 32768]);
    assert_eq!(texel("relief", FileFormat::Png8), [128, 128, 255, 64]);
    assert_eq!(texel("normal_xy", FileFormat::Png8), [128, 128, 0, 128]);
    assert!(folder.path().join("normal.png").exists(), "an empty stem leaves no underscore");
}

#[test]
fn eight_bits_cost_less_than_half_a_degree() {
    let field = HeightField::new(&vec![0.0; 64 * 64], 64, 64, Wrap::Repeat).unwrap();
    let flat = baked(&field, "normal");
    let read = decode(&flat.encoded(Depth::U8).layers[0].samples, &flat.ranges());
    let error = angle([read[0], read[1], read[2]].map(f64::from), [0.0, 0.0, 1.0]);
    // No code stands for 0: half a step along x and y.
    assert!((0.31..0.325).contains(&error), "{error}");
}

#[test]
fn missing_folders_are_an_error() {
    let folder = tempfile::tempdir().unwrap().path().join("missing");
    let error =
        save(&baked(&field(), "normal"), &folder, "a", FileFormat::Png8, Progress::none()).unwrap_err();
    assert!(matches!(error, BakeError::Io { action: "write", .. }), "{error}");
}

#[test]
fn integers_baked_straight_are_those_of_floats_encoded() {
    let noisy = |w: usize, h: usize| noise(w * h, 5);
    for (w, h) in [(1, 1), (1, 9), (513, 3), (600, 5), (1026, 2)] {
        for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
            let flat = vec![0.5; w * h];
            for texels in [noisy(w, h), flat] {
                let field = HeightField::new(&texels, w, h, wrap).unwrap();
                for map in REGISTRY {
                    let options = map.info.defaults();
                    let floats = bake(&field, map, &options, Progress::none()).unwrap();
                    for depth in [Depth::U8, Depth::U16] {
                        let straight = bake_encoded(&field, map, &options, depth, Progress::none()).unwrap();
                        assert_eq!(straight, floats.encoded(depth), "{} {w}x{h}", map.info.name);
                    }
                    let mut again = vec![0.0_f32; floats.layers[0].texels.len()];
                    let result = bake_rows(
                        &Texels::of(&field),
                        field.extent(),
                        map,
                        &options,
                        &mut again,
                        Progress::none(),
                    );
                    assert_eq!(result.is_ok(), map.is_by_rows());
                    assert!(result.is_err() || again == floats.layers[0].texels);
                }
            }
        }
    }
}

#[test]
fn a_save_can_be_stopped_and_leaves_whole_files() {
    let folder = tempfile::tempdir().unwrap();
    let field = HeightField::new(&noise(512 * 512, 2), 512, 512, Wrap::Repeat).unwrap();
    for (map, calls_allowed) in [("normal", 2), ("pyramid", 5)] {
        for format in [FileFormat::Png8, FileFormat::Tiff32, FileFormat::Exr] {
            let mut calls = 0;
            let mut stop = |_, _| {
                calls += 1;
                calls < calls_allowed
            };
            let result = save(&baked(&field, map), folder.path(), "", format, Progress::new(&mut stop));
            assert!(matches!(result, Err(BakeError::Interrupted)), "{map} {format:?}: {result:?}");
        }
    }
    for entry in fs::read_dir(folder.path()).unwrap() {
        let path = entry.unwrap().path();
        assert!(read_image(&path).is_ok(), "{}", path.display());
        assert!(path.file_name().unwrap().to_string_lossy().starts_with("pyramid"), "{}", path.display());
    }
}
