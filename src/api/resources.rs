//! Requests that are the same for footage, libraries, flocks, virtual fish and data sets: find, list, get and delete. Also
//! the references to footage and libraries in requests.

use axum::http::StatusCode;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use super::AppState;
use super::download::Files;
use super::extract::Access;
use super::jobs::absent_result;
use super::paging::{Listing, Page};
use super::problem::{JsonAnswer, Problem};
use crate::jobs::clock::now_ms;
use crate::store::resources::{Property, Resource, ResourceFilter, ResourceKind};
use flockreel_core::code::Code;

/// Time for which a recorded use also stands for later ones, milliseconds. Ages are counted in days, so an hour is exact
/// enough, and reading a resource rarely writes.
const USE_INTERVAL_MS: i64 = 3600 * 1000;

/// The JSON form of a resource.
pub(super) trait View: Serialize + Sized {
    /// The stored resource.
    type Stored: Resource;

    /// Returns the JSON form of a row. Fails with `internal` if this version cannot read the row.
    fn from_row(row: <Self::Stored as Resource>::Row) -> Result<Self, Problem>;

    /// Returns the id of the resource.
    fn id(&self) -> Uuid;
}

/// The JSON form of the result of a job, which has files.
pub(super) trait ResultView: View {
    /// Files that can be downloaded.
    const FILES: Files;

    /// Returns the folders of the files.
    fn folders(row: &<Self::Stored as Resource>::Row) -> Vec<&str>;

    /// Returns the view with its files.
    fn with_files(self, files: Vec<FileView>) -> Self;
}

/// New properties of a flock, a virtual fish or a data set.
#[derive(Clone, Copy, Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ResultChange {
    /// Whether it stays even if nobody uses it.
    pinned: bool,
}

impl ResultChange {
    /// Returns the changed properties.
    pub(super) fn properties(self) -> [Property<'static>; 1] {
        [Property::Pinned(self.pinned)]
    }
}

/// A file that can be downloaded from below the address of its resource.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct FileView {
    /// Name of the file: the last part of its address.
    name: String,
    /// Media type.
    media_type: &'static str,
    /// Size, bytes.
    size_bytes: i64,
}

impl FileView {
    /// Returns the entry of a file with this name, media type and size.
    pub(super) fn new((name, media_type): (&str, &'static str), size_bytes: i64) -> FileView {
        FileView {
            name: name.to_owned(),
            media_type,
            size_bytes,
        }
    }
}

/// Reference to a resource in a request: its id, or the word `sample` for the newest sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub(super) enum Reference {
    /// The resource with this id.
    Id(Uuid),
    /// The newest resource of its kind that is or derives from the sample of an empty data folder.
    Sample,
}

impl TryFrom<String> for Reference {
    type Error = String;

    fn try_from(text: String) -> Result<Reference, String> {
        match (text.as_str(), text.parse()) {
            ("sample", _) => Ok(Reference::Sample),
            (_, Ok(id)) => Ok(Reference::Id(id)),
            _ => Err(format!("neither an id nor `sample`: {text}")),
        }
    }
}

impl Access {
    /// Returns the id of a resource. Fails with `invalid_params` if the caller has no sample. An id is returned
    /// even if no resource has it.
    pub(super) async fn id_of<R: Resource>(&self, reference: Reference) -> Result<Uuid, Problem> {
        let filter = match reference {
            Reference::Id(id) => return Ok(id),
            Reference::Sample => ResourceFilter {
                only_sample: true,
                ..ResourceFilter::default()
            },
        };
        let owners = &self.caller.owners;
        let newest = (self.store()).filtered_resources::<R>(&filter, 1, None, owners);
        let newest = newest.await?.into_iter().next();
        newest.map(|row| R::id(&row)).ok_or_else(|| {
            let sentence = "this service has no sample, or has not finished it";
            Problem::new(Code::InvalidParams, sentence)
        })
    }

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
    pub(super) async fn list<V: View>(&self, listing: Listing) -> JsonAnswer<Page<V>> {
        let Listing { paging, filter } = listing;
        let (limit, owners) = (paging.n_rows(), &self.caller.owners);
        let rows =
            (self.store()).filtered_resources::<V::Stored>(&filter, limit, paging.cursor, owners);
        let views = rows.await?.into_iter().map(V::from_row);
        let views = views.collect::<Result<_, _>>()?;
        Ok(axum::Json(Page::new(views, paging, V::id)))
    }

    /// Returns one resource.
    pub(super) async fn get<V: View>(&self, id: Uuid) -> JsonAnswer<V> {
        let row = self.find::<V::Stored>(id).await?;
        self.note_use::<V::Stored>(&row);
        Ok(axum::Json(V::from_row(row)?))
    }

    /// Returns one result with the list of its files.
    pub(super) async fn get_result<V: ResultView>(&self, id: Uuid) -> JsonAnswer<V> {
        let row = self.find::<V::Stored>(id).await?;
        self.note_use::<V::Stored>(&row);
        let mut stored = Vec::new();
        for folder in V::folders(&row) {
            stored.extend(self.store().files_of(folder).await?);
        }
        let files = stored.into_iter().filter_map(|file| {
            let entry = V::FILES.iter().find(|(known, _)| *known == file.name);
            Some(FileView::new(*entry?, file.size_bytes))
        });
        let files = files.collect();
        Ok(axum::Json(V::from_row(row)?.with_files(files)))
    }

    /// Changes properties of a result and returns it with the list of its files.
    pub(super) async fn change_result<V: ResultView>(
        &self,
        id: Uuid,
        properties: &[Property<'_>],
    ) -> JsonAnswer<V> {
        self.change::<V::Stored>(id, properties).await?;
        self.get_result(id).await
    }

    /// Changes properties of a resource. Fails with `not_found` if it was deleted in the meantime.
    pub(super) async fn change<R: Resource>(
        &self,
        id: Uuid,
        properties: &[Property<'_>],
    ) -> Result<(), Problem> {
        self.find::<R>(id).await?;
        let owners = &self.caller.owners;
        let changed = self.store().change(R::KIND, id, properties, owners);
        changed.await?.then_some(()).ok_or_else(Problem::not_found)
    }

    /// Records that a resource is used, at most once an hour. The response neither waits for the record nor depends on it.
    pub(super) fn note_use<R: Resource>(&self, row: &R::Row) {
        let (id, now_ms) = (R::id(row), now_ms());
        if now_ms - R::used_ms(row) < USE_INTERVAL_MS || !self.state.uses().insert(id) {
            return;
        }
        tokio::spawn(record_use(self.state.clone(), R::KIND, id, now_ms));
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

async fn record_use(state: AppState, kind: ResourceKind, id: Uuid, now_ms: i64) {
    let recorded = state.context.store.record_use(kind, id, now_ms);
    if let Err(error) = recorded.await {
        tracing::debug!(%error, resource.id = %id, "the use of a resource was not recorded");
    }
    state.uses().remove(&id);
}
