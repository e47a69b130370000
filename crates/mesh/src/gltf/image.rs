//! Images: found, never decoded.

use std::collections::HashMap;

use super::buffers::Buffers;
use super::uri::{self, Target};
use crate::material::ImageSource;

/// The image sources in use, read once each.
#[derive(Default)]
pub(super) struct Images(HashMap<usize, Option<ImageSource>>);

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
        self.0
            .entry(index)
            .or_insert_with(|| match find(buffers, index) {
                Ok(image) => Some(image),
                Err(problem) => {
                    warnings.push(format!("image {index}: {problem}"));
                    None
                }
            })
            .clone()
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

fn find(buffers: &Buffers<'_>, index: usize) -> Result<ImageSource, String> {
    let image = buffers.root.images.get(index).ok_or("no such image")?;
    if let Some(view) = image.buffer_view {
        let view = buffers.view(view.value()).map_err(|error| error.to_string())?;
        return Ok(ImageSource::Encoded(view.bytes.into()));
    }
    let uri = image.uri.as_deref().ok_or("neither a URI nor a buffer view")?;
    match uri::resolve(uri)? {
        Target::Data(bytes) => Ok(ImageSource::Encoded(bytes.into())),
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
