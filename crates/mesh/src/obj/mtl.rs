//! Material libraries. Lines that `tobj` would stumble over are mended or dropped first.

use std::collections::HashMap;
use std::fmt::Write;
use std::io::BufReader;
use std::path::Path;

use super::text::{decode, for_each_line, keyword, short};
use super::texture;
use crate::arrays::read_file;
use crate::limits::{self, MAX_LIBRARIES, MAX_MTL_BYTES};
use crate::material::{ImageSource, MaterialSource};

/// All materials of all libraries.
#[derive(Default)]
pub(super) struct Library {
    pub materials: Vec<tobj::Material>,
    pub index: HashMap<String, usize>,
    pub sources: Vec<MaterialSource>,
}

/// Reads what the `mtllib` lines name. Whatever is missing or wrong becomes a warning.
pub(super) fn read_all(lines: &[String], folder: &Path, warnings: &mut Vec<String>) -> Library {
    let mut library = Library::default();
    let mut done = std::collections::HashSet::new();
    for line in lines {
        // One name with spaces, or several names: whichever is there.
        let whole = texture::find(folder, line);
        let names: Vec<&str> = if whole.is_some() { vec![line] } else { line.split_whitespace().collect() };
        for name in names {
            if !done.insert(name) {
                continue;
            }
            if done.len() > MAX_LIBRARIES {
                warnings.push(format!("only the first {MAX_LIBRARIES} material libraries are read"));
                return library;
            }
            match texture::find(folder, name) {
                Some(path) => library.read(&path, name, warnings),
                None => warnings.push(format!("material library {:?} not found", short(name))),
            }
        }
    }
    library
}

impl Library {
    fn read(&mut self, path: &Path, name: &str, warnings: &mut Vec<String>) {
        let mut warn = |problem: String| warnings.push(format!("material library {name:?}: {problem}"));
        let bytes = match read_file(path, MAX_MTL_BYTES) {
            Ok(bytes) => bytes,
            Err(error) => return warn(error.to_string()),
        };
        let text = match decode(&bytes) {
            Ok(text) => text,
            Err(problem) => return warn(problem),
        };
        let cleaned = clean(&text, &mut warn);
        match tobj::load_mtl_buf(&mut BufReader::new(cleaned.as_bytes())) {
            Ok((materials, index)) => {
                let offset = self.materials.len();
                let folder = path.parent().unwrap_or(Path::new(""));
                self.sources.extend(materials.iter().map(|m| source(m, folder, &mut warn)));
                self.materials.extend(materials);
                self.index.extend(index.into_iter().map(|(name, at)| (name, at + offset)));
            }
            Err(error) => warn(error.to_string()),
        }
    }
}

/// The keyword as `tobj` spells it; writers differ in case and in names beyond the standard.
fn canonical(key: &str) -> &str {
    const SPELLINGS: [(&str, &[&str]); 11] = [
        ("newmtl", &["newmtl"]),
        ("Kd", &["kd"]),
        ("Ks", &["ks"]),
        ("Ka", &["ka"]),
        ("Ke", &["ke"]),
        ("Ns", &["ns"]),
        ("Ni", &["ni"]),
        ("map_Kd", &["map_kd"]),
        ("map_Bump", &["map_bump", "bump"]),
        ("norm", &["norm", "map_norm", "map_kn"]),
        ("disp", &["disp", "map_disp", "map_displacement"]),
    ];
    let lower = key.to_ascii_lowercase();
    SPELLINGS.iter().find(|(_, all)| all.contains(&lower.as_str())).map_or(key, |(canonical, _)| canonical)
}

fn clean(text: &str, warn: &mut impl FnMut(String)) -> String {
    let mut out = String::with_capacity(text.len());
    let mut named = false;
    let each = |number: usize, line: &str| -> Result<(), std::convert::Infallible> {
        let (key, rest) = keyword(line);
        let key = canonical(key);
        let numbers: Vec<f32> =
            rest.split_whitespace().map_while(|w| w.parse().ok()).filter(|n: &f32| n.is_finite()).collect();
        let mut bad = |what: &str| warn(format!("line {number}: {key} {:?} {what}", short(rest)));
        let _ = match key {
            "newmtl" => {
                named = !rest.is_empty();
                if !named {
                    bad("has no name; left out");
                    return Ok(());
                }
                writeln!(out, "newmtl {}", limits::name(rest).trim_end())
            }
            // What comes before the first name belongs to nothing.
            _ if !named => return Ok(()),
            "Kd" | "Ks" | "Ka" | "Ke" => match numbers[..] {
                [r, g, b, ..] => writeln!(out, "{key} {r} {g} {b}"),
                [grey] => writeln!(out, "{key} {grey} {grey} {grey}"),
                _ => {
                    bad("is not a colour; ignored");
                    return Ok(());
                }
            },
            "Ns" | "Ni" | "d" => {
                let value = rest.split_whitespace().last().and_then(|w| w.parse::<f32>().ok());
                match value.filter(|n| n.is_finite()) {
                    Some(value) => writeln!(out, "{key} {value}"),
                    None => {
                        bad("is not a number; ignored");
                        return Ok(());
                    }
                }
            }
            "map_Kd" | "map_Bump" | "norm" | "disp" if !rest.is_empty() => writeln!(out, "{key} {rest}"),
            // Nothing else is used, so nothing else needs to be right.
            _ => Ok(()),
        };
        Ok(())
    };
    let Ok(()) = for_each_line(text, each);
    out
}

fn source(material: &tobj::Material, folder: &Path, warn: &mut impl FnMut(String)) -> MaterialSource {
    let mut image = |statement: Option<&String>| -> (Option<ImageSource>, Option<f32>, Option<f32>) {
        let Some(statement) = statement.map(|text| texture::parse(text)) else { return (None, None, None) };
        for option in &statement.ignored {
            warn(format!("texture {:?}: option {option} is ignored", statement.file));
        }
        let found = texture::find(folder, &statement.file).map(ImageSource::File);
        if found.is_none() {
            warn(format!("texture {:?} not found", statement.file));
        }
        (found, statement.bump, statement.gain)
    };
    let (albedo, ..) = image(material.diffuse_texture.as_ref());
    let (bump, bump_scale, _) = image(material.normal_texture.as_ref());
    let (normal, normal_scale, _) = image(material.unknown_param.get("norm"));
    let (displacement, multiplier, gain) = image(material.unknown_param.get("disp"));
    let unsaid = MaterialSource::default();
    let [r, g, b] = material.diffuse.unwrap_or([1.0; 3]);
    MaterialSource {
        name: material.name.clone(),
        albedo,
        normal,
        bump,
        displacement,
        albedo_factor: [r, g, b, material.dissolve.unwrap_or(1.0)],
        specular: material.specular.map_or(unsaid.specular, |s| s.into_iter().fold(0.0, f32::max).min(1.0)),
        shininess: material.shininess.map_or(unsaid.shininess, |s| s.clamp(1.0, 10_000.0)),
        bump_scale: bump_scale.unwrap_or(1.0),
        displacement_scale: gain.or(multiplier).unwrap_or(1.0),
        normal_scale: normal_scale.unwrap_or(1.0),
    }
}
