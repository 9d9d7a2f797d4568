//! Requests that are the same for footage, libraries, flocks and virtual fish: find, list, get and delete.

use axum::http::StatusCode;
use serde::Serialize;
use uuid::Uuid;

use super::AppState;
use super::access::Caller;
use super::jobs::absent_result;
use super::paging::{Page, Paging};
use super::problem::Problem;
use crate::store::resources::Resource;

/// The JSON form of a resource.
pub(super) trait View: Serialize + Sized {
    /// The stored resource.
    type Stored: Resource;

    /// Returns the JSON form of a row. Fails with `internal` if this version cannot read the row.
    fn from_row(row: <Self::Stored as Resource>::Row) -> Result<Self, Problem>;

    /// Returns the id of the resource.
    fn id(&self) -> Uuid;
}

/// Returns the row of a resource. Fails with `not_ready` if its job is not done, and with `not_found` if there
/// is none.
pub(super) async fn find<R: Resource>(
    state: &AppState,
    caller: &Caller,
    id: Uuid,
) -> Result<R::Row, Problem> {
    let row = state.context.store.resource::<R>(id, &caller.owners);
    match row.await? {
        Some(row) => Ok(row),
        None => Err(absent_result(state, caller, id).await?),
    }
}

/// Returns a page of resources, newest first.
pub(super) async fn list<V: View>(
    state: &AppState,
    caller: &Caller,
    paging: Paging,
) -> Result<axum::Json<Page<V>>, Problem> {
    let store = &state.context.store;
    let rows = store
        .list_resources::<V::Stored>(paging.n_rows(), paging.cursor, &caller.owners)
        .await?;
    let views = rows
        .into_iter()
        .map(V::from_row)
        .collect::<Result<_, _>>()?;
    Ok(axum::Json(Page::new(views, paging, V::id)))
}

/// Returns one resource.
pub(super) async fn get<V: View>(
    state: &AppState,
    caller: &Caller,
    id: Uuid,
) -> Result<axum::Json<V>, Problem> {
    let row = find::<V::Stored>(state, caller, id).await?;
    Ok(axum::Json(V::from_row(row)?))
}

/// Deletes a resource and returns 204. Fails with `not_found` if it was deleted in the meantime.
pub(super) async fn delete<R: Resource>(
    state: &AppState,
    caller: &Caller,
    id: Uuid,
) -> Result<StatusCode, Problem> {
    find::<R>(state, caller, id).await?;
    if state.context.store.delete(R::KIND, id).await? {
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(Problem::not_found())
    }
}
