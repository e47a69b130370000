//! Images: found, never decoded.

use std::collections::HashMap;

use super::buffers::Buffers;
use super::uri::{self, Target};
use crate::limits::MAX_IMAGE_BYTES;
use crate::material::ImageSource;

/// The image sources in use, read once each.
#[derive(Default)]
pub(super) struct Images {
    found: HashMap<usize, Option<ImageSource>>,
    /// Bytes copied so far: many images may name one large view.
    spent: u64,
}

impl Images {
    /// The image of texture `texture`; `None`, with a warning, when there is none to be had.
    pub fn read(
        &mut self,
        buffers: &Buffers<'_>,
        texture: usize,
        warnings: &mut Vec<String>,
    ) -> Option<ImageSource> {
        let Some(index) = source(buffers, texture) else {
            warnings.push(format!("texture {texture} has no image that can be read"));
            return None;
        };
        if let Some(known) = self.found.get(&index) {
            return known.clone();
        }
        let image = find(buffers, index, MAX_IMAGE_BYTES - self.spent)
            .inspect_err(|problem| warnings.push(format!("image {index}: {problem}")))
            .ok();
        if let Some(ImageSource::Encoded(bytes)) = &image {
            self.spent += bytes.len() as u64;
        }
        self.found.insert(index, image.clone());
        image
    }
}

/// The image index of a texture: the plain one, else the WebP one.
fn source(buffers: &Buffers<'_>, texture: usize) -> Option<usize> {
    let texture = buffers.root.textures.get(texture)?;
    let plain = texture.source.value();
    if plain < buffers.root.images.len() {
        return Some(plain);
    }
    let webp = texture.extensions.as_ref()?.others.get("EXT_texture_webp")?;
    webp.get("source")?.as_u64().and_then(|index| usize::try_from(index).ok())
}

/// Finds an image of at most `limit` bytes.
fn find(buffers: &Buffers<'_>, index: usize, limit: u64) -> Result<ImageSource, String> {
    let fits = |bytes: &[u8]| match bytes.len() as u64 <= limit {
        true => Ok(()),
        false => Err(format!("images inside the file take more than {MAX_IMAGE_BYTES} bytes")),
    };
    let image = buffers.root.images.get(index).ok_or("no such image")?;
    if let Some(view) = image.buffer_view {
        let view = buffers.view(view.value()).map_err(|error| error.to_string())?;
        fits(view.bytes)?;
        return Ok(ImageSource::Encoded(view.bytes.into()));
    }
    let uri = image.uri.as_deref().ok_or("neither a URI nor a buffer view")?;
    match uri::resolve(uri)? {
        Target::Data(bytes) => {
            fits(&bytes)?;
            Ok(ImageSource::Encoded(bytes.into()))
        }
        Target::File(relative) => {
            let path = buffers.file(&relative)?;
            if path.is_file() {
                Ok(ImageSource::File(path))
            } else {
                Err(format!("{} not found", path.display()))
            }
        }
    }
}
