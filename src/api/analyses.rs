//! Analyses: footage to library, as a job.

use axum::body::Body;
use axum::extract::{FromRequest, Query, Request, State};
use axum::http::Response;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use super::AppState;
use super::access::Caller;
use super::extract::Json;
use super::footage::{Naming, admit};
use super::jobs::accepted;
use super::problem::{Problem, ProblemBody};
use super::receive::{is_film, receive_with};
use crate::analysis::Params;
use crate::code::Code;
use crate::formats::params;
use crate::ids::{FootageId, JobId, LibraryId};
use crate::jobs::analysis::{Input, enqueue};
use crate::store::footage::Added;

/// What to measure, and how.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AnalysisRequest {
    #[schema(value_type = uuid::Uuid)]
    footage_id: FootageId,
    /// Overrides of the defaults, or of `preset` (`papers`).
    #[serde(default)]
    #[schema(value_type = AnalysisOverrides)]
    params: Map<String, Value>,
}

/// Parameters to override, those of `preset` (`papers`) or the defaults.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the parameters in the OpenAPI document"
)]
pub(super) struct AnalysisOverrides {
    preset: Option<String>,
    #[serde(flatten)]
    params: Params,
}

/// The job, and the library that it will make.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct AnalysisAccepted {
    #[schema(value_type = uuid::Uuid)]
    job_id: JobId,
    #[schema(value_type = uuid::Uuid)]
    library_id: LibraryId,
    /// The footage: of a film that came with the request, its new id or that of the same bytes before.
    #[schema(value_type = uuid::Uuid)]
    footage_id: FootageId,
}

/// The film to measure and how, in one form.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "it only describes the form in the OpenAPI document"
)]
pub(super) struct AnalysisForm {
    #[schema(value_type = String, format = Binary)]
    video: Vec<u8>,
    #[schema(value_type = Option<String>, format = Binary)]
    background: Option<Vec<u8>>,
    /// JSON.
    params: Option<AnalysisOverrides>,
}

/// Measure the animal of a footage, or of a film that comes with the request: as the raw body, or as a form.
#[utoipa::path(post, path = "/v1/analyses", params(Naming),
    request_body(content((AnalysisRequest = "application/json"), ([u8] = "application/octet-stream"),
        (AnalysisForm = "multipart/form-data"))), responses(
    (status = 202, body = AnalysisAccepted, headers(("location" = String), ("link" = String))),
    (status = 201, body = AnalysisAccepted, headers(("location" = String)), description = "done within the wait asked for"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(super) async fn create_analysis(
    State(state): State<AppState>,
    Query(naming): Query<Naming>,
    caller: Caller,
    request: Request,
) -> Result<Response<Body>, Problem> {
    if is_film(&request) {
        let label = (naming.name, caller.account.owner.clone());
        let (arrival, mut wishes) = receive_with(&state, request, label, &["params"]).await?;
        let params = params::read(wishes.remove("params").unwrap_or_default())?;
        let (Added::New(footage) | Added::Known(footage)) = admit(&state, arrival).await?;
        return measure(&state, &caller, FootageId(footage.id), params).await;
    }
    let Json(request) = Json::<AnalysisRequest>::from_request(request, &state).await?;
    let params: Params = params::read(request.params)?;
    let footage_id = request.footage_id;
    let footage = state.context.store.footage(footage_id.0, &caller.reach);
    if footage.await?.is_none() {
        let sentence = format!("there is no such footage: {footage_id}");
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    measure(&state, &caller, footage_id, params).await
}

async fn measure(
    state: &AppState,
    caller: &Caller,
    footage_id: FootageId,
    params: Params,
) -> Result<Response<Body>, Problem> {
    let input = Input { footage_id, params };
    let (job_id, library_id) = enqueue(&state.context, &input, None, &caller.account).await?;
    let result = format!("/v1/libraries/{library_id}");
    Ok(accepted(
        job_id,
        &result,
        AnalysisAccepted {
            job_id,
            library_id,
            footage_id,
        },
    ))
}
