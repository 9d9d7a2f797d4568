//! POST /v1/datasets: queues a job that makes a data set.
//!
//! POST /v1/datasets/estimate returns the size of such a data set, and POST /v1/datasets/preview samples of it. Both make
//! nothing.

use axum::http::header;
use axum::response::IntoResponse;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::ToSchema;

use crate::api::extract::{Access, Json};
use crate::api::flocks::preview::MAX_PREVIEWED_POSES;
use crate::api::jobs::accepted;
use crate::api::problem::{Answer, JsonAnswer, Problem, ProblemBody};
use crate::api::resources::Reference;
use crate::api::stored;
use crate::jobs::analysis::Summary;
use crate::jobs::flock::dataset::job::Input;
use crate::jobs::flock::dataset::{Estimate, ahead};
use crate::jobs::{Error, IdSequence};
use crate::store::resources::Library;
use flockreel_core::code::Code;
use flockreel_core::dataset::{Params, Plan};
use flockreel_core::formats::params;
use flockreel_core::ids::{DatasetId, JobId, LibraryId};

/// Maximum number of libraries of one data set. All are in memory at once. Free choice.
const MAX_LIBRARIES: usize = 32;
/// Maximum length of a licence or source, characters. Free choice.
const MAX_TERMS: usize = 1000;

/// Libraries and parameters of a data set.
#[derive(Debug, Deserialize, ToSchema)]
pub(in crate::api) struct DatasetRequest {
    /// Ids of the libraries to make the flocks from, at most 32. `sample` stands for the newest library of the sample.
    /// Each flock is made from one of them, in turn.
    #[schema(value_type = Vec<String>, min_items = 1, max_items = 32)]
    library_ids: Vec<Reference>,
    /// Licence of the footage, for the manifest and the README: one line.
    #[serde(default)]
    #[schema(max_length = 1000)]
    licence: Option<String>,
    /// Source of the footage, for the manifest and the README: one line.
    #[serde(default)]
    #[schema(max_length = 1000)]
    source: Option<String>,
    #[serde(flatten)]
    #[schema(value_type = Params)]
    params: Map<String, Value>,
}

/// The queued job, and the data set that it makes.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct DatasetAccepted {
    /// Job that makes the data set.
    #[schema(value_type = Uuid)]
    job_id: JobId,
    /// Data set that the job makes. It exists once the job is done.
    #[schema(value_type = Uuid)]
    dataset_id: DatasetId,
    /// Expected size.
    estimate: DatasetEstimate,
}

/// Expected size of a data set. A few pictures are drawn for it.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
pub(in crate::api) struct DatasetEstimate {
    /// Number of pictures; exact.
    pictures: u64,
    /// Size of pictures and labels, bytes.
    size_bytes: u64,
    /// Time for drawing by one job on this machine, seconds. Planning comes on top.
    drawing_s: f64,
}

/// A request that was checked.
struct Asked {
    libraries: Vec<Library>,
    input: Input,
}

/// Start making a data set.
///
/// Queues a job that films many flocks of one or more libraries, each with another camera, and labels every picture. Each
/// finished flock is kept: after a cancellation or a failure, `POST /v1/jobs/{id}/retry` goes on with the next one.
///
/// The response is 202. `Location` is the address of the job, and `Link` that of the future data set. With
/// `Prefer: wait=N`, a job that ends in time gives 201. The libraries must exist. Wrong parameters fail with
/// `invalid_params`. A data set that is expected not to fit fails with `owner_storage_full` or `storage_full`. A few pictures
/// are drawn for the estimate; if that cannot start within 20 seconds, the call fails with `busy`. If too many jobs are
/// queued or running, it fails with `quota_exceeded` or `queue_full`.
#[utoipa::path(post, path = "/v1/datasets", request_body = DatasetRequest, responses(
    (status = 202, body = DatasetAccepted, headers(("location" = String), ("link" = String))),
    (status = 201, body = DatasetAccepted, headers(("location" = String)), description = "done within the requested wait"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn create_dataset(
    access: Access,
    mut ids: IdSequence,
    Json(request): Json<DatasetRequest>,
) -> Answer {
    let asked = Asked::check(&access, request).await?;
    let estimate = asked.estimate(&access).await?;
    let (job_id, dataset_id) = access.enqueue(&asked.input, None, &mut ids).await?;
    let body = DatasetAccepted {
        job_id,
        dataset_id,
        estimate,
    };
    Ok(accepted(
        job_id,
        &format!("/v1/datasets/{dataset_id}"),
        body,
    ))
}

/// Estimate the size of a data set.
///
/// A few pictures are drawn for it. Nothing is stored. Fails as `POST /v1/datasets` does.
#[utoipa::path(post, path = "/v1/datasets/estimate", request_body = DatasetRequest, responses(
    (status = 200, body = DatasetEstimate),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn estimate_dataset(
    access: Access,
    Json(request): Json<DatasetRequest>,
) -> JsonAnswer<DatasetEstimate> {
    let asked = Asked::check(&access, request).await?;
    Ok(axum::Json(asked.estimate(&access).await?))
}

/// See samples of a data set.
///
/// Draws nine pictures from all over the data set, with the labels drawn over them, while the client waits: outlines are
/// masks, white points are visible keypoints, red ones hidden. Nothing is stored.
///
/// The largest `count` times the frames of a flock is at most 200,000, else the call fails with `invalid_params`. If it
/// cannot start within 20 seconds, it fails with `busy`.
#[utoipa::path(post, path = "/v1/datasets/preview", request_body = DatasetRequest, responses(
    (status = 200, body = Vec<u8>, content_type = "image/jpeg"),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
    (status = "5XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn preview_dataset(
    access: Access,
    Json(request): Json<DatasetRequest>,
) -> Answer {
    let Asked { libraries, input } = Asked::check(&access, request).await?;
    let params = input.params;
    let n_frames = u64::from(params.pictures - 1) * u64::from(params.every) + 1;
    let n_poses = u64::from(params.count[1]) * n_frames;
    if n_poses > MAX_PREVIEWED_POSES {
        let sentence = format!(
            "the largest count times the frames of a flock must be at most {MAX_PREVIEWED_POSES} in a preview, not {n_poses}"
        );
        return Err(Problem::new(Code::InvalidParams, sentence));
    }
    let (context, owner) = (&access.state.context, &access.caller.account.owner);
    let sheet = ahead::sheet(context, owner, &libraries, params).await?;
    Ok(([(header::CONTENT_TYPE, "image/jpeg")], sheet).into_response())
}

impl Asked {
    /// Reads a request. Fails with `invalid_params`, and if a library does not exist.
    async fn check(access: &Access, request: DatasetRequest) -> Result<Asked, Problem> {
        let refused = |sentence: String| Problem::new(Code::InvalidParams, sentence);
        let params: Params = params::read(request.params)?;
        if !(1..=MAX_LIBRARIES).contains(&request.library_ids.len()) {
            return Err(refused(format!(
                "library_ids must have 1 to {MAX_LIBRARIES} libraries"
            )));
        }
        for terms in [&request.licence, &request.source].into_iter().flatten() {
            if terms.chars().count() > MAX_TERMS || terms.contains(char::is_control) {
                return Err(refused(format!(
                    "licence and source must be one line of at most {MAX_TERMS} characters each"
                )));
            }
        }
        let (mut libraries, mut sizes_px) = (Vec::new(), Vec::new());
        for reference in request.library_ids {
            let id = access.id_of::<Library>(reference).await?;
            let library = access.find::<Library>(id).await?;
            access.note_use::<Library>(&library);
            sizes_px.push(stored::<Summary>(&library.summary)?.image_size_px);
            libraries.push(library);
        }
        Plan::new(&params, &sizes_px, 0)?;
        let input = Input {
            library_ids: libraries.iter().map(|row| LibraryId(row.id)).collect(),
            params,
            licence: request.licence,
            source: request.source,
        };
        Ok(Asked { libraries, input })
    }

    /// Estimates the size. Fails if there is no space for it.
    async fn estimate(&self, access: &Access) -> Result<DatasetEstimate, Problem> {
        let (context, owner) = (&access.state.context, &access.caller.account.owner);
        let params = self.input.params.clone();
        let estimate = ahead::estimate(context, owner, &self.libraries, params).await?;
        (access.store())
            .require_result_space(owner, estimate.n_bytes)
            .await
            .map_err(Error::Store)?;
        Ok(estimate.into())
    }
}

impl From<Estimate> for DatasetEstimate {
    fn from(estimate: Estimate) -> DatasetEstimate {
        DatasetEstimate {
            pictures: estimate.n_pictures,
            size_bytes: estimate.n_bytes,
            drawing_s: estimate.drawing_s,
        }
    }
}
