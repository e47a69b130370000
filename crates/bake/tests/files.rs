//! Reading and writing image files: what is kept, what is refused.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::fs;
use std::path::Path;

use bake::{
    BakeError, Image, Samples, WriteOptions, decode_image, effective_bits, read_image, write_image,
    write_image_with,
};
use common::{data, data_image, noise};

fn image(width: usize, height: usize, channels: usize, bits: u32) -> Image {
    let values = noise(width * height * channels, 42 + channels as u64);
    let samples = match bits {
        8 => Samples::U8(values.iter().map(|v| (v * 255.9) as u8).collect()),
        16 => Samples::U16(values.iter().map(|v| (v * 65535.9) as u16).collect()),
        _ => Samples::F32(values.iter().map(|v| v * 7.0 - 3.0).collect()),
    };
    Image::new(width, height, channels, samples).unwrap()
}

fn same(written: &Image, read: &Image) {
    assert_eq!((written.width, written.height, written.channels), (read.width, read.height, read.channels));
    assert_eq!(written.samples, read.samples);
}

#[test]
fn what_is_written_is_read_back_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    for (suffix, depths) in [("png", &[8, 16][..]), ("tif", &[8, 16, 32]), ("TIFF", &[16]), ("exr", &[32])] {
        for &bits in depths {
            for channels in 1..=4 {
                for (w, h) in [(1, 1), (7, 5), (130, 67)] {
                    let image = image(w, h, channels, bits);
                    let path = folder.path().join(format!("image.{suffix}"));
                    write_image(&path, &image).unwrap();
                    let read = read_image(&path).unwrap();
                    same(&image, &read);
                    assert_eq!(read.warnings, [""; 0]);
                    if suffix == "exr" {
                        assert_eq!(read.names, image.names);
                    }
                }
            }
        }
    }
    // Nothing but the files asked for: every temporary name is gone.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
}

#[test]
fn exr_keeps_names_and_takes_integers_and_halves() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("named.exr");
    let names = ["height", "Z", "ao"].map(str::to_owned).to_vec();
    let image = Image::named(5, 4, names, image(5, 4, 3, 16).samples).unwrap();
    write_image(&path, &image).unwrap();
    let read = read_image(&path).unwrap();
    // The file orders channels by name.
    assert_eq!(read.names, ["Z", "ao", "height"]);
    assert_eq!(read.channel_f32(2), image.channel_f32(0));
    assert_eq!(read.channel_f32(0), image.channel_f32(1));

    let image = Image::new(64, 64, 1, Samples::F32(noise(4096, 8))).unwrap();
    write_image_with(&path, &image, WriteOptions { half: true }).unwrap();
    let read = read_image(&path).unwrap();
    assert_eq!(effective_bits(&read.samples), 16);
    let pairs = image.to_f32().into_iter().zip(read.to_f32());
    assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= a / 2048.0));
}

#[test]
fn what_cannot_be_written_is_said_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let refuse = |name: &str, image: &Image, options: WriteOptions, part: &str| {
        let error = write_image_with(&folder.path().join(name), image, options).unwrap_err().to_string();
        assert!(error.contains(part), "{name}: {error}");
    };
    let plain = WriteOptions::default();
    refuse("a.png", &image(3, 3, 1, 32), plain, "encode it to 8 or 16 bits");
    refuse("a.png", &image(3, 3, 5, 8), plain, "1 to 4 channels");
    refuse("a.tif", &image(3, 3, 5, 8), plain, "1 to 4 channels");
    refuse("a.jpg", &image(3, 3, 1, 8), plain, ".png, .tif, .tiff or .exr");
    refuse("a", &image(3, 3, 1, 8), plain, ".png, .tif, .tiff or .exr");
    refuse("a.png", &image(3, 3, 1, 8), WriteOptions { half: true }, "EXR only");
    let twins = Image::named(1, 1, vec!["Y".to_owned(); 2], Samples::F32(vec![0.0; 2])).unwrap();
    refuse("a.exr", &twins, plain, "name of its own");
    let mut torn = image(3, 3, 1, 8);
    torn.width = 4;
    refuse("a.png", &torn, plain, "cannot have 9 samples");
    refuse("missing/a.png", &image(3, 3, 1, 8), plain, "cannot write");
    fs::create_dir(folder.path().join("b.png")).unwrap();
    refuse("b.png", &image(3, 3, 1, 8), plain, "it is a folder");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[cfg(target_os = "linux")]
#[test]
fn folders_that_cannot_be_written_are_an_error() {
    let error = write_image(Path::new("/proc/a.png"), &image(3, 3, 1, 8)).unwrap_err();
    assert!(matches!(error, BakeError::Io { action: "write", .. }), "{error}");
}

#[cfg(unix)]
#[test]
fn written_files_have_ordinary_rights() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (ours, usual) = (folder.path().join("a.png"), folder.path().join("usual"));
    write_image(&ours, &image(3, 3, 1, 8)).unwrap();
    fs::write(&usual, "").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    assert_eq!(mode(&ours), mode(&usual));
}

#[test]
fn unreadable_paths_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let Err(BakeError::Io { source, .. }) = read_image(&folder.path().join("none.png")) else { panic!() };
    assert_eq!(source.kind(), std::io::ErrorKind::NotFound);
    assert!(read_image(folder.path()).unwrap_err().to_string().contains("not a regular file"));
    let path = folder.path().join("text.png");
    fs::write(&path, "no image").unwrap();
    let error = read_image(&path).unwrap_err();
    assert!(error.to_string().contains("text.png") && error.to_string().contains("6e 6f 20 69"), "{error}");
    fs::write(&path, "").unwrap();
    assert!(read_image(&path).unwrap_err().to_string().contains("an empty file"));
}

#[test]
fn a_wrong_suffix_does_no_harm_and_tga_goes_by_it() {
    let folder = tempfile::tempdir().unwrap();
    let (png, exr) = (folder.path().join("a.png"), folder.path().join("a.exr"));
    write_image(&png, &image(9, 4, 3, 16)).unwrap();
    fs::rename(&png, &exr).unwrap();
    same(&image(9, 4, 3, 16), &read_image(&exr).unwrap());
    // Uncompressed true colour, 2 x 1, first row on top; blue comes first in the file.
    let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0, 1, 0, 24, 0x20];
    tga.extend([1, 2, 3, 40, 50, 60]);
    let path = folder.path().join("a.tga");
    fs::write(&path, &tga).unwrap();
    assert_eq!(read_image(&path).unwrap().samples, Samples::U8(vec![3, 2, 1, 60, 50, 40]));
    assert!(matches!(decode_image(&tga), Err(BakeError::UnknownFormat { .. })));
}

#[test]
fn sixteen_bits_stay_sixteen_and_warnings_name_the_tag() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tagged.png");
    write_image(&path, &image(4, 4, 1, 16)).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    assert!(matches!(decode_image(&bytes).unwrap().samples, Samples::U16(_)));
    // An sRGB chunk after the header (8 + 25 bytes), with its checksum.
    bytes.splice(33..33, [0, 0, 0, 1, b's', b'R', b'G', b'B', 0, 0xae, 0xce, 0x1c, 0xe9]);
    let tagged = decode_image(&bytes).unwrap();
    same(&image(4, 4, 1, 16), &tagged);
    assert!(tagged.warnings[0].contains("sRGB"), "{:?}", tagged.warnings);
}

#[test]
fn every_file_of_pngsuite() {
    let Some(folder) = data("malformed/pngsuite") else { return };
    let mut corrupt = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".png") {
            continue;
        }
        let result = read_image(&path);
        if name.starts_with('x') {
            let error = result.expect_err(&name).to_string();
            assert!(
                error.contains(&name) && error.contains("PNG") || error.contains("not an image"),
                "{error}"
            );
            corrupt += 1;
            continue;
        }
        let image = result.unwrap_or_else(|error| panic!("{error}"));
        if name == "PngSuite.png" {
            continue;
        }
        // "basn2c16": colour type 2 (RGB), 16 bits.
        let (color, bits) = (&name[4..5], &name[6..8]);
        assert_eq!(matches!(image.samples, Samples::U16(_)), bits == "16", "{name}");
        let transparent = name.starts_with('t') && !name.starts_with("tp0");
        let channels = match color {
            "0" => 1,
            "4" => 2,
            "2" | "3" => 3,
            _ => 4,
        };
        assert_eq!(image.channels, channels + usize::from(transparent), "{name}");
        if name.starts_with("basn0g0") {
            assert_eq!(effective_bits(&image.samples), bits.parse().unwrap(), "{name}");
        }
        if let Some(size) = name.strip_prefix('s').and_then(|rest| rest[..2].parse().ok()) {
            assert_eq!((image.width, image.height), (size, size), "{name}");
        }
    }
    assert_eq!(corrupt, 14);
}

#[test]
fn interlaced_pictures_equal_plain_ones() {
    for kind in ["0g01", "0g08", "0g16", "2c16", "3p04", "4a08", "6a16"] {
        let (Some(plain), Some(interlaced)) = (
            data_image(&format!("malformed/pngsuite/basn{kind}.png")),
            data_image(&format!("malformed/pngsuite/basi{kind}.png")),
        ) else {
            return;
        };
        same(&plain, &interlaced);
    }
}

#[test]
fn real_files_have_the_shape_and_range_that_others_find() {
    if let Some(image) = data_image("terrain3d/mountain1.exr") {
        assert_eq!((image.width, image.height, image.names), (256, 256, vec!["Y".to_owned()]));
        let Samples::F32(texels) = &image.samples else { panic!() };
        assert_eq!(effective_bits(&image.samples), 32);
        let high = texels.iter().copied().fold(0.0, f32::max);
        assert!((high - 1.00487).abs() < 1e-5, "{high}");
    }
    if let Some(image) = data_image("terrain3d/terrain2.exr") {
        assert_eq!((image.width, image.height), (512, 512));
        assert_eq!(image.names, ["R", "G", "B", "A"]);
        assert_eq!(effective_bits(&Samples::F32(image.channel_f32(0).unwrap())), 16);
    }
    if let Some(image) = data_image("panda3d/heightfield.png") {
        let Samples::U16(texels) = &image.samples else { panic!() };
        assert_eq!((texels.iter().min(), texels.iter().max()), (Some(&6312), Some(&63555)));
        assert_eq!(effective_bits(&image.samples), 16);
    }
    if let Some(image) = data_image("godot/texture_bricks_depth.jpg") {
        assert_eq!((image.width, image.height, image.channels), (1000, 1000, 3));
        assert!(image.warnings[0].contains("JPEG"));
    }
    if let Some(image) = data_image("playcanvas/parallax_thumb.webp") {
        assert_eq!((image.width, image.height), (320, 240));
        assert!(image.warnings[0].contains("lossy"), "{:?}", image.warnings);
    }
    if let Some(image) = data_image("godot/texture_rock_depth.png") {
        assert_eq!((image.width, image.height, image.channels), (1024, 666, 3));
    }
    if let Some(image) = data_image("bevy/parallax_example/cube_depth.png") {
        assert_eq!((image.width, image.channels), (348, 1));
    }
}
