//! The GLB container: a header and chunks, the first JSON, the second maybe binary.

use crate::error::MeshError;

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// The JSON text and, in a GLB, the binary chunk.
pub(super) fn split<'a>(bytes: &'a [u8], name: &str) -> Result<(&'a [u8], Option<&'a [u8]>), MeshError> {
    if !bytes.starts_with(b"glTF") {
        // The specification forbids a byte order mark; many writers put one all the same.
        return Ok((bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), None));
    }
    let fail = |problem: String| MeshError::malformed(name, format!("GLB: {problem}"));
    let (version, length) = match (word(bytes, 4), word(bytes, 8)) {
        (Some(version), Some(length)) => (version, length as usize),
        _ => return Err(fail(format!("header of {HEADER} bytes is cut off at {}", bytes.len()))),
    };
    if version != 2 {
        return Err(fail(format!("container version {version}; 2 is read")));
    }
    if length < HEADER || length > bytes.len() {
        return Err(fail(format!("header says {length} bytes, the file has {}", bytes.len())));
    }
    let mut rest = &bytes[HEADER..length];
    let json = chunk(&mut rest).map_err(fail)?;
    let json = match json {
        Some((b"JSON", data)) => data.strip_prefix(b"\xef\xbb\xbf").unwrap_or(data),
        Some((kind, _)) => return Err(fail(format!("first chunk is {:?}, not JSON", text(kind)))),
        None => return Err(fail("no JSON chunk".to_owned())),
    };
    // Chunks of unknown kind are to be ignored.
    match chunk(&mut rest).map_err(fail)? {
        Some((b"BIN\0", data)) => Ok((json, Some(data))),
        _ => Ok((json, None)),
    }
}

/// Kind and content.
type Chunk<'a> = (&'a [u8], &'a [u8]);

/// The next chunk, or `None` at the end.
fn chunk<'a>(rest: &mut &'a [u8]) -> Result<Option<Chunk<'a>>, String> {
    if rest.is_empty() {
        return Ok(None);
    }
    let Some(length) = word(rest, 0).filter(|_| rest.len() >= CHUNK_HEADER) else {
        return Err(format!("chunk header of {CHUNK_HEADER} bytes is cut off at {}", rest.len()));
    };
    let (header, body) = rest.split_at(CHUNK_HEADER);
    let Some(data) = body.get(..length as usize) else {
        return Err(format!("chunk {:?} says {length} bytes, {} are left", text(&header[4..]), body.len()));
    };
    *rest = &body[length as usize..];
    Ok(Some((&header[4..], data)))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes)
}

fn text(kind: &[u8]) -> String {
    String::from_utf8_lossy(kind).into_owned()
}
