//! What the structure of PNG, JPEG and WebP files tells beyond their pixels.

/// Chunks of a PNG file before its pixels: name and content.
fn png_chunks(bytes: &[u8]) -> impl Iterator<Item = (&[u8], &[u8])> {
    let mut rest = bytes.get(8..).unwrap_or_default();
    std::iter::from_fn(move || {
        let length = u32::from_be_bytes(rest.get(..4)?.try_into().ok()?) as usize;
        let name = rest.get(4..8)?;
        let content = rest.get(8..)?.get(..length)?;
        // Length, name, content, checksum.
        rest = rest.get(length.checked_add(12)?..)?;
        (name != b"IDAT").then_some((name, content))
    })
}

/// Width and height that a PNG file claims.
pub(super) fn png_size(bytes: &[u8]) -> Option<(u32, u32)> {
    let (_, header) = png_chunks(bytes).find(|(name, _)| *name == b"IHDR")?;
    let number = |at: usize| Some(u32::from_be_bytes(header.get(at..at + 4)?.try_into().ok()?));
    Some((number(0)?, number(4)?))
}

/// The first chunk of a PNG file that says its samples are not linear.
pub(super) fn png_colour_tag(bytes: &[u8]) -> Option<&'static str> {
    png_chunks(bytes).find_map(|(name, content)| match name {
        b"sRGB" => Some("sRGB"),
        b"iCCP" => Some("iCCP"),
        b"cICP" => Some("cICP"),
        // A gamma of 1 (100000) says linear.
        b"gAMA" if content != 100_000_u32.to_be_bytes() => Some("gAMA"),
        _ => None,
    })
}

/// Whether a JPEG file goes on to its end marker. Decoders fill in what is missing.
pub(super) fn jpeg_is_complete(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some(&marker) = bytes.get(at + 1) {
        if bytes[at] != 0xff {
            // Entropy-coded data, up to the next marker.
            at += 1;
            continue;
        }
        match marker {
            0xd9 => return true,
            // A fill byte.
            0xff => at += 1,
            // An escaped 0xff, restart markers and others without content.
            0x00 | 0x01 | 0xd0..=0xd8 => at += 2,
            _ => {
                let Some(length) = bytes.get(at + 2..at + 4) else { return false };
                at += 2 + usize::from(u16::from_be_bytes([length[0], length[1]])).max(2);
            }
        }
    }
    false
}

/// Whether a WebP file holds a lossy picture.
pub(super) fn webp_is_lossy(bytes: &[u8]) -> bool {
    let mut rest = bytes.get(12..).unwrap_or_default();
    while let (Some(name), Some(length)) = (rest.get(..4), rest.get(4..8)) {
        if name == b"VP8 " {
            return true;
        }
        let length = u32::from_le_bytes([length[0], length[1], length[2], length[3]]) as usize;
        // Chunks are padded to an even length.
        let Some(next) = length.checked_add(8 + length % 2).and_then(|next| rest.get(next..)) else { break };
        rest = next;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jpeg_ends_only_at_its_end_marker() {
        // The end marker inside a segment's content does not count.
        let whole = [
            0xff, 0xd8, 0xff, 0xe0, 0, 4, 0xff, 0xd9, 0xff, 0xda, 0, 2, 7, 0xff, 0, 0xff, 0xd0, 9, 0xff, 0xd9,
        ];
        assert!(jpeg_is_complete(&whole));
        for length in 0..whole.len() {
            assert!(!jpeg_is_complete(&whole[..length]), "{length}");
        }
    }

    #[test]
    fn linear_gamma_is_no_colour_tag() {
        let chunk = |name: &[u8; 4], content: &[u8]| {
            let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
            bytes.extend((content.len() as u32).to_be_bytes());
            bytes.extend(name);
            bytes.extend(content);
            bytes.extend([0; 4]);
            bytes
        };
        assert_eq!(png_colour_tag(&chunk(b"gAMA", &100_000_u32.to_be_bytes())), None);
        assert_eq!(png_colour_tag(&chunk(b"gAMA", &45_455_u32.to_be_bytes())), Some("gAMA"));
        assert_eq!(png_colour_tag(&chunk(b"sRGB", &[0])), Some("sRGB"));
        assert_eq!(png_colour_tag(&chunk(b"tEXt", b"sRGB")), None);
        assert_eq!(png_colour_tag(&[0xff; 30]), None);
    }
}
