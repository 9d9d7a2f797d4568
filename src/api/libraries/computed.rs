//! Files of a library that are not stored, but computed for each request: the distances of its clips, and its
//! motion in centimetres, which follows from its poses and its scale.

use axum::body::{Body, Bytes};
use axum::http::header;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use tokio_util::io::ReaderStream;
use utoipa::IntoParams;

use super::saved_name;
use crate::api::download::built;
use crate::api::download::computed::{is_known, not_modified, tagged, with_type};
use crate::api::extract::{Access, Conditions};
use crate::api::problem::{Answer, Problem};
use crate::api::stored;
use crate::jobs::analysis::Summary;
use crate::jobs::{self, synchronous};
use crate::store::blobs::hex;
use crate::store::resources::Library;
use flockreel_core::code::Code;
use flockreel_core::formats::csv::motion::{self, Film};
use flockreel_core::library::{Scale, Zones};

/// Name of the file with the distances.
const DISTANCE_ARRAY: &str = "distance.npy";

/// Writes a file from a film, the id of its library, and zones.
type WriteMotion = fn(&str, Film<'_>, &Zones) -> String;

/// Query of a request for a summary.
#[derive(Debug, Default, Deserialize, IntoParams)]
pub(in crate::api) struct Zoned {
    /// Of `summary.csv` and `summary.json`: parts of the picture, separated by `;`. Each is `NAME:rect:X,Y,W,H` or
    /// `NAME:ellipse:X,Y,W,H` in pixels, such as `center:ellipse:80,60,160,120`.
    #[param(required = false)]
    zones: Option<String>,
}

/// Files that depend on the scale of the library: name, media type and writer.
const MOTION_FILES: [(&str, &str, WriteMotion); 4] = [
    ("motion.csv", CSV, |_, film, _| film.motion_csv()),
    ("motion.json", JSON, |_, film, _| film.motion_json()),
    ("summary.csv", CSV, |id, film, zones| {
        motion::write_summaries(&[(id, film)], zones)
    }),
    ("summary.json", JSON, |_, film, zones| {
        film.summary_json(zones)
    }),
];
const CSV: &str = "text/csv; charset=utf-8";
const JSON: &str = "application/json";

/// Returns whether a file is computed for each request.
pub(super) fn is_computed(name: &str) -> bool {
    name == DISTANCE_ARRAY || MOTION_FILES.iter().any(|(known, ..)| *known == name)
}

/// Returns the response to a request for a computed file, which is sent whole.
pub(super) async fn computed(
    access: &Access,
    library: &Library,
    name: &str,
    zoned: Zoned,
    conditions: &Conditions,
) -> Answer {
    match MOTION_FILES.iter().find(|(known, ..)| *known == name) {
        Some(file) => motion_file(access, library, *file, zoned, conditions).await,
        None => distance_array(access, library, conditions).await,
    }
}

/// Returns the scale of a library. The database accepts no other numbers than a scale may have.
pub(super) fn scale_of(library: &Library) -> Option<Scale> {
    library
        .px_per_cm
        .and_then(|px_per_cm| Scale::new(px_per_cm).ok())
}

/// Returns the length of the animal in the picture, pixels.
pub(super) fn length_px(library: &Library) -> Result<Option<f64>, Problem> {
    Ok(stored::<Summary>(&library.summary)?.length_px)
}

/// Returns a file that depends on the scale. Its ETag is the SHA-256 of its content, so it changes with the scale, and
/// clients ask for it again.
async fn motion_file(
    access: &Access,
    library: &Library,
    (name, media_type, write): (&str, &'static str, WriteMotion),
    zoned: Zoned,
    conditions: &Conditions,
) -> Answer {
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let (id, scale) = (library.id.to_string(), scale_of(library));
    let length_px = length_px(library)?;
    let zones = zoned.zones.as_deref().unwrap_or_default().parse::<Zones>();
    let zones = zones.map_err(|error| Problem::new(Code::InvalidParams, error.to_string()))?;
    let text = synchronous::from_poses(context, owner, library, move |poses| {
        let film = Film {
            poses,
            length_px,
            scale,
        };
        write(&id, film, &zones)
    });
    let text = text.await?;
    let etag = format!("\"{}\"", hex(&Sha256::digest(&text)));
    let answer = tagged(&etag, "private, no-cache");
    if is_known(conditions, &etag) {
        return not_modified(answer);
    }
    let answer = with_type(answer, media_type, &saved_name(library, name));
    let body = Bytes::from(text);
    built(
        answer
            .header(header::CONTENT_LENGTH, body.len())
            .body(body.into()),
    )
}

/// Returns distance.npy. The library's files never change, so clients may cache the result forever.
async fn distance_array(access: &Access, library: &Library, conditions: &Conditions) -> Answer {
    let etag = format!("\"{}-{DISTANCE_ARRAY}\"", library.id);
    let answer = tagged(&etag, "private, max-age=31536000, immutable");
    if is_known(conditions, &etag) {
        return not_modified(answer);
    }
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let file = synchronous::distance_file(context, owner, library).await?;
    let n_bytes = file.metadata().map_err(jobs::Error::Io)?.len();
    let file = ReaderStream::new(tokio::fs::File::from_std(file));
    let name = saved_name(library, DISTANCE_ARRAY);
    let answer = with_type(answer, "application/octet-stream", &name);
    let answer = answer.header(header::CONTENT_LENGTH, n_bytes);
    built(answer.body(Body::from_stream(file)))
}
