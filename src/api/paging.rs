//! Paging of lists: newest first, with a cursor to the next page.
//!
//! The cursor is the id of the last item of a page. Items that are added or deleted meanwhile therefore
//! do not shift the following pages.

use axum::extract::{FromRequestParts, Query};
use axum::http::request::Parts;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::Problem;
use flockreel_core::code::Code;

/// Largest page, items. Free choice.
const MAX_LIMIT: i64 = 200;

/// Query parameters of a list.
#[derive(Clone, Copy, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct Paging {
    /// Maximum number of items, 1..=200.
    #[serde(default = "default_limit")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    pub limit: i64,
    /// `next_cursor` of the previous page. Without it the first page is returned.
    pub cursor: Option<Uuid>,
}

/// One page of a list.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(super) struct Page<T> {
    /// Items, newest first.
    pub items: Vec<T>,
    /// Cursor of the next page; null on the last page.
    pub next_cursor: Option<Uuid>,
}

impl Paging {
    /// Returns the number of rows to query: one more than fit on the page, to see whether there is a next page.
    pub(super) fn n_rows(self) -> i64 {
        self.limit + 1
    }
}

impl<T> Page<T> {
    /// Returns a page of `items`, queried with a limit of [`Paging::n_rows`].
    pub(super) fn new(mut items: Vec<T>, paging: Paging, id: impl Fn(&T) -> Uuid) -> Page<T> {
        let limit = usize::try_from(paging.limit).unwrap_or(0);
        let has_more = items.len() > limit;
        items.truncate(limit);
        let next_cursor = items.last().filter(|_| has_more).map(id);
        Page { items, next_cursor }
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Paging {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Paging, Problem> {
        let invalid = |sentence: String| Problem::new(Code::InvalidParams, sentence);
        let query = Query::<Paging>::from_request_parts(parts, state).await;
        let Query(paging) = query.map_err(|rejection| invalid(rejection.body_text()))?;
        if !(1..=MAX_LIMIT).contains(&paging.limit) {
            return Err(invalid(format!(
                "limit must lie in 1..=200: {}",
                paging.limit
            )));
        }
        Ok(paging)
    }
}

fn default_limit() -> i64 {
    50
}
