//! Replays the corpus of hostile images: each is an error, soon, and takes no memory to speak of.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::time::{Duration, Instant};

use bake::read_image;
use common::root;

/// Most address space this process ever had, in MB, where the system tells.
fn peak_megabytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()? / 1024)
}

// One test, so that nothing else in this process takes memory meanwhile.
#[test]
fn every_hostile_image_is_an_error() {
    let before = peak_megabytes();
    let mut seen = 0;
    for entry in std::fs::read_dir(root().join("tests/hostile/images")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|suffix| suffix == "md") {
            continue;
        }
        let start = Instant::now();
        let error = match read_image(&path) {
            Ok(_) => panic!("{} was accepted", path.display()),
            Err(error) => error.to_string(),
        };
        println!("{error}");
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        assert!(error.contains(&name) && error.len() > name.len() + 10, "{error}");
        assert!(start.elapsed() < Duration::from_secs(2), "{name} took {:?}", start.elapsed());
        seen += 1;
    }
    assert!(seen >= 60, "only {seen} files");
    if let (Some(before), Some(after)) = (before, peak_megabytes()) {
        // Threads and their heaps reserve some hundred MB of addresses; a bomb wants 800 MB or more.
        assert!(after - before < 600, "{before} MB before, {after} MB after");
    }
}
