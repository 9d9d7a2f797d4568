//! Paging and filters of lists: newest first, with a cursor to the next page.
//!
//! The cursor is the id of the last item of a page. Items that are added or deleted meanwhile therefore
//! do not shift the following pages.

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::Problem;
use super::extract::Query;
use crate::store::resources::ResourceFilter;
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

/// Query parameters of the list of footage.
#[derive(Clone, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct FootageQuery {
    /// Maximum number of items, 1..=200.
    #[serde(default = "default_limit")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    limit: i64,
    /// `next_cursor` of the previous page. Without it the first page is returned.
    cursor: Option<Uuid>,
    /// Text that the name contains. The case of ASCII letters does not matter.
    q: Option<String>,
}

/// Query parameters of the list of libraries.
#[derive(Clone, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct LibraryQuery {
    /// Maximum number of items, 1..=200.
    #[serde(default = "default_limit")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    limit: i64,
    /// `next_cursor` of the previous page. Without it the first page is returned.
    cursor: Option<Uuid>,
    /// Footage that the libraries were made from.
    footage_id: Option<Uuid>,
    /// Text that the name of the footage contains. The case of ASCII letters does not matter.
    q: Option<String>,
}

/// Query parameters of the lists of flocks, virtual fish and data sets.
#[derive(Clone, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct FilmQuery {
    /// Maximum number of items, 1..=200.
    #[serde(default = "default_limit")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    limit: i64,
    /// `next_cursor` of the previous page. Without it the first page is returned.
    cursor: Option<Uuid>,
    /// Footage that they were made from.
    footage_id: Option<Uuid>,
    /// Library that they were made from.
    library_id: Option<Uuid>,
    /// Text that the name of the footage contains. The case of ASCII letters does not matter.
    q: Option<String>,
}

/// A page of a list, and the filter of the list.
#[derive(Clone, Debug)]
pub(super) struct Listing {
    /// The page.
    pub paging: Paging,
    /// The filter.
    pub filter: ResourceFilter,
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
    /// Fails with `invalid_params` if the limit is out of range.
    fn checked(self) -> Result<Paging, Problem> {
        if (1..=MAX_LIMIT).contains(&self.limit) {
            return Ok(self);
        }
        let sentence = format!("limit must lie in 1..=200: {}", self.limit);
        Err(Problem::new(Code::InvalidParams, sentence))
    }

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
        let Query(paging) = Query::<Paging>::from_request_parts(parts, state).await?;
        paging.checked()
    }
}

/// Query parameters of a filtered list. `Q` is one of the structs above.
pub(super) struct Filtered<Q>(pub Listing, std::marker::PhantomData<Q>);

impl<S: Send + Sync, Q: DeserializeOwned + Into<Listing>> FromRequestParts<S> for Filtered<Q> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Filtered<Q>, Problem> {
        let Query(query) = Query::<Q>::from_request_parts(parts, state).await?;
        let listing: Listing = query.into();
        listing.paging.checked()?;
        // PostgreSQL refuses this character in a text, and no name has it.
        let name = listing.filter.name_contains.as_deref();
        if name.is_some_and(|name| name.contains('\0')) {
            let sentence = "q must not contain the character U+0000";
            return Err(Problem::new(Code::InvalidParams, sentence));
        }
        Ok(Filtered(listing, std::marker::PhantomData))
    }
}

impl From<FootageQuery> for Listing {
    fn from(query: FootageQuery) -> Listing {
        let FootageQuery { limit, cursor, q } = query;
        let (footage_id, library_id) = (None, None);
        FilmQuery {
            limit,
            cursor,
            footage_id,
            library_id,
            q,
        }
        .into()
    }
}

impl From<LibraryQuery> for Listing {
    fn from(query: LibraryQuery) -> Listing {
        let LibraryQuery {
            limit,
            cursor,
            footage_id,
            q,
        } = query;
        let library_id = None;
        FilmQuery {
            limit,
            cursor,
            footage_id,
            library_id,
            q,
        }
        .into()
    }
}

impl From<FilmQuery> for Listing {
    fn from(query: FilmQuery) -> Listing {
        let filter = ResourceFilter {
            footage_id: query.footage_id,
            library_id: query.library_id,
            name_contains: query.q,
            ..ResourceFilter::default()
        };
        let (limit, cursor) = (query.limit, query.cursor);
        let paging = Paging { limit, cursor };
        Listing { paging, filter }
    }
}

fn default_limit() -> i64 {
    50
}
