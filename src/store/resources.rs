//! Stored resources: footage and the results of jobs. Reading and listing their rows is the same for every
//! kind; only the table and its columns differ.

use sqlx::FromRow;
use sqlx::postgres::PgRow;
use sqlx::sqlite::SqliteRow;
use sqlx::types::Uuid;

use super::footage::Footage;
use super::jobs::JobState;
use super::owners::OwnerFilter;
use super::{Error, Store, sql};

/// Conditions of a list. A resource must meet all of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ResourceFilter {
    /// Id of the footage that the resource is or was made from.
    pub footage_id: Option<Uuid>,
    /// Id of the library that the resource is or was made from. Not for footage.
    pub library_id: Option<Uuid>,
    /// Text that the label of the footage contains, in any case.
    pub name_contains: Option<String>,
    /// Whether to leave out all but the sample and what was made from it.
    pub only_sample: bool,
}

impl ResourceFilter {
    /// Returns the pattern of `like` for names, in which `\` escapes the special characters.
    fn name_pattern(&self) -> Option<String> {
        let text = self.name_contains.as_ref()?;
        let escaped = text.replace('\\', "\\\\");
        let escaped = escaped.replace('%', "\\%").replace('_', "\\_");
        Some(format!("%{escaped}%"))
    }
}

/// A new property of a resource.
#[derive(Clone, Copy, Debug)]
pub enum Property<'a> {
    /// Label; only of footage.
    Name(&'a str),
    /// Whether it stays even if nobody uses it.
    Pinned(bool),
    /// Scale, pixels per centimetre, > 0; only of libraries. `None` if it is unknown.
    PxPerCm(Option<f64>),
}

/// Kinds of stored resources.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResourceKind {
    /// An uploaded video, or the sample that a job made.
    Footage,
    /// The result of an analysis.
    Library,
    /// The result of a flock job.
    Flock,
    /// The result of a fish job.
    Fish,
    /// The videos of a library, the result of a views job. They have no address of their own.
    Views,
    /// The result of a data set job.
    Dataset,
}

/// A kind of resource as a type, for queries that return its rows.
pub trait Resource {
    /// A row of the resource.
    type Row: for<'r> FromRow<'r, SqliteRow> + for<'r> FromRow<'r, PgRow> + Send + Unpin;
    /// The kind.
    const KIND: ResourceKind;

    /// Returns the id of a row.
    fn id(row: &Self::Row) -> Uuid;

    /// Returns the time of the last use of a row, milliseconds since 1970.
    fn used_ms(row: &Self::Row) -> i64;
}

impl Resource for Footage {
    type Row = Footage;
    const KIND: ResourceKind = ResourceKind::Footage;

    fn id(row: &Footage) -> Uuid {
        row.id
    }

    fn used_ms(row: &Footage) -> i64 {
        row.used_ms
    }
}

/// One stored library. Its files are in `folder`.
#[derive(Clone, Debug, PartialEq, FromRow)]
pub struct Library {
    /// Id of the library.
    pub id: Uuid,
    /// The job that made it.
    pub job_id: Uuid,
    /// The footage that was analyzed.
    pub footage_id: Uuid,
    /// Folder in the blob store.
    pub folder: String,
    /// Label of the footage.
    pub name: String,
    /// Parameters of the analysis, JSON.
    pub params: String,
    /// Summary for overviews, JSON.
    pub summary: String,
    /// Whether the footage is the sample made by the program.
    pub sample: bool,
    /// Total size of the files, also of the views, bytes.
    pub size_bytes: i64,
    /// Whether it stays even if nobody uses it.
    pub pinned: bool,
    /// Time of the last use, milliseconds since 1970.
    pub used_ms: i64,
    /// Time at which the analysis finished, milliseconds since 1970.
    pub created_ms: i64,
    /// Scale, pixels per centimetre; `None` until somebody sets it.
    pub px_per_cm: Option<f64>,
    /// The job that makes its views; `None` for a library of an older version, whose own folder has them.
    pub views_job_id: Option<Uuid>,
    /// State of that job.
    pub views_state: Option<String>,
    /// Folder of the views in the blob store; `None` unless that job is done.
    pub views_folder: Option<String>,
}

impl Library {
    /// Returns the state of the job that makes the views. The views of an older version are done.
    pub fn views_state(&self) -> Result<JobState, Error> {
        let state = self.views_state.clone().map(JobState::try_from);
        Ok(state.transpose()?.unwrap_or(JobState::Done))
    }

    /// Returns the folder of the views. It has files only if the views are done.
    pub fn views_folder(&self) -> &str {
        self.views_folder.as_ref().unwrap_or(&self.folder)
    }
}

impl Resource for Library {
    type Row = Library;
    const KIND: ResourceKind = ResourceKind::Library;

    fn id(row: &Library) -> Uuid {
        row.id
    }

    fn used_ms(row: &Library) -> i64 {
        row.used_ms
    }
}

/// Defines kinds of resources whose rows are [`FilmRow`]s.
macro_rules! films {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        pub struct $name;

        impl Resource for $name {
            type Row = FilmRow;
            const KIND: ResourceKind = ResourceKind::$name;

            fn id(row: &FilmRow) -> Uuid {
                row.id
            }

            fn used_ms(row: &FilmRow) -> i64 {
                row.used_ms
            }
        }
    )*};
}

films! {
    /// Flocks.
    Flock
    /// Virtual fish.
    Fish
    /// Data sets.
    Dataset
}

/// One stored flock, virtual fish or data set. Its files are in `folder`, except the parts of a data set.
#[derive(Clone, Debug, PartialEq, FromRow)]
pub struct FilmRow {
    /// Id of the flock, fish or data set.
    pub id: Uuid,
    /// The job that made it.
    pub job_id: Uuid,
    /// The library that it was made from; of a data set, the first one.
    pub library_id: Uuid,
    /// Folder in the blob store.
    pub folder: String,
    /// Label of the footage.
    pub name: String,
    /// Parameters of the job, JSON.
    pub params: String,
    /// Summary for overviews, JSON.
    pub summary: String,
    /// Whether it derives from the sample made by the program.
    pub sample: bool,
    /// Total size of the files, bytes.
    pub size_bytes: i64,
    /// Whether it stays even if nobody uses it.
    pub pinned: bool,
    /// Time of the last use, milliseconds since 1970.
    pub used_ms: i64,
    /// Time at which the job finished, milliseconds since 1970.
    pub created_ms: i64,
}

impl ResourceKind {
    /// All kinds.
    pub const ALL: [ResourceKind; 6] = [
        ResourceKind::Footage,
        ResourceKind::Library,
        ResourceKind::Flock,
        ResourceKind::Fish,
        ResourceKind::Views,
        ResourceKind::Dataset,
    ];

    /// Returns the name of the table, of the folder of the files, and of the routes.
    pub fn plural(self) -> &'static str {
        match self {
            ResourceKind::Footage => "footage",
            ResourceKind::Library => "libraries",
            ResourceKind::Flock => "flocks",
            ResourceKind::Fish => "fish",
            ResourceKind::Views => "views",
            ResourceKind::Dataset => "datasets",
        }
    }

    /// Returns the SQL of the size of a row, with everything that is counted and deleted with it. The table has the
    /// alias `r`.
    pub(super) fn size(self) -> &'static str {
        match self {
            ResourceKind::Library => {
                "r.size_bytes + coalesce((select v.size_bytes from views v where v.library_id = r.id), 0)"
            }
            ResourceKind::Dataset => {
                "r.size_bytes + cast(coalesce((select sum(p.size_bytes) from job_parts p \
                 where p.job_id = r.job_id), 0) as bigint)"
            }
            _ => "r.size_bytes",
        }
    }

    /// Returns the SQL of a [`ResourceFilter`], with its parameters from `$4` on. `like` ignores case in
    /// SQLite only, so both sides are in lower case. SQLite converts ASCII letters only.
    fn condition(self) -> String {
        let [footage_id, library_id, name] = match self {
            ResourceKind::Footage => ["r.id", "r.id", "r.name"],
            ResourceKind::Library => ["footage_id", "r.id", "f.name"],
            ResourceKind::Flock | ResourceKind::Fish | ResourceKind::Views => {
                ["footage_id", "library_id", "f.name"]
            }
            ResourceKind::Dataset => return of_any_library(),
        };
        format!(
            "and ($4 is null or {footage_id} = $4) and ($5 is null or {library_id} = $5) \
             and ($6 is null or lower({name}) like lower($6) escape '\\') and (sample or not $7)"
        )
    }

    /// Returns the statement that selects the rows of all owners. The table has the alias `r`.
    fn select(self) -> String {
        let table = self.plural();
        match self {
            ResourceKind::Footage => "select * from footage r".to_owned(),
            ResourceKind::Library => format!(
                "select r.id, r.job_id, footage_id, r.folder, r.params, r.summary, f.name, sample, \
                 {size} as size_bytes, r.pinned, r.used_ms, r.created_ms, r.px_per_cm, j.id as views_job_id, \
                 j.state as views_state, (select v.folder from views v where v.library_id = r.id) as views_folder \
                 from libraries r join footage f on f.id = footage_id \
                 left join jobs j on j.after_job = r.job_id and j.kind = 'views'",
                size = self.size()
            ),
            _ => format!(
                "select r.id, r.job_id, library_id, r.folder, r.params, r.summary, f.name, sample, \
                 {size} as size_bytes, r.pinned, r.used_ms, r.created_ms \
                 from {table} r join libraries l on l.id = library_id \
                 join footage f on f.id = footage_id",
                size = self.size()
            ),
        }
    }
}

/// Returns the SQL condition that the job with the alias `j` makes a data set of the library with this id.
pub(super) fn is_dataset_of(library: &str) -> String {
    format!(
        "j.kind = 'dataset' and upper(replace(json_extract(j.input, '$.library_ids'), '-', '')) \
         like '%' || hex({library}) || '%'"
    )
}

/// Returns the SQL of a [`ResourceFilter`] for data sets, which are made from several libraries.
fn of_any_library() -> String {
    let is_of = is_dataset_of("s.id");
    format!(
        "and exists (select 1 from jobs j join libraries s on {is_of} join footage o on o.id = s.footage_id \
         where j.id = r.job_id and ($4 is null or o.id = $4) and ($5 is null or s.id = $5) \
         and ($6 is null or lower(o.name) like lower($6) escape '\\')) and (sample or not $7)"
    )
}

impl Store {
    /// Changes properties of a resource together. Returns false if it does not exist or is not visible to the caller.
    pub async fn change(
        &self,
        kind: ResourceKind,
        id: Uuid,
        properties: &[Property<'_>],
        owners: &OwnerFilter,
    ) -> Result<bool, Error> {
        let mut transaction = self.begin().await?;
        let mut n_changed = 0;
        for property in properties {
            let column = match property {
                Property::Name(_) => "name",
                Property::Pinned(_) => "pinned",
                Property::PxPerCm(_) => "px_per_cm",
            };
            let table = kind.plural();
            let sql = format!(
                "update {table} set {column} = $2 where id = $1 and ($3 is null or owner = $3)"
            );
            let change = sql::query(sql).bind(id);
            let change = match *property {
                Property::Name(name) => change.bind(name),
                Property::Pinned(pinned) => change.bind(pinned),
                Property::PxPerCm(px_per_cm) => change.bind(px_per_cm),
            };
            let change = change.bind(owners.parameter());
            n_changed += change.execute(&mut transaction).await?;
        }
        transaction.commit().await?;
        Ok(n_changed > 0)
    }

    /// Records that a resource was used.
    pub async fn record_use(&self, kind: ResourceKind, id: Uuid, now_ms: i64) -> Result<(), Error> {
        let sql = format!("update {} set used_ms = $2 where id = $1", kind.plural());
        let update = sql::query(sql).bind(id).bind(now_ms);
        update.execute(&self.writer).await?;
        Ok(())
    }

    /// Returns the resource if it exists and is visible to the caller.
    pub async fn resource<R: Resource>(
        &self,
        id: Uuid,
        owners: &OwnerFilter,
    ) -> Result<Option<R::Row>, Error> {
        self.visible_row(&R::KIND.select(), "id", id, owners).await
    }

    /// Returns the newest resources with ids less than `before`, at most `limit`.
    pub async fn list_resources<R: Resource>(
        &self,
        limit: i64,
        before: Option<Uuid>,
        owners: &OwnerFilter,
    ) -> Result<Vec<R::Row>, Error> {
        let all = ResourceFilter::default();
        self.filtered_resources::<R>(&all, limit, before, owners)
            .await
    }

    /// Returns the newest of the resources that pass a filter, with ids less than `before`, at most `limit`.
    pub async fn filtered_resources<R: Resource>(
        &self,
        filter: &ResourceFilter,
        limit: i64,
        before: Option<Uuid>,
        owners: &OwnerFilter,
    ) -> Result<Vec<R::Row>, Error> {
        let (select, condition) = (R::KIND.select(), R::KIND.condition());
        let bind = |query: sql::Query| {
            query
                .bind(filter.footage_id)
                .bind(filter.library_id)
                .bind(filter.name_pattern().as_deref())
                .bind(filter.only_sample)
        };
        self.newest_visible_rows(&select, (limit, before), owners, (&condition, bind))
            .await
    }
}
