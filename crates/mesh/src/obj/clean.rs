//! Checks an OBJ line by line and rewrites it so that it can only be read one way.
//!
//! All vertex data comes first, then the faces, as triangles, every corner with absolute `v/vt/vn`.
//! Corners without UV or normal point to a zero entry put in front of each list.

use std::fmt::Write;

use glam::DVec3;

use super::polygon::{EAR_TESTS, triangulate};
use super::text::{for_each_line, keyword, short};
use crate::error::MeshError;
use crate::limits::{self, check_elements};

/// An OBJ in regular form.
pub(super) struct Cleaned {
    /// The text. Names no library but one, `all`, on its first line.
    pub text: String,
    /// What the `mtllib` lines say, in order.
    pub libraries: Vec<String>,
    /// First of the two triangles of each quad: `abc` of `abc` and `acd`.
    pub quads: Vec<u32>,
}

struct Cleaner<'a> {
    name: &'a str,
    data: String,
    faces: String,
    libraries: Vec<String>,
    positions: Vec<DVec3>,
    uvs: usize,
    normals: usize,
    /// Highest index into each list and the line it stands on. Faces may come before what they use,
    /// so these are checked at the end.
    highest: [Option<(u32, usize)>; 3],
    corners: Vec<[u32; 3]>,
    items: Vec<Item>,
    triangles: usize,
    left_out: usize,
    bad_uvs: usize,
    without_uv: usize,
}

/// A line of grouping, or a face of so many of the collected corners.
enum Item {
    Group(String),
    Face(usize),
}

/// Checks and rewrites; the error names the line.
pub(super) fn clean(text: &str, name: &str, warnings: &mut Vec<String>) -> Result<Cleaned, MeshError> {
    let mut cleaner = Cleaner {
        name,
        data: String::with_capacity(text.len()),
        faces: String::new(),
        libraries: Vec::new(),
        positions: Vec::new(),
        uvs: 0,
        normals: 0,
        highest: [None; 3],
        corners: Vec::new(),
        items: Vec::new(),
        triangles: 0,
        left_out: 0,
        bad_uvs: 0,
        without_uv: 0,
    };
    cleaner.data.push_str("mtllib all\nvt 0 0\nvn 0 0 0\n");
    for_each_line(text, |number, line| cleaner.line(number, line))?;
    cleaner.check_highest()?;
    let quads = cleaner.write();
    cleaner.warn(warnings);
    let mut text = cleaner.data;
    text.push_str(&cleaner.faces);
    Ok(Cleaned { text, libraries: cleaner.libraries, quads })
}

impl Cleaner<'_> {
    fn fail(&self, number: usize, problem: impl std::fmt::Display) -> MeshError {
        MeshError::malformed(self.name, format!("OBJ line {number}: {problem}"))
    }

    fn line(&mut self, number: usize, line: &str) -> Result<(), MeshError> {
        let (key, rest) = keyword(line);
        match key {
            "v" => self.position(number, rest)?,
            "vt" => {
                let [u, v, _] = self.numbers(number, rest, 1)?;
                let finite = u.is_finite() && v.is_finite();
                self.bad_uvs += usize::from(!finite);
                self.uvs += 1;
                // `v` may be left out.
                self.copy("vt", if finite { [rest, "0"] } else { ["0 0", ""] }, 2);
            }
            "vn" => {
                let [x, y, z] = self.numbers(number, rest, 3)?;
                self.normals += 1;
                // Exporters write NaN normals for faces without area; those are made anew.
                let finite = x.is_finite() && y.is_finite() && z.is_finite();
                self.copy("vn", [if finite { rest } else { "0 0 0" }, ""], 3);
            }
            "f" | "fo" => self.face(number, rest)?,
            "p" | "l" => self.left_out += 1,
            "o" | "g" | "usemtl" if !rest.is_empty() || key != "usemtl" => {
                self.items.push(Item::Group(format!("{key} {}\n", limits::name(rest).trim_end())));
            }
            "mtllib" => self.libraries.push(rest.to_owned()),
            _ => {}
        }
        Ok(())
    }

    /// Up to three numbers, at least `needed`; missing ones are zero, further ones are ignored.
    fn numbers(&self, number: usize, rest: &str, needed: usize) -> Result<[f32; 3], MeshError> {
        let mut found = [0.0; 3];
        let mut count = 0;
        for (slot, word) in found.iter_mut().zip(rest.split_whitespace()) {
            *slot = word
                .parse::<f32>()
                .or_else(|e| if word.to_ascii_lowercase().contains("nan") { Ok(f32::NAN) } else { Err(e) })
                .map_err(|_| self.fail(number, format!("{:?} is not a number", short(word))))?;
            count += 1;
        }
        if count < needed {
            return Err(self.fail(number, format!("{count} numbers, at least {needed} expected")));
        }
        Ok(found)
    }

    /// Writes a line of `count` words, which have been read before: writing numbers anew is slow.
    fn copy(&mut self, key: &str, from: [&str; 2], count: usize) {
        self.data.push_str(key);
        for word in from.into_iter().flat_map(str::split_whitespace).take(count) {
            self.data.push(' ');
            self.data.push_str(word);
        }
        self.data.push('\n');
    }

    fn position(&mut self, number: usize, rest: &str) -> Result<(), MeshError> {
        let mut point = DVec3::from(self.numbers(number, rest, 3)?.map(f64::from));
        // A fourth number alone is a weight; from five on, the others are a colour.
        let mut further = rest.split_whitespace().skip(3);
        let weight = further.next().filter(|_| further.next().is_none());
        if let Some(weight) = weight {
            point /= weight.parse::<f64>().unwrap_or(f64::NAN);
        }
        let point = point.as_vec3();
        if !point.is_finite() {
            return Err(self.fail(number, format!("position {:?} is not finite", short(rest))));
        }
        self.positions.push(point.as_dvec3());
        check_elements("OBJ positions", self.positions.len())?;
        if weight.is_some() {
            let _ = writeln!(self.data, "v {} {} {}", point.x, point.y, point.z);
        } else {
            self.copy("v", [rest, ""], 3);
        }
        Ok(())
    }

    fn face(&mut self, number: usize, rest: &str) -> Result<(), MeshError> {
        let counts = [self.positions.len(), self.uvs, self.normals];
        let first = self.corners.len();
        for word in rest.split_whitespace() {
            let mut corner = [0u32; 3];
            for (i, text) in word.split('/').enumerate() {
                let bad = |what: &str| self.fail(number, format!("corner {:?} {what}", short(word)));
                let Some(slot) = corner.get_mut(i) else { return Err(bad("has more than three indices")) };
                if text.is_empty() && i > 0 {
                    continue;
                }
                let index: i64 = text.parse().map_err(|_| bad("is not v, v/vt, v//vn or v/vt/vn"))?;
                *slot = match index {
                    0 => return Err(bad("has index 0; OBJ counts from 1")),
                    1.. => u32::try_from(index).map_err(|_| bad("has a senseless index"))?,
                    // Counted back from the latest.
                    ..0 => (counts[i] as i64 + 1)
                        .checked_add(index)
                        .and_then(|at| u32::try_from(at).ok())
                        .filter(|&at| at > 0)
                        .ok_or_else(|| bad(&format!("counts back beyond the first of {}", counts[i])))?,
                };
                if self.highest[i].is_none_or(|(most, _)| *slot > most) {
                    self.highest[i] = Some((*slot, number));
                }
            }
            self.corners.push(corner);
        }
        let count = self.corners.len() - first;
        if count < 3 {
            self.corners.truncate(first);
            self.left_out += 1;
            return Ok(());
        }
        self.triangles += count - 2;
        check_elements("OBJ triangles", self.triangles)?;
        self.items.push(Item::Face(count));
        Ok(())
    }

    fn check_highest(&self) -> Result<(), MeshError> {
        let lists = [
            ("positions", self.positions.len()),
            ("texture coordinates", self.uvs),
            ("normals", self.normals),
        ];
        for ((what, count), highest) in lists.into_iter().zip(self.highest) {
            if let Some((index, number)) = highest.filter(|(index, _)| *index as usize > count) {
                return Err(self.fail(number, format!("index {index}, but there are {count} {what}")));
            }
        }
        Ok(())
    }

    /// Writes groups and faces, once every index is known to be good. Returns where the quads are.
    fn write(&mut self) -> Vec<u32> {
        let mut quads = Vec::new();
        let mut written = 0;
        let mut rest = self.corners.as_slice();
        let mut tests = EAR_TESTS;
        for item in &self.items {
            let count = match item {
                Item::Group(line) => {
                    self.faces.push_str(line);
                    continue;
                }
                Item::Face(count) => *count,
            };
            let (corners, after) = rest.split_at(count);
            rest = after;
            self.without_uv += usize::from(corners.iter().any(|c| c[1] == 0));
            if count == 4 {
                quads.push(written);
            }
            written += count as u32 - 2;
            let corner = |i: usize| corners[i];
            if count == 3 {
                write_triangle(&mut self.faces, [0, 1, 2].map(corner));
                continue;
            }
            let outline: Vec<DVec3> = corners.iter().map(|c| self.positions[c[0] as usize - 1]).collect();
            for triangle in triangulate(&outline, &mut tests) {
                write_triangle(&mut self.faces, triangle.map(corner));
            }
        }
        quads
    }

    fn warn(&self, warnings: &mut Vec<String>) {
        if self.left_out > 0 {
            warnings.push(format!("{} points and lines are left out", self.left_out));
        }
        if self.bad_uvs > 0 {
            warnings.push(format!("{} texture coordinates are not finite; set to 0", self.bad_uvs));
        }
        if self.without_uv > 0 {
            warnings.push(format!("{} faces have no texture coordinates; set to 0", self.without_uv));
        }
    }
}

fn write_triangle(out: &mut String, corners: [[u32; 3]; 3]) {
    // UVs and normals count from one past the zero entries in front.
    let [[a, s, l], [b, t, m], [c, u, n]] = corners.map(|[v, vt, vn]| [v, vt + 1, vn + 1]);
    let _ = writeln!(out, "f {a}/{s}/{l} {b}/{t}/{m} {c}/{u}/{n}");
}
