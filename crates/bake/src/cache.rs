//! Baked maps kept on disk, so that an unchanged map is never baked twice.
//!
//! The name of an entry is the BLAKE3 hash of everything the map depends on: the heights, what lies
//! beyond the edge, the extent, the map, its version and its options. An entry ends with the hash of
//! its own bytes; one that is damaged is thrown away and baked anew. Entries are renamed into place
//! when complete, so any number of processes may share a folder. The folder is bounded: the entries
//! that were not used for longest go first. Nothing else in it is touched, and a folder that cannot
//! be used only costs the time of a bake.
//!
//! `BUMPWGPU_CACHE` names another folder; empty, `0` or `off` switch the cache off.

use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use heightfield::{HeightField, Wrap};

use crate::maps::{Baked, Grid, Layer, Map, Options, Plan, bake};
use crate::{BakeError, Progress};

/// First bytes of an entry; the digit is the version of the layout.
const MAGIC: &[u8; 8] = b"bwmap\x00v1";
/// Most bytes that all entries of the default folder take together.
const LIMIT: u64 = 2 << 30;
/// Suffix of an entry.
const SUFFIX: &str = "bwmap";
/// Age from which a temporary file belongs to a process that has died.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A folder of baked maps.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
    limit: u64,
}

impl Cache {
    /// A cache in a folder, which is made when needed, of at most `limit` bytes.
    pub fn new(folder: impl Into<PathBuf>, limit: u64) -> Self {
        Self { folder: folder.into(), limit }
    }

    /// The cache of this user, or the one that `BUMPWGPU_CACHE` names; `None` when it is off.
    pub fn of_environment() -> Option<Self> {
        folder_of_environment(&|name| env::var_os(name)).map(|folder| Self::new(folder, LIMIT))
    }

    /// Where it is.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// A map out of the cache, or baked and put there.
    ///
    /// # Errors
    /// See [`bake`]; never because of the cache.
    pub fn bake(
        &self,
        field: &HeightField,
        map: &'static Map,
        options: &Options,
        mut progress: Progress<'_>,
    ) -> Result<Baked, BakeError> {
        let plan = (map.plan)(Grid::of(field), options);
        let path = self.folder.join(format!("{}.{SUFFIX}", key(field, map, options)));
        if let Some(layers) = read(&path, &plan, map.info.channels.len()) {
            progress.report(field.height(), field.height())?;
            return Ok(Baked { info: &map.info, options: options.clone(), layers });
        }
        let baked = bake(field, map, options, progress)?;
        // A full disk or a folder of somebody else's is no reason to fail.
        if self.store(&path, &baked).is_ok() {
            self.trim(&path);
        }
        Ok(baked)
    }

    fn store(&self, path: &Path, baked: &Baked) -> std::io::Result<()> {
        let bytes: usize = baked.layers.iter().map(|layer| size_of_val(&layer.texels[..])).sum();
        if bytes as u64 > self.limit / 2 {
            return Ok(());
        }
        fs::create_dir_all(&self.folder)?;
        let temporary = tempfile::Builder::new().prefix(".").suffix(".part").tempfile_in(&self.folder)?;
        let mut hasher = blake3::Hasher::new();
        let mut file = temporary.as_file();
        let mut put = |bytes: &[u8]| {
            hasher.update_rayon(bytes);
            file.write_all(bytes)
        };
        put(MAGIC)?;
        put(&(baked.layers.len() as u64).to_ne_bytes())?;
        for layer in &baked.layers {
            for side in [layer.width, layer.height, layer.depth] {
                put(&(side as u64).to_ne_bytes())?;
            }
            put(bytemuck::cast_slice(&layer.texels))?;
        }
        let hash = hasher.finalize();
        file.write_all(hash.as_bytes())?;
        temporary.persist(path).map_err(|error| error.error)?;
        Ok(())
    }

    /// Removes the entries used least recently, but not `newest`, until the rest fits.
    fn trim(&self, newest: &Path) {
        let Ok(folder) = fs::read_dir(&self.folder) else { return };
        let now = SystemTime::now();
        let mut entries = Vec::new();
        for entry in folder.flatten() {
            let path = entry.path();
            let Ok(data) = entry.metadata() else { continue };
            let used = data.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            match path.extension().and_then(|suffix| suffix.to_str()) {
                Some(SUFFIX) => entries.push((used, data.len(), path)),
                Some("part") if now.duration_since(used).is_ok_and(|age| age > ABANDONED) => {
                    let _ = fs::remove_file(path);
                }
                _ => {}
            }
        }
        let mut total: u64 = entries.iter().map(|entry| entry.1).sum();
        entries.sort();
        for (_, bytes, path) in entries {
            if total <= self.limit {
                break;
            }
            // Another process may have been quicker.
            if path != newest && fs::remove_file(&path).is_ok() {
                total -= bytes;
            }
        }
    }
}

/// Bakes a map; one whose bake is [costly](crate::MapInfo::costly) comes out of the user's cache when
/// it is there, and is put there when it is not.
///
/// # Errors
/// See [`bake`].
pub fn bake_cached(
    field: &HeightField,
    map: &'static Map,
    options: &Options,
    progress: Progress<'_>,
) -> Result<Baked, BakeError> {
    match Cache::of_environment().filter(|_| map.info.costly) {
        Some(cache) => cache.bake(field, map, options, progress),
        None => bake(field, map, options, progress),
    }
}

fn folder_of_environment(get: &dyn Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let set = |name: &str| get(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    if let Some(value) = get("BUMPWGPU_CACHE") {
        let off = value.is_empty() || value == "0" || value.eq_ignore_ascii_case("off");
        return (!off).then(|| PathBuf::from(value));
    }
    if cfg!(windows) {
        return set("LOCALAPPDATA").map(|folder| folder.join("bumpwgpu").join("cache"));
    }
    if cfg!(target_os = "macos") {
        return set("HOME").map(|home| home.join("Library/Caches/bumpwgpu"));
    }
    let folder = set("XDG_CACHE_HOME").filter(|folder| folder.is_absolute());
    folder.or_else(|| set("HOME").map(|home| home.join(".cache"))).map(|folder| folder.join("bumpwgpu"))
}

/// The name of an entry.
fn key(field: &HeightField, map: &Map, options: &Options) -> String {
    let mut hasher = blake3::Hasher::new();
    let mut text = |text: &str| {
        hasher.update(&(text.len() as u64).to_ne_bytes());
        hasher.update(text.as_bytes());
    };
    text(map.info.name);
    for (name, value) in options.iter() {
        text(name);
        text(&value.to_string());
    }
    let extent = field.extent();
    for number in [extent.scale, extent.base, extent.tile_size[0], extent.tile_size[1]] {
        hasher.update(&number.to_bits().to_ne_bytes());
    }
    let wrap = match field.wrap() {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    };
    for number in [u64::from(map.info.version), wrap, field.width() as u64, field.height() as u64] {
        hasher.update(&number.to_ne_bytes());
    }
    hasher.update_rayon(bytemuck::cast_slice(field.corners()));
    hasher.finalize().to_hex().to_string()
}

/// The layers of an entry that is whole and what `plan` expects, which makes it the one used last. A
/// damaged one is removed.
fn read(path: &Path, plan: &Plan, channels: usize) -> Option<Vec<Layer>> {
    let mut file = File::open(path).ok()?;
    let layers = read_layers(&mut file, plan, channels);
    if layers.is_none() {
        let _ = fs::remove_file(path);
    } else if let Ok(file) = File::options().append(true).open(path) {
        let _ = file.set_modified(SystemTime::now());
    }
    layers
}

fn read_layers(file: &mut File, plan: &Plan, channels: usize) -> Option<Vec<Layer>> {
    let head = MAGIC.len() + 8 + 24 * plan.layers.len();
    let expected = plan.bytes(channels) + head as u128 + 32;
    if u128::from(file.metadata().ok()?.len()) != expected {
        return None;
    }
    let mut hasher = blake3::Hasher::new();
    let mut magic = [0; MAGIC.len()];
    file.read_exact(&mut magic).ok()?;
    hasher.update(&magic);
    let number = |file: &mut File, hasher: &mut blake3::Hasher| {
        let mut bytes = [0; 8];
        file.read_exact(&mut bytes).ok()?;
        hasher.update(&bytes);
        usize::try_from(u64::from_ne_bytes(bytes)).ok()
    };
    if &magic != MAGIC || number(file, &mut hasher)? != plan.layers.len() {
        return None;
    }
    let mut layers = Vec::with_capacity(plan.layers.len());
    for &[width, height, depth] in &plan.layers {
        for side in [width, height, depth] {
            if number(file, &mut hasher)? != side {
                return None;
            }
        }
        let mut texels = vec![0.0_f32; width * height * depth * channels];
        file.read_exact(bytemuck::cast_slice_mut(&mut texels)).ok()?;
        hasher.update_rayon(bytemuck::cast_slice(&texels));
        layers.push(Layer { width, height, depth, texels });
    }
    let mut hash = [0; 32];
    file.read_exact(&mut hash).ok()?;
    (hasher.finalize() == hash).then_some(layers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_moves_it_or_switches_it_off() {
        let with = |pairs: &[(&str, &str)]| {
            folder_of_environment(&|name| {
                pairs.iter().find(|pair| pair.0 == name).map(|pair| OsString::from(pair.1))
            })
        };
        for off in ["", "0", "off", "OFF"] {
            assert_eq!(with(&[("BUMPWGPU_CACHE", off), ("HOME", "/home/a")]), None);
        }
        assert_eq!(with(&[("BUMPWGPU_CACHE", "/fast/maps")]), Some(PathBuf::from("/fast/maps")));
        assert_eq!(with(&[]), None);
        if cfg!(target_os = "linux") {
            assert_eq!(with(&[("HOME", "/home/a")]), Some(PathBuf::from("/home/a/.cache/bumpwgpu")));
            let moved = [("HOME", "/home/a"), ("XDG_CACHE_HOME", "/var/a")];
            assert_eq!(with(&moved), Some(PathBuf::from("/var/a/bumpwgpu")));
        }
    }
}
