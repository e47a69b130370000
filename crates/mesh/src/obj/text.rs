//! From bytes to lines: encodings, line ends, continuations, comments.

use std::borrow::Cow;

/// The text of an OBJ or MTL file. UTF-16 is recognised by its byte order mark; bytes that are not
/// UTF-8 become replacement characters, which only names can contain.
pub(super) fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, String> {
    let utf16 = |make: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|pair| make([pair[0], pair[1]]));
        let text: String =
            char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
        Cow::Owned(text)
    };
    let text = if bytes.starts_with(b"\xff\xfe") {
        utf16(u16::from_le_bytes)
    } else if bytes.starts_with(b"\xfe\xff") {
        utf16(u16::from_be_bytes)
    } else {
        String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
    };
    match text.find('\0') {
        Some(at) => Err(format!("not a text file: zero byte at character {at}")),
        None => Ok(text),
    }
}

/// Calls `each` with line number (from 1) and content of every line that is not empty: comments
/// dropped, lines that end in a backslash joined with the next, white space trimmed.
pub(super) fn for_each_line<E>(
    text: &str,
    mut each: impl FnMut(usize, &str) -> Result<(), E>,
) -> Result<(), E> {
    let mut joined = String::new();
    let mut start = 0;
    // A lone carriage return ends a line too; with CR LF it leaves an empty line behind, unharmful
    // but for the count, so those pairs are kept together.
    for (number, line) in text.split('\n').enumerate() {
        for line in line.strip_suffix('\r').unwrap_or(line).split('\r') {
            let line = without_comment(line).trim();
            if joined.is_empty() {
                start = number + 1;
            }
            if let Some(part) = line.strip_suffix('\\') {
                joined.push_str(part);
                joined.push(' ');
                continue;
            }
            if joined.is_empty() {
                if !line.is_empty() {
                    each(start, line)?;
                }
            } else {
                joined.push_str(line);
                each(start, joined.trim())?;
                joined.clear();
            }
        }
    }
    if joined.trim().is_empty() { Ok(()) } else { each(start, joined.trim()) }
}

/// The line up to a `#` that starts a word: names may contain one.
fn without_comment(line: &str) -> &str {
    let starts_word = |at: usize| line[..at].chars().next_back().is_none_or(char::is_whitespace);
    line.match_indices('#').find(|&(at, _)| starts_word(at)).map_or(line, |(at, _)| &line[..at])
}

/// At most 40 characters of a text, for messages.
pub(super) fn short(text: &str) -> String {
    match text.char_indices().nth(40) {
        Some((at, _)) => format!("{}...", &text[..at]),
        None => text.to_owned(),
    }
}

/// Keyword and the rest, trimmed.
pub(super) fn keyword(line: &str) -> (&str, &str) {
    match line.split_once(char::is_whitespace) {
        Some((key, rest)) => (key, rest.trim()),
        None => (line, ""),
    }
}
