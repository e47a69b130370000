//! Which settings a comparison tries when nobody says: every technique as it comes, and a few step
//! counts of those that have some, from quick to thorough.

use heightfield::Technique;

use crate::CompareError;

/// Step counts to try beside the defaults.
const GRID: &[(&str, &[(&str, f64)])] = &[
    ("steep", &[("steps", 8.0)]),
    ("steep", &[("steps", 16.0)]),
    ("steep", &[("steps", 64.0)]),
    ("steep", &[("steps", 256.0)]),
    ("relief", &[("linear", 16.0), ("refine", 6.0)]),
    ("relief", &[("linear", 64.0), ("refine", 8.0)]),
    ("relief", &[("linear", 128.0), ("refine", 8.0)]),
    ("pom", &[("steps", 8.0)]),
    ("pom", &[("steps", 16.0)]),
    ("pom", &[("steps", 64.0)]),
    ("pom", &[("steps", 128.0)]),
    ("interval", &[("linear", 12.0), ("refine", 3.0)]),
    ("interval", &[("linear", 64.0), ("refine", 4.0)]),
    ("interval", &[("linear", 128.0), ("refine", 4.0)]),
];

/// Every technique with its defaults, each followed by its variations.
///
/// # Errors
/// [`CompareError::HeightField`] if a technique lost a parameter that is varied here.
pub fn default_settings() -> Result<Vec<Technique>, CompareError> {
    let mut settings = Vec::new();
    for info in Technique::all() {
        settings.push(Technique::named(info.name)?);
        for (_, parameters) in GRID.iter().filter(|(name, _)| *name == info.name) {
            settings.push(with_parameters(info.name, parameters)?);
        }
    }
    Ok(settings)
}

/// A technique by name with some of its parameters set.
///
/// # Errors
/// Unknown names and values out of range.
pub fn with_parameters(name: &str, parameters: &[(&str, f64)]) -> Result<Technique, CompareError> {
    let mut technique = Technique::named(name)?;
    for (parameter, value) in parameters {
        technique = technique.with(parameter, *value)?;
    }
    Ok(technique)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_technique_is_there_and_no_setting_twice() {
        let settings = default_settings().unwrap();
        for info in Technique::all() {
            assert!(settings.iter().any(|s| s.info.name == info.name), "{}", info.name);
        }
        for (i, a) in settings.iter().enumerate() {
            assert!(settings[..i].iter().all(|b| a != b), "{a}");
        }
    }
}
