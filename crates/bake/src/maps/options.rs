//! The options of maps: what each takes, and the values of one bake.

use std::fmt;

use crate::BakeError;

/// What an option takes, and its value when nothing is said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A whole number in `min..=max`.
    Whole {
        /// Value when nothing is said.
        default: i64,
        /// Smallest accepted value.
        min: i64,
        /// Largest accepted value.
        max: i64,
    },
    /// A finite number in `min..=max`.
    Number {
        /// Value when nothing is said.
        default: f64,
        /// Smallest accepted value.
        min: f64,
        /// Largest accepted value.
        max: f64,
    },
    /// Yes or no.
    Flag {
        /// Value when nothing is said.
        default: bool,
    },
    /// One of some names.
    Choice {
        /// Value when nothing is said.
        default: &'static str,
        /// All names.
        choices: &'static [&'static str],
    },
}

/// One option of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapOption {
    /// Name in Rust, in Python and, with dashes, on the command line. The names of a height map's own
    /// settings (`scale`, `wrap` ...) and of the file options (`format`, `bits` ...) are taken.
    pub name: &'static str,
    /// What it does, in one line, with its unit.
    pub summary: &'static str,
    /// What it takes.
    pub kind: Kind,
}

/// The value of an option.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// A number; options of [`Kind::Number`] take whole ones as well.
    Number(f64),
    /// One of the names of a [`Kind::Choice`].
    Choice(String),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Flag(value) => value.fmt(f),
            Value::Whole(value) => value.fmt(f),
            Value::Number(value) => value.fmt(f),
            Value::Choice(value) => value.fmt(f),
        }
    }
}

impl MapOption {
    /// The value when nothing is said.
    pub fn default(&self) -> Value {
        match self.kind {
            Kind::Whole { default, .. } => Value::Whole(default),
            Kind::Number { default, .. } => Value::Number(default),
            Kind::Flag { default } => Value::Flag(default),
            Kind::Choice { default, .. } => Value::Choice(default.to_owned()),
        }
    }

    /// The value as this option holds it, or what is expected instead.
    fn accept(&self, value: Value) -> Result<Value, String> {
        match (self.kind, value) {
            (Kind::Whole { min, max, .. }, Value::Whole(value)) if (min..=max).contains(&value) => {
                Ok(Value::Whole(value))
            }
            (Kind::Whole { min, max, .. }, _) => Err(format!("must be a whole number in {min}..{max}")),
            (Kind::Number { min, max, .. }, value) => {
                let number = match value {
                    Value::Whole(value) => value as f64,
                    Value::Number(value) => value,
                    _ => f64::NAN,
                };
                let accepted = (min..=max).contains(&number);
                accepted.then_some(Value::Number(number)).ok_or(format!("must be a number in {min}..{max}"))
            }
            (Kind::Flag { .. }, Value::Flag(value)) => Ok(Value::Flag(value)),
            (Kind::Flag { .. }, _) => Err("must be true or false".to_owned()),
            (Kind::Choice { choices, .. }, Value::Choice(value)) if choices.contains(&value.as_str()) => {
                Ok(Value::Choice(value))
            }
            (Kind::Choice { choices, .. }, _) => Err(format!("must be one of {}", choices.join(", "))),
        }
    }
}

/// Values for all options of one map.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    map: &'static str,
    known: &'static [MapOption],
    values: Vec<Value>,
}

impl Options {
    /// The defaults of a map's options.
    pub(crate) fn defaults(map: &'static str, known: &'static [MapOption]) -> Self {
        Self { map, known, values: known.iter().map(MapOption::default).collect() }
    }

    /// The same options with one changed.
    ///
    /// # Errors
    /// [`BakeError::Option`] for an option that the map does not take, or a value that the option
    /// does not take.
    pub fn with(mut self, name: &str, value: Value) -> Result<Self, BakeError> {
        let fail = |problem| BakeError::Option { map: self.map, option: name.to_owned(), problem };
        let Some(at) = self.known.iter().position(|option| option.name == name) else {
            let names: Vec<&str> = self.known.iter().map(|option| option.name).collect();
            return Err(fail(if names.is_empty() {
                "unknown; this map has no options".to_owned()
            } else {
                format!("unknown; this map takes {}", names.join(", "))
            }));
        };
        let text = value.to_string();
        self.values[at] =
            self.known[at].accept(value).map_err(|expected| fail(format!("{expected}, got {text}")))?;
        Ok(self)
    }

    /// Names and values, in the order in which the map lists them.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.known.iter().map(|option| option.name).zip(&self.values)
    }

    fn get(&self, name: &str) -> Option<&Value> {
        let found = self.iter().find(|(known, _)| *known == name).map(|(_, value)| value);
        debug_assert!(found.is_some(), "map {} has no option {name}", self.map);
        found
    }

    /// The value of a [`Kind::Whole`] option; ask only for what the map lists.
    pub fn whole(&self, name: &str) -> i64 {
        if let Some(Value::Whole(value)) = self.get(name) { *value } else { 0 }
    }

    /// The value of a [`Kind::Number`] option; ask only for what the map lists.
    pub fn number(&self, name: &str) -> f64 {
        if let Some(Value::Number(value)) = self.get(name) { *value } else { 0.0 }
    }

    /// The value of a [`Kind::Flag`] option; ask only for what the map lists.
    pub fn flag(&self, name: &str) -> bool {
        matches!(self.get(name), Some(Value::Flag(true)))
    }

    /// The value of a [`Kind::Choice`] option; ask only for what the map lists.
    pub fn choice(&self, name: &str) -> &str {
        if let Some(Value::Choice(value)) = self.get(name) { value } else { "" }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: &[MapOption] = &[
        MapOption { name: "count", summary: "", kind: Kind::Whole { default: 8, min: 1, max: 16 } },
        MapOption { name: "reach", summary: "", kind: Kind::Number { default: 0.5, min: 0.0, max: 1.0 } },
        MapOption { name: "bent", summary: "", kind: Kind::Flag { default: false } },
        MapOption {
            name: "mode",
            summary: "",
            kind: Kind::Choice { default: "exact", choices: &["exact", "texel"] },
        },
    ];

    fn defaults() -> Options {
        Options::defaults("test", KNOWN)
    }

    #[test]
    fn defaults_are_there_and_changes_are_kept() {
        let options = defaults();
        assert_eq!((options.whole("count"), options.number("reach")), (8, 0.5));
        assert_eq!((options.flag("bent"), options.choice("mode")), (false, "exact"));
        let options = options.with("count", Value::Whole(16)).unwrap();
        let options = options.with("reach", Value::Whole(1)).unwrap();
        let options = options.with("bent", Value::Flag(true)).unwrap();
        let options = options.with("mode", Value::Choice("texel".to_owned())).unwrap();
        let listed: Vec<String> = options.iter().map(|(name, value)| format!("{name}={value}")).collect();
        assert_eq!(listed, ["count=16", "reach=1", "bent=true", "mode=texel"]);
    }

    #[test]
    fn what_an_option_does_not_take_is_refused() {
        let cases = [
            ("count", Value::Whole(0), "a whole number in 1..16, got 0"),
            ("count", Value::Number(2.0), "a whole number in 1..16"),
            ("reach", Value::Number(f64::NAN), "a number in 0..1, got NaN"),
            ("reach", Value::Flag(true), "a number in 0..1, got true"),
            ("bent", Value::Whole(1), "true or false"),
            ("mode", Value::Choice("rough".to_owned()), "one of exact, texel, got rough"),
            ("width", Value::Whole(1), "this map takes count, reach, bent, mode"),
        ];
        for (name, value, expected) in cases {
            let error = defaults().with(name, value).unwrap_err().to_string();
            assert!(error.contains(expected) && error.contains(name), "{error}");
        }
    }
}
