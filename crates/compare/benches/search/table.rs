//! The one table: time, throughput, error and instructions, and what changed since a saved run.

use std::collections::BTreeMap;
use std::fmt::{self, Write};
use std::path::{Path, PathBuf};

use compare::Metrics;

use crate::scene::Map;

/// Which line: map, side, elevation, technique.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    pub map: Map,
    pub side: usize,
    pub elevation: f64,
    pub technique: String,
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\t{}\t{}\t{}", self.map, self.side, self.elevation, self.technique)
    }
}

/// One line of the table. What was not measured is `None`.
#[derive(Debug, Clone)]
pub struct Row {
    pub key: Key,
    /// Nanoseconds a ray in random order, all threads.
    pub random_ns: Option<f64>,
    /// Nanoseconds a ray in image order, all threads.
    pub image_ns: Option<f64>,
    pub error: Metrics,
    /// Instructions a ray, one thread.
    pub instructions: Option<f64>,
}

/// Times and counts of an earlier run, by [`Key`].
pub type Saved = BTreeMap<String, [Option<f64>; 3]>;

const DASH: &str = "-";

fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| DASH.to_owned(), |value| format!("{value:.decimals$}"))
}

fn change(now: Option<f64>, before: Option<f64>) -> String {
    match (now, before) {
        (Some(now), Some(before)) if before > 0.0 => format!("{:+.1} %", 100.0 * (now / before - 1.0)),
        _ => DASH.to_owned(),
    }
}

/// All lines, with the changes against `saved` where there is one.
pub fn table(rows: &[Row], saved: Option<&Saved>) -> String {
    let mut text = format!(
        "{:<6} {:>5} {:>4} {:<26} {:>9} {:>9} {:>8} {:>11} {:>8} {:>7} {:>9}",
        "map",
        "side",
        "deg",
        "technique",
        "random ns",
        "image ns",
        "Mrays/s",
        "p99 texels",
        "missed %",
        "false %",
        "instr/ray"
    );
    if saved.is_some() {
        let _ = write!(text, " {:>9} {:>9} {:>9}", "d random", "d image", "d instr");
    }
    text.push('\n');
    for row in rows {
        let Key { map, side, elevation, technique } = &row.key;
        let _ = write!(
            text,
            "{map:<6} {side:>5} {elevation:>4} {technique:<26} {:>9} {:>9} {:>8} {:>11.5} {:>8.3} {:>7.3} {:>9}",
            number(row.random_ns, 1),
            number(row.image_ns, 1),
            number(row.image_ns.map(|ns| 1e3 / ns), 2),
            row.error.uv_error_p99_texels,
            100.0 * row.error.failure_rate(),
            100.0 * row.error.false_hit_rate,
            number(row.instructions, 0),
        );
        if let Some(saved) = saved {
            let [random, image, instructions] = saved.get(&row.key.to_string()).copied().unwrap_or([None; 3]);
            let _ = write!(
                text,
                " {:>9} {:>9} {:>9}",
                change(row.random_ns, random),
                change(row.image_ns, image),
                change(row.instructions, instructions)
            );
        }
        text.push('\n');
    }
    text
}

/// Where runs are saved: beside criterion's own baselines.
pub fn path(name: &str) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target"), PathBuf::from);
    target.join("criterion").join(format!("table-{name}.tsv"))
}

/// Saves times and counts; lines of an earlier run that this one left out are kept.
pub fn save(path: &Path, rows: &[Row], earlier: Option<Saved>) -> std::io::Result<()> {
    let mut saved = earlier.unwrap_or_default();
    for row in rows {
        let kept = saved.get(&row.key.to_string()).copied().unwrap_or([None; 3]);
        let now = [row.random_ns, row.image_ns, row.instructions];
        saved.insert(row.key.to_string(), std::array::from_fn(|at| now[at].or(kept[at])));
    }
    let mut text = String::new();
    for (key, values) in &saved {
        let [random, image, instructions] = values.map(|value| number(value, 3));
        let _ = writeln!(text, "{key}\t{random}\t{image}\t{instructions}");
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(path, text)
}

/// What [`save`] wrote; `None` when there is no such file.
pub fn load(path: &Path) -> Option<Saved> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = |line: &str| {
        let mut parts: Vec<&str> = line.split('\t').collect();
        let values = parts.split_off(parts.len().checked_sub(3)?);
        let values: Vec<Option<f64>> = values.iter().map(|value| value.parse().ok()).collect();
        Some((parts.join("\t"), values.try_into().ok()?))
    };
    Some(text.lines().filter_map(line).collect())
}
