//! Texture statements of MTL: options, then a file name that may contain spaces.

use std::path::{Path, PathBuf};

/// A texture statement.
#[derive(Debug, PartialEq)]
pub(super) struct Statement {
    /// The file name as written.
    pub file: String,
    /// `-bm`, the bump multiplier.
    pub bump: Option<f32>,
    /// The gain of `-mm base gain`.
    pub gain: Option<f32>,
    /// Options that change how the texture looks and are not followed.
    pub ignored: Vec<String>,
}

/// Numbers an option takes: at least and at most. `None` for words that are no options.
fn arguments(option: &str) -> Option<(usize, usize)> {
    Some(match option {
        "-blendu" | "-blendv" | "-cc" | "-clamp" | "-imfchan" | "-type" | "-texres" | "-boost" | "-bm"
        | "-colorspace" => (1, 1),
        "-mm" => (2, 2),
        "-o" | "-s" | "-t" => (1, 3),
        _ => return None,
    })
}

/// Reads a statement without its keyword. Options are taken in front of the name and behind it.
pub(super) fn parse(text: &str) -> Statement {
    let mut statement = Statement { file: String::new(), bump: None, gain: None, ignored: Vec::new() };
    let mut rest = text.trim();
    while let Some(after) = statement.option(rest, true) {
        rest = after;
    }
    // Behind the name: from the first word on that is an option.
    let mut file = rest;
    for (at, _) in rest.match_indices(" -") {
        let word = rest[at + 1..].split_whitespace().next().unwrap_or("");
        if arguments(word).is_some() {
            file = &rest[..at];
            let mut options = &rest[at + 1..];
            while let Some(after) = statement.option(options, false) {
                options = after;
            }
            break;
        }
    }
    statement.file = file.trim().trim_matches('"').to_owned();
    statement
}

impl Statement {
    /// Takes one option off the front of `text`. With `name_follows` the last word is never taken.
    fn option<'a>(&mut self, text: &'a str, name_follows: bool) -> Option<&'a str> {
        let (option, mut rest) = super::text::keyword(text);
        let (least, most) = arguments(option)?;
        let mut values = Vec::new();
        while values.len() < most {
            let (word, after) = super::text::keyword(rest);
            let optional = values.len() >= least;
            if word.is_empty()
                || (name_follows && after.is_empty())
                || (optional && word.parse::<f32>().is_err())
            {
                break;
            }
            values.push(word);
            rest = after;
        }
        let number = |i: usize| values.get(i).and_then(|w| w.parse::<f32>().ok()).filter(|n| n.is_finite());
        match option {
            "-bm" => self.bump = number(0),
            "-mm" => {
                self.gain = number(1);
                if number(0) != Some(0.0) {
                    self.ignored.push(format!("-mm {}", values.join(" ")));
                }
            }
            "-o" | "-s" | "-t" | "-imfchan" | "-boost" => {
                self.ignored.push(format!("{option} {}", values.join(" ")));
            }
            // Hints on filtering and caching.
            _ => {}
        }
        Some(rest)
    }
}

/// The file a name means: beside the library as written, or with its folders dropped, as they often
/// come from another machine.
pub(super) fn find(folder: &Path, file: &str) -> Option<PathBuf> {
    let slashed = file.replace('\\', "/");
    let last = slashed.rsplit('/').next().unwrap_or("");
    [slashed.as_str(), last].iter().filter(|f| !f.is_empty()).map(|f| folder.join(f)).find(|p| p.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_come_before_or_after_names_with_spaces() {
        for text in [
            "-bm 0.25 my wall.png",
            "my wall.png -bm 0.25",
            "\"my wall.png\" -bm 0.25",
            " -clamp on -bm 0.25  my wall.png ",
        ] {
            let found = parse(text);
            assert_eq!((found.file.as_str(), found.bump), ("my wall.png", Some(0.25)), "{text}");
        }
    }

    #[test]
    fn options_take_as_many_numbers_as_there_are() {
        let found = parse("-s 2 2 -o 0.5 -mm 0 0.75 3d - bricks -x.png");
        assert_eq!(found.file, "3d - bricks -x.png");
        assert_eq!((found.gain, found.bump), (Some(0.75), None));
        assert_eq!(found.ignored, ["-s 2 2", "-o 0.5"]);
    }

    #[test]
    fn senseless_statements_still_end() {
        for text in ["", "-bm", "-bm 1", "-s 1 2 3", "-mm", "-bm x y", " -bm -bm -bm ", "-bm nan a"] {
            let _ = parse(text);
        }
        assert_eq!(parse("-s 1 2 3").file, "3");
    }
}
