//! Requests that are the same for footage, libraries, flocks and virtual fish: find, list, get and delete.

use axum::http::StatusCode;
use serde::Serialize;
use uuid::Uuid;

use super::extract::Access;
use super::jobs::absent_result;
use super::paging::{Page, Paging};
use super::problem::{JsonAnswer, Problem};
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

impl Access {
    /// Returns the row of a resource. Fails with `not_ready` if its job has not ended, with the code of the
    /// job if that failed or was cancelled, and with `not_found` if there is no such job.
    pub(super) async fn find<R: Resource>(&self, id: Uuid) -> Result<R::Row, Problem> {
        let row = self.store().resource::<R>(id, &self.caller.owners);
        match row.await? {
            Some(row) => Ok(row),
            None => Err(absent_result(self, id).await?),
        }
    }

    /// Returns a page of resources, newest first.
    pub(super) async fn list<V: View>(&self, paging: Paging) -> JsonAnswer<Page<V>> {
        let (limit, owners) = (paging.n_rows(), &self.caller.owners);
        let rows = self
            .store()
            .list_resources::<V::Stored>(limit, paging.cursor, owners);
        let views = rows.await?.into_iter().map(V::from_row);
        let views = views.collect::<Result<_, _>>()?;
        Ok(axum::Json(Page::new(views, paging, V::id)))
    }

    /// Returns one resource.
    pub(super) async fn get<V: View>(&self, id: Uuid) -> JsonAnswer<V> {
        let row = self.find::<V::Stored>(id).await?;
        Ok(axum::Json(V::from_row(row)?))
    }

    /// Deletes a resource and returns 204. Fails with `not_found` if it was deleted in the meantime.
    pub(super) async fn delete<R: Resource>(&self, id: Uuid) -> Result<StatusCode, Problem> {
        self.find::<R>(id).await?;
        if self.store().delete(R::KIND, id).await? {
            Ok(StatusCode::NO_CONTENT)
        } else {
            Err(Problem::not_found())
        }
    }
}
