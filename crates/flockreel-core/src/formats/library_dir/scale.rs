//! scale.json: the scale of a library folder, set by `flockreel scale` (docs/reference/formats.md, "Motion").
//! The service has the scale in its database instead.

use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Error, SCALE};
use crate::library::Scale;

const SCHEMA: &str = "flockreel/scale@1";

#[derive(Serialize, Deserialize)]
struct ScaleFile {
    schema: String,
    px_per_cm: f64,
}

/// Returns the scale of a library folder; `None` if it has none. Fails if scale.json is damaged or out of range.
pub fn read_scale(dir: &Path) -> Result<Option<Scale>, Error> {
    let bytes = match fs::read(dir.join(SCALE)) {
        Err(cause) if cause.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(cause) => return Err(Error::Io { file: SCALE, cause }),
        Ok(bytes) => bytes,
    };
    let file: ScaleFile =
        serde_json::from_slice(&bytes).map_err(|cause| Error::Json { file: SCALE, cause })?;
    let scale = Scale::new(file.px_per_cm);
    let scale = scale.map_err(|_out_of_range| Error::OutOfRange("px_per_cm of scale.json"))?;
    Ok(Some(scale))
}

/// Writes the scale of a library folder, or removes it.
pub fn write_scale(dir: &Path, scale: Option<Scale>) -> Result<(), Error> {
    let path = dir.join(SCALE);
    let written = match scale {
        Some(scale) => {
            let file = ScaleFile {
                schema: SCHEMA.into(),
                px_per_cm: scale.px_per_cm(),
            };
            fs::write(
                path,
                serde_json::to_vec(&file).expect("plain values serialise"),
            )
        }
        None => match fs::remove_file(path) {
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(()),
            removed => removed,
        },
    };
    written.map_err(|cause| Error::Io { file: SCALE, cause })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_is_read_as_written_and_can_be_removed() {
        let dir = tempfile::tempdir().expect("a folder");
        assert!(matches!(read_scale(dir.path()), Ok(None)));
        for px_per_cm in [42.0, 1.0 / 3.0] {
            let scale = Scale::new(px_per_cm).ok();
            write_scale(dir.path(), scale).expect("written");
            assert_eq!(read_scale(dir.path()).expect("readable"), scale);
        }
        for _ in 0..2 {
            write_scale(dir.path(), None).expect("removed");
            assert!(matches!(read_scale(dir.path()), Ok(None)));
        }
    }

    #[test]
    fn damaged_scales_are_refused() {
        let dir = tempfile::tempdir().expect("a folder");
        for text in ["", "{}", "{\"schema\":\"\",\"px_per_cm\":0}"] {
            fs::write(dir.path().join(SCALE), text).expect("written");
            assert!(read_scale(dir.path()).is_err(), "{text}");
        }
    }
}
