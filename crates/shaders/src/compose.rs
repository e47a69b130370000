//! The once-only `#import` stitcher.

use thiserror::Error;

static FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Files in the place of others: what is asked for, and what stands in for it.
type Replaced = &'static [(&'static str, &'static str)];

/// With a horizon map: its shadows for all others.
const HORIZON_SHADOWS: Replaced = &[
    ("shading/shadow_none.wgsl", "shading/shadow_horizon.wgsl"),
    ("shading/shadow_search.wgsl", "shading/shadow_horizon.wgsl"),
];

/// Where rays go through shells: the heights of all solids of the scene for those of one draw.
const AMONG_SOLIDS: Replaced = &[
    ("bindings/pyramid.wgsl", "bindings/solid_heights.wgsl"),
    ("bindings/draw.wgsl", "bindings/draw_among_solids.wgsl"),
];

/// A program that cannot be put together.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ComposeError {
    /// A file asks for another that does not exist.
    #[error("shader file {path:?}, imported by {from:?}, does not exist")]
    Missing {
        /// The path asked for, relative to `shaders_wgsl/`.
        path: String,
        /// Who asked for it.
        from: String,
    },
    /// An `#import` line without a quoted path.
    #[error("{path}:{line}: expected #import \"path\", got {text:?}")]
    Malformed {
        /// The file with the line.
        path: String,
        /// Line number, from 1.
        line: usize,
        /// The line.
        text: String,
    },
}

/// Paths of all embedded files, sorted, relative to `shaders_wgsl/`.
pub fn files() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(path, _)| *path)
}

/// The text of one file as it was written, with its `#import` lines.
pub fn read(path: &str) -> Option<&'static str> {
    FILES.binary_search_by(|(known, _)| known.cmp(&path)).ok().map(|at| FILES[at].1)
}

/// The program of one entry: `entry/<entry>.wgsl`, or `kernels/<name>.wgsl` when `entry` is
/// `"kernels/<name>"`, with `search/<search>.wgsl` and `surface/<surface>.wgsl`.
///
/// # Errors
/// [`ComposeError`] when a file is missing or an import malformed.
pub fn compose(entry: &str, search: Option<&str>, surface: Option<&str>) -> Result<String, ComposeError> {
    let replaced = if traces_solids(entry) { AMONG_SOLIDS } else { &[] };
    stitch(program_paths(entry, search, surface).iter().map(String::as_str), replaced)
}

/// Whether an entry finds out for itself what it sees, and traces rays through the shells of a scene.
pub fn traces_solids(entry: &str) -> bool {
    matches!(entry, "displaced" | "shell")
}

fn program_paths(entry: &str, search: Option<&str>, surface: Option<&str>) -> Vec<String> {
    let mut paths = Vec::new();
    paths.extend(search.map(|name| format!("search/{name}.wgsl")));
    paths.extend(surface.map(|name| format!("surface/{name}.wgsl")));
    paths.push(if entry.starts_with("kernels/") {
        format!("{entry}.wgsl")
    } else {
        format!("entry/{entry}.wgsl")
    });
    paths
}

/// The program made of the given files and of all that they import.
///
/// # Errors
/// As [`compose`].
pub fn compose_paths<'a>(paths: impl IntoIterator<Item = &'a str>) -> Result<String, ComposeError> {
    stitch(paths, &[])
}

/// As [`compose`], with shadows from a horizon map: `shading/shadow_horizon.wgsl` stands in for whatever
/// `shading/shadow_*.wgsl` the entry asks for.
///
/// # Errors
/// As [`compose`].
pub fn compose_with_horizon(
    entry: &str,
    search: Option<&str>,
    surface: Option<&str>,
) -> Result<String, ComposeError> {
    let paths = program_paths(entry, search, surface);
    stitch(paths.iter().map(String::as_str), HORIZON_SHADOWS)
}

fn stitch<'a>(paths: impl IntoIterator<Item = &'a str>, replaced: Replaced) -> Result<String, ComposeError> {
    let mut stitcher = Stitcher { included: Vec::new(), source: String::new(), replaced };
    for path in paths {
        stitcher.include(path, "the program")?;
    }
    Ok(stitcher.source)
}

struct Stitcher {
    included: Vec<String>,
    source: String,
    replaced: Replaced,
}

impl Stitcher {
    fn include(&mut self, path: &str, from: &str) -> Result<(), ComposeError> {
        let path =
            self.replaced.iter().find(|(asked, _)| *asked == path).map_or(path, |(_, stand_in)| stand_in);
        if self.included.iter().any(|known| known == path) {
            return Ok(());
        }
        // Marked before its own imports are followed, so that a cycle ends.
        self.included.push(path.to_owned());
        let Some(text) = read(path) else {
            return Err(ComposeError::Missing { path: path.to_owned(), from: from.to_owned() });
        };
        let mut own = String::with_capacity(text.len());
        for (at, line) in text.lines().enumerate() {
            if let Some(rest) = line.trim_start().strip_prefix("#import") {
                let quoted = rest.trim().strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
                let Some(imported) = quoted else {
                    return Err(ComposeError::Malformed {
                        path: path.to_owned(),
                        line: at + 1,
                        text: line.to_owned(),
                    });
                };
                self.include(imported, path)?;
            } else {
                own.push_str(line);
                own.push('\n');
            }
        }
        self.source.push_str("// ---- ");
        self.source.push_str(path);
        self.source.push('\n');
        self.source.push_str(&own);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_named() {
        let error = compose_paths(["lib/no_such_file.wgsl"]).unwrap_err();
        assert!(error.to_string().contains("lib/no_such_file.wgsl"), "{error}");
    }

    #[test]
    fn a_file_is_included_once() {
        let path = files().next().unwrap();
        let once = compose_paths([path]).unwrap();
        assert_eq!(once, compose_paths([path, path]).unwrap());
    }
}
