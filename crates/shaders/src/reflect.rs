//! Validation and struct layouts, by naga.

use naga::valid::{Capabilities, ValidationFlags, Validator};
use thiserror::Error;

/// A program that naga refuses, or a struct that it does not have.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReflectError {
    /// Not valid WGSL.
    #[error("invalid WGSL: {0}")]
    Invalid(String),
    /// No struct of that name.
    #[error("no struct {0:?} in the program")]
    NoStruct(String),
}

/// One member of a host-shared struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Member name.
    pub name: String,
    /// Offset in bytes.
    pub offset: u32,
    /// Size in bytes.
    pub size: u32,
}

/// The layout of a host-shared struct.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Its members in order.
    pub fields: Vec<Field>,
    /// Its size in bytes.
    pub size: u32,
}

/// Parses and validates a composed program and returns naga's module.
///
/// # Errors
/// [`ReflectError::Invalid`] with naga's message and the source line.
pub fn validate(source: &str) -> Result<naga::Module, ReflectError> {
    let module = naga::front::wgsl::parse_str(source)
        .map_err(|error| ReflectError::Invalid(error.emit_to_string(source)))?;
    Validator::new(ValidationFlags::all(), Capabilities::default())
        .validate(&module)
        .map_err(|error| ReflectError::Invalid(error.emit_to_string(source)))?;
    Ok(module)
}

/// The layout of the struct `name` in a composed program.
///
/// # Errors
/// [`ReflectError`] when the program is invalid or has no such struct.
pub fn layout_of(source: &str, name: &str) -> Result<Layout, ReflectError> {
    let module = validate(source)?;
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).map_err(|error| ReflectError::Invalid(error.to_string()))?;
    for (_, ty) in module.types.iter() {
        if ty.name.as_deref() != Some(name) {
            continue;
        }
        if let naga::TypeInner::Struct { members, span } = &ty.inner {
            let fields = members
                .iter()
                .map(|member| Field {
                    name: member.name.clone().unwrap_or_default(),
                    offset: member.offset,
                    size: layouter[member.ty].size,
                })
                .collect();
            return Ok(Layout { fields, size: *span });
        }
    }
    Err(ReflectError::NoStruct(name.to_owned()))
}
