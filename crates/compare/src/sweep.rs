//! Which settings a comparison starts from when nobody says, and what lies between two of them.

use heightfield::Technique;

use crate::CompareError;

/// Parameters that trade time against error, with values to begin with, from quick to thorough. What a
/// parameter like the step limit of an exact search guards against is no such trade.
const LADDERS: &[(&str, &str, &[u32])] = &[
    ("steep", "steps", &[8, 128]),
    ("steep_linear", "max_steps", &[16, 256]),
    ("steep_exponential", "max_steps", &[16, 256]),
    ("binary", "steps", &[8, 24]),
    ("relief", "linear", &[8, 128]),
    ("relief", "refine", &[4, 12]),
    ("pom", "steps", &[8, 128]),
    ("interval", "linear", &[8, 128]),
    ("interval", "refine", &[2, 8]),
    ("relaxed_cone", "refine", &[4, 20]),
];

/// Techniques that are compared only when asked for: their maps take minutes, and what they show is how
/// published recipes fail.
const ONLY_WHEN_ASKED: &[&str] = &["relaxed_cone_texel"];

/// Least quotient of two values worth a third one between them: steps nearer to each other than its root would
/// be told apart by noise.
const LEAST_QUOTIENT: f64 = 1.9;

/// Every technique with its defaults but those that need asking for.
///
/// # Errors
/// [`CompareError::HeightField`] if a technique is not there.
pub fn defaults() -> Result<Vec<Technique>, CompareError> {
    Technique::all()
        .iter()
        .filter(|info| !ONLY_WHEN_ASKED.contains(&info.name))
        .map(|info| Ok(Technique::named(info.name)?))
        .collect()
}

/// The defaults and, for each ladder, its first values with the other parameters at their defaults.
///
/// # Errors
/// [`CompareError::HeightField`] if a technique lost a parameter that is varied here.
pub fn first_settings() -> Result<Vec<Technique>, CompareError> {
    let mut settings = Vec::new();
    for technique in defaults()? {
        settings.push(technique);
        for (_, parameter, values) in ladders(&technique) {
            for &value in *values {
                settings.push(technique.with(parameter, f64::from(value))?);
            }
        }
    }
    Ok(settings)
}

fn ladders(
    technique: &Technique,
) -> impl Iterator<Item = &'static (&'static str, &'static str, &'static [u32])> {
    let name = technique.info.name;
    LADDERS.iter().filter(move |ladder| ladder.0 == name)
}

/// Settings next to this one along each of its ladders: halfway (in the geometric mean) to the nearest one
/// tried on either side, and half or double where none was tried.
pub fn neighbours(technique: &Technique, tried: &[Technique]) -> Vec<Technique> {
    let mut found: Vec<Technique> = Vec::new();
    for &(_, parameter, _) in ladders(technique) {
        let value = |other: &Technique| {
            other.settings().find(|(name, _)| *name == parameter).map_or(0.0, |(_, value)| value)
        };
        let here = value(technique);
        // Settings that differ in this parameter alone.
        let others: Vec<f64> = tried
            .iter()
            .filter(|other| technique.with(parameter, value(other)).is_ok_and(|moved| moved == **other))
            .map(value)
            .collect();
        let below = others.iter().copied().filter(|&v| v < here).max_by(f64::total_cmp);
        let above = others.iter().copied().filter(|&v| v > here).min_by(f64::total_cmp);
        for next in [below.unwrap_or(here / 4.0), above.unwrap_or(here * 4.0)] {
            if next <= 0.0 || next.max(here) / next.min(here) < LEAST_QUOTIENT {
                continue;
            }
            let between = (next * here).sqrt().round();
            if let Ok(moved) = technique.with(parameter, between)
                && !tried.contains(&moved)
                && !found.contains(&moved)
            {
                found.push(moved);
            }
        }
    }
    found
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
        let settings = first_settings().unwrap();
        for info in Technique::all().iter().filter(|info| !ONLY_WHEN_ASKED.contains(&info.name)) {
            assert!(settings.iter().any(|s| s.info.name == info.name), "{}", info.name);
        }
        for (i, a) in settings.iter().enumerate() {
            assert!(settings[..i].iter().all(|b| a != b), "{a}");
        }
    }

    #[test]
    fn neighbours_halve_the_way_and_stop_when_it_is_short() {
        let steep = |steps: f64| with_parameters("steep", &[("steps", steps)]).unwrap();
        let values = |found: Vec<Technique>| -> Vec<f64> { found.iter().map(|t| t.values[0]).collect() };
        let tried = [steep(8.0), steep(32.0), steep(128.0)];
        assert_eq!(values(neighbours(&tried[1], &tried)), [16.0, 64.0]);
        assert_eq!(values(neighbours(&tried[2], &tried)), [64.0, 256.0]);
        let close = [steep(28.0), steep(32.0), steep(36.0)];
        assert!(neighbours(&close[1], &close).is_empty());
        assert!(neighbours(&steep(1.0), &[steep(1.0)]).iter().all(|t| t.values[0] > 1.0));
        let exact = Technique::named("exact").unwrap();
        assert!(neighbours(&exact, &[exact]).is_empty());
    }
}
