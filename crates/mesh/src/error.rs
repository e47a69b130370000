//! What can go wrong with a mesh.

use std::path::PathBuf;

use thiserror::Error;

/// Errors of this crate. The messages say what, where, what was expected and what was found.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file is not there.
    #[error("file not found: {}", path.display())]
    NotFound {
        /// The path asked for.
        path: PathBuf,
    },
    /// The file is there but cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The path asked for.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is not in a format this crate reads.
    #[error("{name}: unknown mesh format; expected .obj, .gltf or .glb")]
    UnknownFormat {
        /// File name.
        name: String,
    },
    /// The content of a file breaks the rules of its format.
    #[error("{name}: {problem}")]
    Malformed {
        /// File name.
        name: String,
        /// What, where, expected and got.
        problem: String,
    },
    /// The file needs something this crate does not do.
    #[error("{name}: {problem}")]
    Unsupported {
        /// File name.
        name: String,
        /// What it needs.
        problem: String,
    },
    /// The arrays given do not make a mesh.
    #[error("{problem}")]
    Arrays {
        /// What, where, expected and got.
        problem: String,
    },
    /// A parameter is out of range.
    #[error("{name} is {value}; {expected}")]
    Parameter {
        /// Which parameter.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it should be.
        expected: &'static str,
    },
    /// No tangent method has that name.
    #[error("unknown tangent method {name:?}; known: {known}")]
    UnknownMethod {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The mesh is larger than this crate accepts.
    #[error("{what}: {got}, at most {limit} accepted")]
    TooLarge {
        /// What is too large.
        what: String,
        /// How large it is.
        got: u64,
        /// How large it may be.
        limit: u64,
    },
    /// There is not enough memory for a result.
    #[error("{what} needs {bytes} bytes, which are not to be had")]
    NoMemory {
        /// What was to be stored.
        what: &'static str,
        /// Its size.
        bytes: u64,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}

impl MeshError {
    pub(crate) fn malformed(name: &str, problem: impl Into<String>) -> Self {
        Self::Malformed { name: name.to_owned(), problem: problem.into() }
    }

    pub(crate) fn arrays(problem: impl Into<String>) -> Self {
        Self::Arrays { problem: problem.into() }
    }
}
