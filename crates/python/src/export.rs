//! Searches written out in shading languages.

use heightfield::Technique;
use heightfield::technique::Reads;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shaders::Language;

use crate::field::parse_wrap;
use crate::march::parse_technique;

/// A search with its parameters set, in "wgsl", "glsl", "hlsl" or "msl", for maps of this wrap.
#[pyfunction]
pub fn export_search(
    technique: &str,
    parameters: Vec<(String, f64)>,
    wrap: &str,
    language: &str,
) -> PyResult<String> {
    let technique = parse_technique(technique, &parameters)?;
    let Some(language) = Language::ALL.into_iter().find(|known| known.name() == language) else {
        let known = Language::ALL.map(Language::name).join(", ");
        return Err(PyValueError::new_err(format!("unknown language {language:?}; known: {known}")));
    };
    let constants = constants(&technique, parse_wrap(wrap)?);
    shaders::export_search(technique.info.name, &constants, language)
        .map_err(|error| PyValueError::new_err(error.to_string()))
}

fn constants(technique: &Technique, wrap: heightfield::Wrap) -> Vec<(&'static str, String)> {
    let mut all: Vec<_> = technique.settings().map(|(name, value)| (name, format!("{value:.0}"))).collect();
    if technique.info.reads == Reads::Pyramid {
        all.push(("endless", (wrap == heightfield::Wrap::Clamp).to_string()));
    }
    all
}
