//! The space of the caller's owner, and the limits that apply to it (docs/explanation/promises.md, "Limited space").

use serde::Serialize;
use utoipa::ToSchema;

use crate::api::extract::Access;
use crate::api::problem::{JsonAnswer, ProblemBody};
use crate::config::Retention;
use crate::store::space::{Amount, Usage};

/// Space of an owner.
#[derive(Debug, Serialize, ToSchema)]
pub(in crate::api) struct UsageView {
    /// Bytes that count against the limit: all stored files, and open uploads with their announced sizes.
    used_bytes: i64,
    /// Limit of `used_bytes`; null = none.
    max_bytes: Option<u64>,
    /// Footage with its backgrounds, masks and posters.
    footage: AmountView,
    /// Libraries with their views.
    libraries: AmountView,
    /// Flocks.
    flocks: AmountView,
    /// Virtual fish.
    fish: AmountView,
    /// Data sets, with what unfinished ones have kept.
    datasets: AmountView,
    /// Open resumable uploads, with their announced sizes.
    uploads: AmountView,
    /// Announced size of the bodies of requests that are being received, bytes.
    incoming_bytes: i64,
    /// Days after which footage, libraries, flocks, virtual fish and data sets that nobody used are deleted; null = never.
    keep_days: Option<u32>,
    /// Days after which failed and cancelled jobs are deleted; null = never.
    keep_jobs_days: Option<u32>,
}

/// A number of things and their total size.
#[derive(Debug, Default, Serialize, ToSchema)]
pub(in crate::api) struct AmountView {
    /// Number.
    n: i64,
    /// Total size, bytes.
    size_bytes: i64,
}

/// Get the space that the caller uses.
///
/// The numbers cover the owner of the token, also for tokens of scope `admin`. Deleting footage frees the space of
/// everything made from it.
#[utoipa::path(get, path = "/v1/usage", responses(
    (status = 200, body = UsageView),
    (status = "4XX", body = ProblemBody, content_type = "application/problem+json"),
))]
pub(in crate::api) async fn get_usage(access: Access) -> JsonAnswer<UsageView> {
    let usage = access.store().usage(&access.caller.account.owner).await?;
    let retention = access.state.context.retention;
    Ok(axum::Json(UsageView::new(usage, retention)))
}

impl UsageView {
    fn new(usage: Usage, retention: Retention) -> UsageView {
        let used_bytes = usage.used_bytes();
        let [footage, mut libraries, flocks, fish, views, datasets]: [AmountView; 6] =
            usage.stored.map(|(_, amount)| amount.into());
        libraries.size_bytes += views.size_bytes;
        let days = |n_days: u32| Some(n_days).filter(|n_days| *n_days > 0);
        UsageView {
            used_bytes,
            max_bytes: usage.max_bytes,
            footage,
            libraries,
            flocks,
            fish,
            datasets,
            uploads: usage.uploads.into(),
            incoming_bytes: usage.incoming_bytes,
            keep_days: days(retention.keep_days),
            keep_jobs_days: days(retention.keep_jobs_days),
        }
    }
}

impl From<Amount> for AmountView {
    fn from(amount: Amount) -> AmountView {
        AmountView {
            n: amount.n,
            size_bytes: amount.n_bytes,
        }
    }
}
