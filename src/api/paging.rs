//! Lists, page by page: newest first, an opaque cursor to the next page (ECOSYSTEM.md 6).

use axum::extract::{FromRequestParts, Query};
use axum::http::request::Parts;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::Problem;
use crate::code::Code;

const MAX_LIMIT: i64 = 200;

/// Which page is wanted.
#[derive(Clone, Copy, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct Paging {
    /// How many at most, 1..=200.
    #[serde(default = "fifty")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    pub limit: i64,
    /// `next_cursor` of the page before.
    pub cursor: Option<Uuid>,
}

/// One page.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(super) struct Page<T> {
    /// The things, newest first.
    pub items: Vec<T>,
    /// Where the next page begins; null at the end.
    pub next_cursor: Option<Uuid>,
}

impl<T> Page<T> {
    /// A page of rows that were asked for with `limit` + 1.
    pub(super) fn of<Row>(
        mut rows: Vec<Row>,
        paging: Paging,
        id_of: impl Fn(&Row) -> Uuid,
        view: impl Fn(Row) -> Result<T, Problem>,
    ) -> Result<axum::Json<Page<T>>, Problem> {
        let limit = usize::try_from(paging.limit).unwrap_or(0);
        let has_more = rows.len() > limit;
        rows.truncate(limit);
        let next_cursor = rows.last().filter(|_| has_more).map(id_of);
        let items = rows.into_iter().map(view).collect::<Result<_, _>>()?;
        Ok(axum::Json(Page { items, next_cursor }))
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

fn fifty() -> i64 {
    50
}
