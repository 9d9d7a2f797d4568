//! Names under which browsers save files (RFC 6266): the name of the footage, then the result, then the file.

use std::path::Path;

use super::disposition;

/// Longest part of a footage's name, characters. Free choice.
const MAX_STEM: usize = 60;

/// Returns the name of footage without its extension and with `-` for spaces; `film` for an empty one.
pub(in crate::api) fn stem(footage: &str) -> String {
    let stem = Path::new(footage).file_stem().unwrap_or_default();
    let words = stem.to_string_lossy();
    let words: Vec<&str> = words.split_whitespace().collect();
    let stem: String = words.join("-").chars().take(MAX_STEM).collect();
    if stem.is_empty() {
        "film".to_owned()
    } else {
        stem
    }
}

/// Returns the value of Content-Disposition of a file. Browsers save what they cannot show.
pub(in crate::api) fn saved_as(media_type: &str, name: &str) -> String {
    let kind = match media_type {
        "application/zip" | "application/octet-stream" | "video/quicktime" => "attachment",
        _ => "inline",
    };
    disposition(kind, name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stem_has_no_extension_and_no_spaces() {
        for (name, expected) in [
            ("zebra finch.mp4", "zebra-finch"),
            ("魚の動画 🐟.mp4", "魚の動画-🐟"),
            ("two.dots.avi", "two.dots"),
            (".mp4", ".mp4"),
            ("", "film"),
            (" ", "film"),
            ("..", "film"),
        ] {
            assert_eq!(stem(name), expected, "{name}");
        }
    }
}
