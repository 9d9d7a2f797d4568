//! GET /v1/flocks/{id}/school.glb: every individual of a flock as a virtual animal, in one 3-D model. It is computed for
//! each request.

use axum::body::Bytes;
use axum::http::header;
use serde::Deserialize;
use utoipa::IntoParams;

use super::saved_name;
use crate::api::download::built;
use crate::api::download::computed::{is_known, not_modified, tagged, with_type};
use crate::api::extract::{Access, Conditions, Id, Query};
use crate::api::problem::{Answer, Problem, ProblemBody};
use crate::jobs::analysis::Summary as Measurement;
use crate::jobs::flock::Summary;
use crate::jobs::synchronous;
use crate::store::resources::{Flock, Library};
use flockreel_core::code::Code;
use flockreel_core::fish::{Body, Palette, Params};

const NAME: &str = "school.glb";
const MEDIA_TYPE: &str = "model/gltf-binary";

/// Largest product of individuals and frames of a school. Free choice, as for previews of flocks.
const MAX_POSTURES: u64 = 200_000;

/// Largest number of frames of a film whose own animal is made during a request. Others wait meanwhile. Free choice.
const MAX_FITTED_FRAMES: usize = 1200;

/// Query parameters of a school.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(in crate::api) struct SchoolQuery {
    /// Body of the virtual animals; `own` if absent.
    #[param(inline)]
    body: Option<Body>,
    /// Colors of goldfish; `goldfish` if absent.
    #[param(inline)]
    palette: Option<Palette>,
}

/// Download a flock as a school of virtual animals: one GLB file with one mesh and one animation of all.
///
/// Each individual moves where the flock shows it, as the virtual animal (`/v1/fish`) moves in the frame that it shows. The
/// file is computed for each request and sent whole. The number of individuals times `frames` is at most 200,000, else
/// the call fails with `invalid_params`. So does a school of the animal itself from a film of more than 1200 frames. It fails with `busy` if another computation does not end within 20 seconds, and
/// with `animal_too_small` if no frame shows the whole animal: `body=goldfish` needs none.
#[utoipa::path(get, path = "/v1/flocks/{id}/school.glb", params(("id" = Uuid, Path), SchoolQuery), responses(
    (status = 200, description = "the file", content_type = "model/gltf-binary"),
    (status = 304, description = "not modified"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_school(
    access: Access,
    Id(id): Id,
    Query(query): Query<SchoolQuery>,
    conditions: Conditions,
) -> Answer {
    let flock = access.find::<Flock>(id).await?;
    let Summary { count, frames, .. } = crate::api::stored(&flock.summary)?;
    let n_postures = u64::from(count) * u64::from(frames);
    if n_postures > MAX_POSTURES {
        let sentence = format!(
            "count times frames of a school must be at most {MAX_POSTURES}, not {n_postures}: write it with \
             `flockreel fish --flock`"
        );
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    let params = Params {
        body: query.body.unwrap_or(Body::Own),
        palette: query.palette.unwrap_or(Palette::Goldfish),
        ..Params::default()
    };
    access.note_use::<Flock>(&flock);
    // The files of a flock never change, so clients may keep the school.
    let etag = format!("\"{id}-{:?}-{:?}\"", params.body, params.palette);
    let answer = tagged(&etag, "private, max-age=31536000, immutable");
    if is_known(&conditions, &etag) {
        return not_modified(answer);
    }
    let library = access.find::<Library>(flock.library_id).await?;
    let measured: Measurement = crate::api::stored(&library.summary)?;
    if params.body == Body::Own && measured.n_frames > MAX_FITTED_FRAMES {
        let sentence = format!(
            "the animal of a film of more than {MAX_FITTED_FRAMES} frames takes longer than a request may: write the school with \
             `flockreel fish --flock`, or ask for body=goldfish"
        );
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let file = synchronous::school(context, owner, &library, &flock.folder, params).await?;
    let body = Bytes::from(file);
    let answer = with_type(answer, MEDIA_TYPE, &saved_name(&flock, NAME)?);
    built(
        answer
            .header(header::CONTENT_LENGTH, body.len())
            .body(body.into()),
    )
}
