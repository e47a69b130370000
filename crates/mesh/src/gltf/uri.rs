//! URIs of buffers and images: data URIs and files beside the asset.

use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

/// Padding is required by the standard and often left out.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// What a URI points to.
#[derive(Debug, PartialEq)]
pub(super) enum Target {
    /// The bytes of a data URI.
    Data(Vec<u8>),
    /// A path relative to the asset's folder that does not leave it.
    File(PathBuf),
}

/// Resolves a URI; the error is a phrase that says what is wrong with it.
pub(super) fn resolve(uri: &str) -> Result<Target, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, payload) = data.split_once(',').ok_or("data URI without a comma")?;
        if !kind.ends_with(";base64") {
            return Err(format!("data URI of kind {kind:?}; base64 expected"));
        }
        return BASE64.decode(payload).map(Target::Data).map_err(|e| format!("data URI: {e}"));
    }
    let scheme = uri.split(['/', '\\', '?', '#']).next().unwrap_or("");
    if let Some((scheme, _)) = scheme.split_once(':') {
        return Err(format!("URI scheme {scheme:?}; a relative file name or a data URI expected"));
    }
    inside(&percent_decoded(uri)?.replace('\\', "/")).map(Target::File)
}

/// A relative path, made sure not to leave the folder it is relative to.
fn inside(text: &str) -> Result<PathBuf, String> {
    if text.is_empty() || text.contains('\0') {
        return Err(format!("file name {text:?}"));
    }
    let mut path = PathBuf::new();
    for component in Path::new(text).components() {
        match component {
            Component::Normal(part) => path.push(part),
            Component::CurDir => {}
            Component::ParentDir if path.pop() => {}
            _ => return Err(format!("{text:?} leaves the folder of the asset")),
        }
    }
    Ok(path)
}

fn percent_decoded(text: &str) -> Result<String, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let escaped = (first == b'%')
            .then(|| tail.get(..2).and_then(|hex| std::str::from_utf8(hex).ok()))
            .flatten()
            .filter(|hex| hex.bytes().all(|b| b.is_ascii_hexdigit()))
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        // A bare percent sign is taken as it stands: file names written unescaped are common.
        bytes.push(escaped.unwrap_or(first));
        rest = if escaped.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8(bytes).map_err(|_| format!("{text:?} is not UTF-8 once decoded"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_names_are_decoded() {
        assert_eq!(resolve("a%20b/c%25.bin"), Ok(Target::File("a b/c%.bin".into())));
        assert_eq!(resolve("100%.bin"), Ok(Target::File("100%.bin".into())));
        assert_eq!(resolve("./a/../b.bin"), Ok(Target::File("b.bin".into())));
        assert_eq!(resolve("tex\\b.png"), Ok(Target::File("tex/b.png".into())));
    }

    #[test]
    fn nothing_leaves_the_folder() {
        for uri in [
            "../x",
            "a/../../x",
            "/etc/passwd",
            "%2e%2e/x",
            "..%2fx",
            "\\x",
            "..\\x",
            "",
            "a%00b",
            "%ff",
            "http://a/b",
            "file:///etc/passwd",
            "C:\\x",
            "data:,x",
            "data:x",
            "data:;base64,!",
        ] {
            assert!(resolve(uri).is_err(), "{uri:?}: {:?}", resolve(uri));
        }
    }

    #[test]
    fn data_uris_need_no_padding() {
        assert_eq!(resolve("data:;base64,AAE"), Ok(Target::Data(vec![0, 1])));
        assert_eq!(resolve("data:application/octet-stream;base64,AAE="), Ok(Target::Data(vec![0, 1])));
    }
}
