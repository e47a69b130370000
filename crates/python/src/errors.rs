//! Python exceptions, and which Rust error becomes which.

use bake::BakeError;
use heightfield::HeightFieldError;
use mesh::MeshError;
use pyo3::exceptions::{PyFileNotFoundError, PyIsADirectoryError, PyPermissionError, PyValueError};
use pyo3::prelude::*;
use render::RenderError;

/// The exception classes, apart because the crates' own errors have the same names.
pub mod classes {
    use pyo3::create_exception;
    use pyo3::exceptions::PyException;

    create_exception!(
        bumpwgpu,
        BumpError,
        PyException,
        "Base class of everything bumpwgpu raises on its own account."
    );
    create_exception!(bumpwgpu, MeshError, BumpError, "A mesh cannot be read, built or used.");
    create_exception!(
        bumpwgpu,
        BakeError,
        BumpError,
        "An image cannot be read or written, or a map cannot be baked."
    );
    create_exception!(
        bumpwgpu,
        RenderError,
        BumpError,
        "There is no Vulkan device, or it cannot draw what was asked."
    );
    create_exception!(bumpwgpu, CompareError, BumpError, "A comparison cannot be made.");
}

pub use classes::CompareError;
use classes::{BakeError as PyBakeError, MeshError as PyMeshError, RenderError as PyRenderError};

/// Rust errors that stand for a Python exception.
pub trait Raise {
    /// The exception, with the same message.
    fn raise(self) -> PyErr;
}

impl Raise for PyErr {
    fn raise(self) -> PyErr {
        self
    }
}

impl Raise for std::convert::Infallible {
    fn raise(self) -> PyErr {
        match self {}
    }
}

impl Raise for HeightFieldError {
    fn raise(self) -> PyErr {
        PyValueError::new_err(self.to_string())
    }
}

fn io(kind: std::io::ErrorKind, message: String) -> Option<PyErr> {
    match kind {
        std::io::ErrorKind::NotFound => Some(PyFileNotFoundError::new_err(message)),
        std::io::ErrorKind::PermissionDenied => Some(PyPermissionError::new_err(message)),
        std::io::ErrorKind::IsADirectory => Some(PyIsADirectoryError::new_err(message)),
        _ => None,
    }
}

impl Raise for BakeError {
    fn raise(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::Io { source, .. } => {
                io(source.kind(), message.clone()).unwrap_or_else(|| PyBakeError::new_err(message))
            }
            Self::HeightField(error) => error.raise(),
            // What is wrong with the values of a file is the caller's to say otherwise.
            Self::File { ref source, .. } if matches!(**source, Self::Stream { .. }) => {
                PyValueError::new_err(message)
            }
            Self::UnknownName { .. } | Self::Shape { .. } | Self::Option { .. } | Self::Stream { .. } => {
                PyValueError::new_err(message)
            }
            _ => PyBakeError::new_err(message),
        }
    }
}

impl Raise for MeshError {
    fn raise(self) -> PyErr {
        let message = self.to_string();
        match self {
            Self::NotFound { .. } => PyFileNotFoundError::new_err(message),
            Self::Read { source, .. } => {
                io(source.kind(), message.clone()).unwrap_or_else(|| PyMeshError::new_err(message))
            }
            Self::Parameter { .. } | Self::Arrays { .. } | Self::UnknownMethod { .. } => {
                PyValueError::new_err(message)
            }
            _ => PyMeshError::new_err(message),
        }
    }
}

impl Raise for RenderError {
    fn raise(self) -> PyErr {
        match self {
            Self::HeightField(error) => error.raise(),
            Self::Bake(error) => error.raise(),
            Self::Camera(_)
            | Self::Size { .. }
            | Self::Light { .. }
            | Self::Material { .. }
            | Self::Mesh { .. }
            | Self::Scene(_)
            | Self::UnknownTechnique { .. } => PyValueError::new_err(self.to_string()),
            _ => PyRenderError::new_err(self.to_string()),
        }
    }
}
