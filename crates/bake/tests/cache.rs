//! The cache: what is found again, what is not, and what survives damage.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use bake::cache::Cache;
use bake::maps::{Channel, Form, Layer, MapInfo, Plan};
use bake::{BakeError, Kind, Map, MapOption, Progress, Value};
use common::noise;
use heightfield::{Extent, HeightField, Wrap};

static BAKES: AtomicUsize = AtomicUsize::new(0);

const CHANNELS: &[Channel] = &[Channel::fixed("level", bake::encode::Range::UNIT)];
const OPTIONS: &[MapOption] =
    &[MapOption { name: "gain", summary: "", kind: Kind::Number { default: 1.0, min: 0.0, max: 1.0 } }];

const fn map(name: &'static str, version: u32) -> Map {
    Map {
        info: MapInfo {
            name,
            summary: "",
            source: "",
            version,
            costly: true,
            form: Form::Levels,
            channels: CHANNELS,
            options: OPTIONS,
        },
        plan: |grid, _| Plan::levels([grid.width, grid.height]),
        bake: |field, options, mut progress| {
            BAKES.fetch_add(1, Ordering::Relaxed);
            progress.report(0, 1)?;
            let plan = Plan::levels([field.width(), field.height()]);
            let gain = options.number("gain") as f32 * field.extent().scale;
            let layer = |&[w, h, _]: &[usize; 3]| Layer::flat(w, h, vec![gain * field.texel(0, 0); w * h]);
            Ok(plan.layers.iter().map(layer).collect())
        },
    }
}

static MAP: Map = map("kept", 1);
static NEXT: Map = map("kept", 2);
static OTHER: Map = map("other", 1);

fn field(seed: u64, w: usize, h: usize, wrap: Wrap, scale: f32) -> HeightField {
    let extent = Extent { scale, ..Extent::default() };
    HeightField::new(&noise(w * h, seed), w, h, wrap).unwrap().with_extent(extent).unwrap()
}

fn entries(cache: &Cache) -> Vec<PathBuf> {
    let mut paths: Vec<_> =
        fs::read_dir(cache.folder()).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// How often the map is really baked when it is asked for.
fn bakes(cache: &Cache, field: &HeightField, map: &'static Map, gain: f64) -> usize {
    let options = map.info.defaults().with("gain", Value::Number(gain)).unwrap();
    let before = BAKES.load(Ordering::Relaxed);
    let baked = cache.bake(field, map, &options, Progress::none()).unwrap();
    let expected = gain as f32 * field.extent().scale * field.texel(0, 0);
    assert!(baked.layers.iter().all(|layer| layer.texels.iter().all(|&v| v == expected)));
    assert_eq!((baked.layers[0].width, baked.layers[0].height), (field.width(), field.height()));
    BAKES.load(Ordering::Relaxed) - before
}

/// One test, since all count the same bakes.
#[test]
fn a_cache() {
    the_same_is_found_and_anything_else_is_not();
    damage_is_found_and_repaired();
    the_oldest_go_first_and_strangers_stay();
    folders_that_cannot_be_used_do_no_harm();
    interrupted_bakes_are_not_kept();
    many_at_once_agree();
}

fn the_same_is_found_and_anything_else_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path().join("made"), 1 << 20);
    let usual = || field(1, 8, 4, Wrap::Repeat, 0.5);
    assert_eq!(bakes(&cache, &usual(), &MAP, 1.0), 1);
    assert_eq!(bakes(&cache, &usual(), &MAP, 1.0), 0, "another field with the same heights");
    let once = |field: HeightField, map, gain| assert_eq!(bakes(&cache, &field, map, gain), 1);
    once(field(2, 8, 4, Wrap::Repeat, 0.5), &MAP, 1.0);
    once(field(1, 4, 8, Wrap::Repeat, 0.5), &MAP, 1.0);
    once(field(1, 8, 4, Wrap::Clamp, 0.5), &MAP, 1.0);
    once(field(1, 8, 4, Wrap::Repeat, 0.25), &MAP, 1.0);
    once(usual(), &MAP, 0.5);
    once(usual(), &NEXT, 1.0);
    once(usual(), &OTHER, 1.0);
    assert_eq!(entries(&cache).len(), 8);
}

fn damage_is_found_and_repaired() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path(), 1 << 20);
    let field = field(3, 16, 16, Wrap::Mirror, 0.5);
    assert_eq!(bakes(&cache, &field, &MAP, 1.0), 1);
    let path = entries(&cache).pop().unwrap();
    let whole = fs::read(&path).unwrap();
    let mut damaged = vec![Vec::new(), whole[..whole.len() - 1].to_vec(), [&whole[..], &[0]].concat()];
    for at in [0, 7, 8, 16, 24, 60, whole.len() / 2, whole.len() - 40, whole.len() - 1] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        damaged.push(bytes);
    }
    for bytes in damaged {
        fs::write(&path, &bytes).unwrap();
        assert_eq!(bakes(&cache, &field, &MAP, 1.0), 1, "{} bytes", bytes.len());
        assert_eq!(fs::read(&path).unwrap(), whole, "the entry is whole again");
    }
}

fn the_oldest_go_first_and_strangers_stay() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path(), 20_000);
    fs::write(folder.path().join("letter.txt"), vec![0; 50_000]).unwrap();
    let fields: Vec<_> = (0..5).map(|seed| field(seed, 32, 32, Wrap::Repeat, 0.5)).collect();
    let wait = || std::thread::sleep(std::time::Duration::from_millis(20));
    // About 5600 bytes each: three fit.
    for field in &fields[..3] {
        assert_eq!(bakes(&cache, field, &MAP, 1.0), 1);
        wait();
    }
    assert_eq!(bakes(&cache, &fields[0], &MAP, 1.0), 0, "used again, so not the oldest any more");
    wait();
    assert_eq!(bakes(&cache, &fields[3], &MAP, 1.0), 1);
    assert_eq!(bakes(&cache, &fields[0], &MAP, 1.0), 0);
    assert_eq!(bakes(&cache, &fields[3], &MAP, 1.0), 0);
    assert_eq!(bakes(&cache, &fields[1], &MAP, 1.0), 1, "this one had to go");
    let total: u64 = entries(&cache)
        .iter()
        .filter(|path| path.extension().is_some_and(|suffix| suffix == "bwmap"))
        .map(|path| fs::metadata(path).unwrap().len())
        .sum();
    assert!(total <= 20_000, "{total}");
    assert!(folder.path().join("letter.txt").exists());
    let large = field(9, 64, 64, Wrap::Repeat, 0.5);
    assert_eq!(bakes(&cache, &large, &MAP, 1.0), 1);
    assert_eq!(bakes(&cache, &large, &MAP, 1.0), 1, "more than half of the limit is not kept");
}

fn folders_that_cannot_be_used_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "no folder").unwrap();
    let field = field(4, 8, 8, Wrap::Repeat, 0.5);
    for path in [file.clone(), file.join("below"), PathBuf::from("/proc/bumpwgpu")] {
        let cache = Cache::new(path, 1 << 20);
        assert_eq!(bakes(&cache, &field, &MAP, 1.0), 1);
    }
    assert_eq!(fs::read(file).unwrap(), b"no folder");
}

fn interrupted_bakes_are_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    let cache = Cache::new(folder.path(), 1 << 20);
    let field = field(5, 8, 8, Wrap::Repeat, 0.5);
    let mut stop = |_, _| false;
    let result = cache.bake(&field, &MAP, &MAP.info.defaults(), Progress::new(&mut stop));
    assert!(matches!(result, Err(BakeError::Interrupted)));
    assert!(entries(&cache).is_empty());
}

fn many_at_once_agree() {
    let folder = tempfile::tempdir().unwrap();
    // Room for three of them, so that some are removed while others are read.
    let cache = Cache::new(folder.path(), 20_000);
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let cache = &cache;
            scope.spawn(move || {
                for round in 0..25 {
                    let field = field((thread + round) % 6, 32, 32, Wrap::Repeat, 0.5);
                    let baked = cache.bake(&field, &MAP, &MAP.info.defaults(), Progress::none()).unwrap();
                    assert!(baked.layers[0].texels.iter().all(|&v| v == 0.5 * field.texel(0, 0)));
                }
            });
        }
    });
    assert!(entries(&cache).iter().all(|path| path.extension().is_some_and(|suffix| suffix == "bwmap")));
}
