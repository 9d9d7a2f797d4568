//! POST /v1/analyses: queues a job that measures a footage and makes a library. The request names stored footage, or its
//! body is the video itself, which is then stored first.
//!
//! POST /v1/analyses/preview: finds the animal in some frames as such a job would, while the client waits.

use axum::extract::{FromRequest, Request};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::extract::{Access, Json, Query};
use super::footage::{Naming, admit};
use super::jobs::accepted;
use super::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use super::receive::{Form, is_film, receive_with_json};
use super::resources::Reference;
use crate::jobs::IdSequence;
use crate::jobs::analysis::{Input, preview};
use crate::store::footage::{Added, Footage};
use flockreel_core::analysis::Params;
use flockreel_core::analysis::scene::preview::SeenFrame;
use flockreel_core::code::Code;
use flockreel_core::formats::params;
use flockreel_core::ids::{FootageId, JobId, LibraryId};

/// Footage to measure, and parameters of the analysis.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AnalysisRequest {
    /// Id of the footage to measure, or `sample`: the newest sample.
    #[schema(value_type = String)]
    footage_id: Reference,
    /// Parameters to override. They override the values of `preset`, or the defaults if there is no preset.
    #[serde(default)]
    #[schema(value_type = AnalysisOverrides)]
    params: Map<String, Value>,
}

/// Parameters that a preset replaces together.
#[derive(ToSchema)]
#[schema(rename_all = "snake_case")]
#[expect(
    dead_code,
    reason = "it only describes the presets in the OpenAPI document"
)]
enum Preset {
    /// As published, as far as the two papers specify the parameters.
    Papers,
}

/// Parameters of an analysis to override. They override the values of `preset`, or the defaults if there is no
/// preset.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the parameters in the OpenAPI document"
)]
pub(super) struct AnalysisOverrides {
    #[schema(inline)]
    preset: Option<Preset>,
    #[serde(flatten)]
    params: Params,
}

/// The queued job, and the library that it makes.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct AnalysisAccepted {
    /// Job that measures the footage.
    #[schema(value_type = uuid::Uuid)]
    job_id: JobId,
    /// Library that the job makes. It exists once the job is done.
    #[schema(value_type = uuid::Uuid)]
    library_id: LibraryId,
    /// Measured footage. A video that came with the request has a new id, or the id of footage with the same
    /// bytes that is stored already.
    #[schema(value_type = uuid::Uuid)]
    footage_id: FootageId,
}

/// Form with a video to measure.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the form in the OpenAPI document"
)]
pub(super) struct AnalysisForm {
    /// Video, zip of numbered pictures, or TIFF of several pages. The field may also be called `footage`.
    #[schema(value_type = String, format = Binary)]
    video: Vec<u8>,
    /// Picture of the scene without the animal, of the same width and height as the video.
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// One mask per frame, as a gray video, a zip of pictures or a TIFF. White is the animal, black the rest.
    /// Gray is the share of the pixel that the animal covers.
    #[schema(value_type = Option<String>, format = Binary)]
    masks: Option<Vec<u8>>,
    /// Parameters to override, as JSON.
    params: Option<AnalysisOverrides>,
}

/// Start an analysis: footage to library.
///
/// Queues a job that measures the animal. The body is JSON with the id of stored footage, a form with a
/// video, or a raw video. A raw video is measured with the default parameters.
///
/// The response is 202. `Location` is the address of the job, and `Link` that of the future library. With
/// `Prefer: wait=N`, a job that ends in time gives 201. Unknown footage and wrong parameters fail with
/// `invalid_params`. If too many jobs are queued or running, the call fails with `quota_exceeded` or
/// `queue_full`.
#[utoipa::path(post, path = "/v1/analyses", params(Naming),
    request_body(content((AnalysisRequest = "application/json"), ([u8] = "application/octet-stream"),
        (AnalysisForm = "multipart/form-data"))), responses(
    (status = 202, body = AnalysisAccepted, headers(("location" = String), ("link" = String))),
    (status = 201, body = AnalysisAccepted, headers(("location" = String)), description = "done within the requested wait"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn create_analysis(
    access: Access,
    Query(naming): Query<Naming>,
    mut ids: IdSequence,
    request: Request,
) -> Answer {
    let input = if is_film(&request) {
        let form = Form {
            name: naming.name,
            owner: access.caller.account.owner.clone(),
            json_fields: &["params"],
            film: None,
        };
        let (received, mut fields) = receive_with_json(&access.state, request, form).await?;
        let params = params::read(fields.remove("params").unwrap_or_default())?;
        let (Added::New(footage) | Added::Known(footage)) = admit(&access.state, received).await?;
        Input {
            footage_id: FootageId(footage.id),
            params,
        }
    } else {
        let Json(request) = Json::<AnalysisRequest>::from_request(request, &access.state).await?;
        let params = params::read(request.params)?;
        let footage_id = FootageId(named_footage(&access, request.footage_id).await?.id);
        Input { footage_id, params }
    };
    let (job_id, library_id) = access.enqueue(&input, None, &mut ids).await?;
    let body = AnalysisAccepted {
        job_id,
        library_id,
        footage_id: input.footage_id,
    };
    Ok(accepted(
        job_id,
        &format!("/v1/libraries/{library_id}"),
        body,
    ))
}

/// Preview of an analysis.
#[derive(Serialize, ToSchema)]
pub(super) struct AnalysisPreview {
    /// At most 40 frames, spread evenly over the measured part of the film. Empty if the reason for a refusal hides the
    /// animal, such as a camera that moves.
    frames: Vec<SeenFrame>,
    /// Reason for which the analysis would refuse the film; null if there is none.
    refusal: Option<ProblemBody>,
}

/// Preview an analysis.
///
/// Finds the animal in at most 40 frames while the client waits, and tells whether an analysis with these parameters
/// would refuse the film. Nothing is stored. Only the analysis itself sees every frame at full size: its result can differ.
///
/// The footage must exist. One preview of an owner runs at a time. A preview that cannot start within 20 seconds fails
/// with `busy`, and one of more than 30 seconds with `time_limit`. It ends when the client closes the connection.
#[utoipa::path(post, path = "/v1/analyses/preview", request_body = AnalysisRequest, responses(
    (status = 200, body = AnalysisPreview),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn preview_analysis(
    access: Access,
    Json(request): Json<AnalysisRequest>,
) -> JsonAnswer<AnalysisPreview> {
    let params: Params = params::read(request.params)?;
    let footage = named_footage(&access, request.footage_id).await?;
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let preview = preview::preview(context, owner, &footage, params).await?;
    Ok(axum::Json(AnalysisPreview {
        frames: preview.frames,
        refusal: preview.refusal.map(|refusal| {
            let problem = Problem::new(refusal.code(), refusal.sentence);
            ProblemBody::new(&problem, refusal.mends)
        }),
    }))
}

/// Finds the footage that a request names, and notes its use.
async fn named_footage(access: &Access, reference: Reference) -> Result<Footage, Problem> {
    let id = access.id_of::<Footage>(reference).await?;
    let footage = access
        .store()
        .resource::<Footage>(id, &access.caller.owners);
    let Some(footage) = footage.await? else {
        let sentence = format!("the footage does not exist: {id}");
        return Err(Problem::new(Code::InvalidParams, sentence));
    };
    access.note_use::<Footage>(&footage);
    Ok(footage)
}
