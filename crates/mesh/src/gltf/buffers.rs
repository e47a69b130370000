//! Buffers and buffer views, loaded when first used.

use std::cell::{Cell, OnceCell};
use std::path::Path;

use gltf::json::{Root, Value};

use super::uri::{self, Target};
use crate::arrays::read_file;
use crate::error::MeshError;
use crate::limits::MAX_FILE_BYTES;

/// The file's JSON and the bytes it refers to.
pub(super) struct Buffers<'a> {
    pub root: &'a Root,
    pub folder: Option<&'a Path>,
    pub name: &'a str,
    binary: Option<&'a [u8]>,
    loaded: Vec<OnceCell<Vec<u8>>>,
    /// Bytes loaded so far: many buffers may name one large file.
    spent: Cell<u64>,
}

/// A checked range of a buffer.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub bytes: &'a [u8],
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    pub fn new(root: &'a Root, binary: Option<&'a [u8]>, folder: Option<&'a Path>, name: &'a str) -> Self {
        let loaded = root.buffers.iter().map(|_| OnceCell::new()).collect();
        Self { root, folder, name, binary, loaded, spent: Cell::new(0) }
    }

    pub fn fail(&self, problem: impl Into<String>) -> MeshError {
        MeshError::malformed(self.name, problem)
    }

    /// A file beside the asset.
    pub fn file(&self, relative: &Path) -> Result<std::path::PathBuf, String> {
        match self.folder {
            Some(folder) => Ok(folder.join(relative)),
            None => Err(format!("{} cannot be looked for: read from memory", relative.display())),
        }
    }

    /// The bytes of buffer view `index`.
    pub fn view(&self, index: usize) -> Result<View<'_>, MeshError> {
        let Some(view) = self.root.buffer_views.get(index) else {
            return Err(self.missing("buffer view", index, self.root.buffer_views.len()));
        };
        let compressed = |key: &str| {
            view.extensions.as_ref().is_some_and(|e| e.others.get(key).is_some_and(Value::is_object))
        };
        if let Some(key) =
            ["EXT_meshopt_compression", "KHR_meshopt_compression"].into_iter().find(|k| compressed(k))
        {
            return Err(MeshError::Unsupported {
                name: self.name.to_owned(),
                problem: format!("buffer view {index} uses {key}, which is not read"),
            });
        }
        let buffer = self.buffer(view.buffer.value())?;
        let start = view.byte_offset.map_or(0, |o| o.0);
        let bytes = usize::try_from(start)
            .ok()
            .zip(start.checked_add(view.byte_length.0).and_then(|end| usize::try_from(end).ok()))
            .and_then(|(start, end)| buffer.get(start..end));
        match bytes {
            Some(bytes) => Ok(View { bytes, stride: view.byte_stride.map(|s| s.0) }),
            None => Err(self.fail(format!(
                "buffer view {index} covers {} bytes from {start}, but buffer {} has {}",
                view.byte_length.0,
                view.buffer.value(),
                buffer.len()
            ))),
        }
    }

    fn buffer(&self, index: usize) -> Result<&[u8], MeshError> {
        let (Some(buffer), Some(slot)) = (self.root.buffers.get(index), self.loaded.get(index)) else {
            return Err(self.missing("buffer", index, self.root.buffers.len()));
        };
        let bytes = match (&buffer.uri, self.binary) {
            (None, Some(binary)) if index == 0 => binary,
            (None, _) => return Err(self.fail(format!("buffer {index} has neither a URI nor a GLB chunk"))),
            (Some(uri), _) => match slot.get() {
                Some(loaded) => loaded.as_slice(),
                None => {
                    let loaded = self.load(index, uri)?;
                    slot.get_or_init(|| loaded).as_slice()
                }
            },
        };
        let length = buffer.byte_length.0;
        usize::try_from(length).ok().and_then(|length| bytes.get(..length)).ok_or_else(|| {
            self.fail(format!("buffer {index} says {length} bytes, its data has {}", bytes.len()))
        })
    }

    fn load(&self, index: usize, uri: &str) -> Result<Vec<u8>, MeshError> {
        let fail = |problem: String| self.fail(format!("buffer {index}: {problem}"));
        let bytes = match uri::resolve(uri).map_err(fail)? {
            Target::Data(bytes) => bytes,
            Target::File(relative) => {
                let path = self.file(&relative).map_err(fail)?;
                let left = MAX_FILE_BYTES.saturating_sub(self.spent.get());
                read_file(&path, left).map_err(|error| fail(error.to_string()))?
            }
        };
        self.spent.set(self.spent.get() + bytes.len() as u64);
        Ok(bytes)
    }

    pub fn missing(&self, what: &str, index: usize, count: usize) -> MeshError {
        self.fail(format!("refers to {what} {index}, but there are {count}"))
    }
}
