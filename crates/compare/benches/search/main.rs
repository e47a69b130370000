//! Time and error of every search, side by side: `make bench`.
//!
//! Every technique of the registry on three maps, five elevations and two sizes, rays in random and in
//! image order. The error is measured against the `f64` oracle before anything is timed; the
//! instructions come from callgrind and do not depend on the load. After criterion's own report one
//! table has it all, with the changes against the baseline. Options, after `--`:
//!
//! * `--save-baseline NAME`, `--baseline NAME`, `--baseline-lenient NAME`: as criterion's; the default is to compare with the last
//!   run and to replace it.
//! * a filter such as `exact` or `rough/512`: only those are timed and shown.
//!
//! `BENCH_QUICK=1` leaves out 4096 x 4096 and two elevations.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs)]

mod count;
mod scene;
mod table;

use std::cell::Cell;
use std::hint::black_box;
use std::time::{Duration, Instant};

use compare::{Metrics, RayErrors, Rays, Reference, Reported};
use criterion::{Criterion, SamplingMode, Throughput};
use heightfield::{HeightField, Hits, MarchOptions, OutputSet, RayArray, Technique, Wrap, march};
use rayon::{ThreadPool, ThreadPoolBuilder};
use scene::{ELEVATIONS, MAPS, Map, ORDERS, Order, RAYS};
use table::{Key, Row};

/// Rays whose error is measured.
const MEASURED: usize = 1 << 13;

fn run(field: &HeightField, technique: &Technique, rays: &Rays) -> Hits {
    march_for(field, technique, rays, OutputSet::T)
}

fn march_for(field: &HeightField, technique: &Technique, rays: &Rays, outputs: OutputSet) -> Hits {
    let options = MarchOptions { outputs, ..MarchOptions::default() };
    let (origins, directions) = (RayArray::F32(&rays.origins), RayArray::F32(&rays.directions));
    march(field, technique, origins, directions, &options).unwrap()
}

/// Every technique that can search this field with default parameters, and why the others cannot.
fn searches(field: &HeightField) -> (Vec<Technique>, Vec<String>) {
    let ray = Order::Random.rays(field, 45.0, 1);
    let all = Technique::all().iter().map(|info| Technique::named(info.name).unwrap());
    let tried = all.map(|technique| {
        let options = MarchOptions { outputs: OutputSet::T, ..MarchOptions::default() };
        let (origins, directions) = (RayArray::F32(&ray.origins), RayArray::F32(&ray.directions));
        match march(field, &technique, origins, directions, &options) {
            Ok(_) => Ok(technique),
            Err(error) => Err(format!("{}: left out: {error}", technique.info.name)),
        }
    });
    let (able, unable): (Vec<_>, Vec<_>) = tried.partition(Result::is_ok);
    (able.into_iter().flatten().collect(), unable.into_iter().filter_map(Result::err).collect())
}

/// A technique with the values of its parameters: `relief(32, 8)`.
fn short(technique: &Technique) -> String {
    let values: Vec<String> = technique.settings().map(|(_, value)| value.to_string()).collect();
    let name = technique.info.name;
    if values.is_empty() { name.to_owned() } else { format!("{name}({})", values.join(", ")) }
}

/// The errors of what a technique reports, after `spoil` had its way with it.
fn errors(
    field: &HeightField,
    technique: &Technique,
    rays: &Rays,
    reference: &Reference,
    spoil: impl Fn(&mut f32),
) -> Metrics {
    let mut hits = march_for(field, technique, rays, OutputSet::T | OutputSet::STATUS);
    let (mut t, status) = (hits.t.take().unwrap(), hits.status.take().unwrap());
    t.iter_mut().for_each(spoil);
    let at = |i: usize| rays.at(i, f64::from(t[i])).map(|x| x as f32);
    let uv: Vec<f32> = (0..rays.len()).flat_map(|i| [at(i)[0], at(i)[1]]).collect();
    let z: Vec<f32> = (0..rays.len()).map(|i| at(i)[2]).collect();
    let reported = Reported { uv: &uv, z: &z, t: Some(&t), normal: None, status: Some(&status), steps: None };
    Metrics::of(&[&RayErrors::measure(field, rays, reference, &reported).unwrap()])
}

/// Negative control: the errors must be there when the hits are moved, else the table means nothing.
fn control(field: &HeightField, rays: &Rays, reference: &Reference) {
    let exact = Technique::named("exact").unwrap();
    let moved = |by: f32| errors(field, &exact, rays, reference, |t| *t += by);
    let (right, deep, high) = (moved(0.0), moved(0.05), moved(-0.05));
    assert!(right.failure_rate() + right.false_hit_rate == 0.0, "the exact search is wrong: {right:?}");
    assert!(right.uv_error_p99_texels < 0.01, "the exact search is off: {right:?}");
    assert!(deep.uv_error_p99_texels > 1.0, "moved hits are not noticed: {deep:?}");
    assert!(high.false_hit_rate > 0.5, "hits in the air are not noticed: {high:?}");
}

/// Times one march; `None` when a filter leaves it out.
fn time(
    criterion: &mut Criterion,
    id: [&str; 2],
    pool: &ThreadPool,
    job: (&HeightField, &Technique, &Rays),
) -> Option<f64> {
    let best = Cell::new(None::<f64>);
    let (field, technique, rays) = job;
    let mut group = criterion.benchmark_group(id[0]);
    group.throughput(Throughput::Elements(rays.len() as u64)).sampling_mode(SamplingMode::Flat);
    group.bench_function(id[1], |bencher| {
        bencher.iter_custom(|iterations| {
            let elapsed = pool.install(|| {
                let begin = Instant::now();
                for _ in 0..iterations {
                    black_box(run(field, technique, rays));
                }
                begin.elapsed()
            });
            let each = elapsed.as_secs_f64() * 1e9 / (iterations as f64 * rays.len() as f64);
            best.set(Some(best.get().map_or(each, |best| best.min(each))));
            elapsed
        });
    });
    group.finish();
    best.get()
}

fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// One map in one size: a row for every elevation and technique.
fn measure(
    criterion: &mut Criterion,
    map: Map,
    side: usize,
    elevations: &[f64],
    rows: &mut Vec<Row>,
    notes: &mut Vec<String>,
) {
    let texels = map.texels(side);
    let field = scene::field(&texels, side);
    let counts = if side == 512 { count::count(map, &texels, side) } else { Ok(Vec::new()) };
    let counts = counts.unwrap_or_else(|why| {
        notes.push(format!("{map} {side} x {side}: no instruction counts: {why}"));
        Vec::new()
    });
    drop(texels);
    let all = pool(0);
    let (techniques, unable) = searches(&field);
    notes.extend(unable.into_iter().filter(|why| !notes.contains(why)).collect::<Vec<_>>());
    for &elevation in elevations {
        eprintln!("{map} {side} x {side}, {elevation} degrees");
        let measured = Order::Random.rays(&field, elevation, MEASURED);
        let reference = Reference::new(&field, &measured, &[]);
        if elevation == 45.0 {
            control(&field, &measured, &reference);
        }
        let timed = ORDERS.map(|order| order.rays(&field, elevation, RAYS));
        for technique in &techniques {
            let times = std::array::from_fn(|at| {
                let group = format!("{map}/{side}/{elevation}/{}", ORDERS[at]);
                time(criterion, [&group, &technique.to_string()], &all, (&field, technique, &timed[at]))
            });
            let [random_ns, image_ns]: [Option<f64>; 2] = times;
            if random_ns.is_none() && image_ns.is_none() {
                continue;
            }
            let key = Key { map, side, elevation, technique: short(technique) };
            let instructions =
                counts.iter().find(|(e, name, _)| (*e, name) == (elevation, &key.technique)).map(|c| c.2);
            let error = errors(&field, technique, &measured, &reference, |_| ());
            rows.push(Row { key, random_ns, image_ns, error, instructions });
        }
    }
}

/// Million rays a second with one, two and all threads, on the rough map at 10 degrees.
fn scaling(criterion: &mut Criterion) -> String {
    let field = scene::field(&Map::Rough.texels(512), 512);
    let rays = Order::Image.rays(&field, 10.0, RAYS);
    let most = rayon::current_num_threads();
    let mut threads = vec![1, 2.min(most), most];
    threads.dedup();
    let mut text = format!("{:<26}", "Mrays/s by threads");
    threads.iter().for_each(|n| text.push_str(&format!(" {n:>8}")));
    text.push('\n');
    for technique in &searches(&field).0 {
        let rates: Vec<_> = threads
            .iter()
            .filter_map(|&n| {
                let group = format!("threads/{n}");
                time(criterion, [&group, &technique.to_string()], &pool(n), (&field, technique, &rays))
            })
            .map(|ns| format!(" {:>8.2}", 1e3 / ns))
            .collect();
        if !rates.is_empty() {
            text.push_str(&format!("{:<26}{}\n", short(technique), rates.concat()));
        }
    }
    text
}

/// What the exact search builds before its first ray: time on one thread and numbers kept, with the heights.
fn build() -> String {
    const SIDE: usize = 1024;
    let texels = Map::Rough.texels(SIDE);
    let (mut best, mut floats) = (f64::INFINITY, 0);
    pool(1).install(|| {
        for _ in 0..10 {
            let begin = Instant::now();
            let field = HeightField::new(&texels, SIDE, SIDE, Wrap::Repeat).unwrap();
            let margins = field.margins().floats();
            best = best.min(begin.elapsed().as_secs_f64());
            floats = field.corners().len() + field.pyramid().maxima().len() + margins;
        }
    });
    let each = floats as f64 / texels.len() as f64;
    format!(
        "exact builds {:.1} ms for {SIDE} x {SIDE} on one thread, and keeps {each:.2} floats a texel\n",
        1e3 * best
    )
}

/// The value of a command-line option.
fn option(arguments: &[String], name: &str) -> Option<String> {
    let at = arguments.iter().position(|argument| argument == name)?;
    arguments.get(at + 1).cloned()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|first| first == count::FLAG) {
        return count::child(&arguments[1..]);
    }
    let quick = std::env::var_os("BENCH_QUICK").is_some_and(|value| value != "0" && !value.is_empty());
    let (sides, elevations): (&[usize], &[f64]) =
        if quick { (&[512], &[45.0, 20.0, 5.0]) } else { (&[512, 4096], &ELEVATIONS) };
    let mut criterion = Criterion::default()
        .sample_size(10)
        .nresamples(1000)
        .warm_up_time(Duration::from_millis(60))
        .measurement_time(Duration::from_millis(if quick { 100 } else { 200 }))
        .without_plots()
        .configure_from_args();
    let (mut rows, mut notes) = (Vec::new(), Vec::new());
    for &side in sides {
        for map in MAPS {
            measure(&mut criterion, map, side, elevations, &mut rows, &mut notes);
        }
    }
    let scaling = scaling(&mut criterion);
    criterion.final_summary();
    if rows.is_empty() {
        return;
    }
    let baseline = ["--baseline", "--baseline-lenient"].iter().find_map(|name| option(&arguments, name));
    let name = baseline.clone().or_else(|| option(&arguments, "--save-baseline")).unwrap_or("base".into());
    let path = table::path(&name);
    let saved = table::load(&path);
    if baseline.is_some() && saved.is_none() {
        notes.push(format!("no changes shown: there is no saved table {}", path.display()));
    }
    let threads = rayon::current_num_threads();
    println!(
        "\nSearches: {RAYS} rays, {threads} threads, best of 10; error of {MEASURED} random rays in f64;"
    );
    println!("missed: the true first hit was skipped; false: reported in the air; Mrays/s in image order;");
    println!("instructions: one thread, image order, as for a processor without AVX-512\n");
    print!("{}\n{scaling}{}", table::table(&rows, saved.as_ref()), build());
    notes.iter().for_each(|note| println!("{note}"));
    if baseline.is_none()
        && let Err(error) = table::save(&path, &rows, saved)
    {
        eprintln!("{}: {error}", path.display());
    }
}
