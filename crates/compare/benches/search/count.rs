//! Instructions a ray: callgrind over a child of the bench, one thread, only the march itself.
//!
//! The numbers do not depend on the load of the machine and hardly on the machine. valgrind shows the
//! program a processor without AVX-512, so they are those of the AVX2 code at best.

use std::hint::black_box;
use std::path::Path;
use std::process::{Command, Stdio};

use heightfield::{HeightField, Technique};
use rayon::ThreadPoolBuilder;

use crate::scene::{self, ELEVATIONS, Map, Order};
use crate::{run, searches, short};

/// Rays counted; as they come in a picture, so that packets are as full as they get.
const RAYS: usize = 2048;
/// The argument that makes the bench the child.
pub const FLAG: &str = "--count-instructions";

/// The function that is counted, as callgrind names it.
const COUNTED: &str = concat!(module_path!(), "::counted_march");

/// Callgrind counts nothing but this, and writes its count on the way out.
#[inline(never)]
fn counted_march(field: &HeightField, technique: &Technique, rays: &compare::Rays) {
    black_box(run(field, technique, rays));
}

/// The child: `FLAG map side texels`, the last a file of `f32`. It says what it marched, line by line.
pub fn child(arguments: &[String]) {
    let [_, side, path] = arguments else {
        panic!("{FLAG} needs a map, a side and a file, got {arguments:?}")
    };
    let side: usize = side.parse().unwrap();
    let bytes = std::fs::read(path).unwrap();
    let texels: Vec<f32> =
        bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    // On a worker, as then the march stays on its thread, which is the one that is counted.
    let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let field = scene::field(&texels, side);
        let (techniques, _) = searches(&field);
        for elevation in ELEVATIONS {
            let rays = Order::Image.rays(&field, elevation, RAYS);
            for technique in &techniques {
                // Once before, so that nothing is built or loaded in the counted one.
                run(&field, technique, &rays);
                counted_march(&field, technique, &rays);
                println!("{elevation}\t{}", short(technique));
            }
        }
    });
}

/// Instructions a ray of every technique at every elevation, or why there are none.
pub fn count(map: Map, texels: &[f32], side: usize) -> Result<Vec<(f64, String, f64)>, String> {
    let folder = std::env::temp_dir().join(format!("bumpwgpu-callgrind-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let counts = count_in(&folder, map, texels, side);
    let removed = std::fs::remove_dir_all(&folder);
    let counts = counts?;
    removed.map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok(counts)
}

fn count_in(folder: &Path, map: Map, texels: &[f32], side: usize) -> Result<Vec<(f64, String, f64)>, String> {
    let heights = folder.join("heights");
    let bytes: Vec<u8> = texels.iter().flat_map(|h| h.to_le_bytes()).collect();
    std::fs::write(&heights, bytes).map_err(|error| format!("{}: {error}", heights.display()))?;
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .arg("--tool=callgrind")
        .args(["--toggle-collect", "--dump-after"].map(|option| format!("{option}={COUNTED}")))
        .arg(format!("--callgrind-out-file={}", folder.join("out").display()))
        .arg(program)
        .args([FLAG, &map.to_string(), &side.to_string()])
        .arg(&heights)
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("valgrind cannot be run ({error})"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("valgrind failed: {}", said.lines().last().unwrap_or_default()));
    }
    let marched = String::from_utf8_lossy(&output.stdout);
    marched
        .lines()
        .enumerate()
        .map(|(at, line)| {
            let path = folder.join(format!("out.{}", at + 1));
            let text = std::fs::read_to_string(&path).map_err(|_| "callgrind wrote no counts".to_owned())?;
            let total = text.lines().find_map(|line| line.strip_prefix("totals: "));
            let total: f64 = total.and_then(|n| n.trim().parse().ok()).ok_or("callgrind wrote no total")?;
            let (elevation, technique) = line.split_once('\t').ok_or("the child said nothing sensible")?;
            let elevation = elevation.parse().map_err(|_| "the child said no elevation".to_owned())?;
            Ok((elevation, technique.to_owned(), total / RAYS as f64))
        })
        .collect()
}
