//! Limits of space (docs/explanation/promises.md, "Limited space"): the bytes of each owner, and the free disk.
//!
//! Against the limit of its owner, an upload counts with its announced size from its beginning: a resumable one by its
//! row, and the body of a request by an [`Announced`] in memory. The transaction that stores files checks the limit again,
//! with the true size. Announced bytes take nothing from the disk: an upload must fit when it begins, and the disk is
//! checked again while it arrives. Otherwise one announcement would refuse the uploads of all others.

use std::collections::HashMap;
use std::io::ErrorKind;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sqlx::types::Uuid;

use super::owners::Owner;
use super::resources::ResourceKind;
use super::{Error, Store, Transaction, sql};

/// The limits of a store. By default there are none.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpaceLimits {
    /// Maximum total size of the files and open uploads of one owner, bytes; 0 sets no limit.
    pub max_owner_bytes: u64,
    /// Maximum number of open resumable uploads of one owner; 0 sets no limit.
    pub max_owner_uploads: i64,
    /// Disk space that uploads leave free, bytes.
    pub disk_reserve_bytes: u64,
}

/// The limits, and the bodies of requests that are being received. Clones share the bodies.
#[derive(Clone, Debug, Default)]
pub(super) struct Space {
    limits: SpaceLimits,
    incoming: Arc<Mutex<Incoming>>,
    refusals: Arc<Refusals>,
}

/// Announced bytes of the bodies that are being received, by owner.
type Incoming = HashMap<Owner, u64>;

#[derive(Debug, Default)]
struct Refusals {
    by_owner: AtomicU64,
    by_disk: AtomicU64,
}

/// The body of a request. It counts as announced until it is dropped.
pub struct Announced {
    store: Store,
    owner: Owner,
    n_bytes: u64,
    /// Announced bytes that have not arrived.
    n_left: u64,
}

/// How received files count before their footage does.
pub enum Counted {
    /// As the body of a request.
    Body(Announced),
    /// As a resumable upload with this id.
    Upload(Uuid),
}

/// A number of things and their total size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, sqlx::FromRow)]
pub struct Amount {
    /// Number.
    pub n: i64,
    /// Total size, bytes.
    pub n_bytes: i64,
}

/// Space of an owner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Usage {
    /// Stored resources by kind.
    pub stored: [(ResourceKind, Amount); 6],
    /// Open resumable uploads, with their announced sizes.
    pub uploads: Amount,
    /// Announced size of the bodies of requests that are being received, bytes.
    pub incoming_bytes: i64,
    /// Maximum of all these bytes together; `None` = no limit.
    pub max_bytes: Option<u64>,
}

impl Usage {
    /// Returns the bytes that count against the limit.
    pub fn used_bytes(&self) -> i64 {
        let stored = self.stored.iter().map(|(_, amount)| amount.n_bytes);
        stored.sum::<i64>() + self.uploads.n_bytes + self.incoming_bytes
    }
}

impl Store {
    /// Returns the store with these limits. Clones made before have none.
    pub fn with_space_limits(mut self, limits: SpaceLimits) -> Store {
        self.space.limits = limits;
        self
    }

    /// Announces a body of `n_bytes`. If its size is unknown, `n_bytes` is 0, and the announcement grows with the body.
    /// Fails with [`Error::OwnerStorageFull`] or `storage_full` if the body does not fit.
    pub async fn announce(&self, owner: &Owner, n_bytes: u64) -> Result<Announced, Error> {
        let mut announced = Announced {
            store: self.clone(),
            owner: owner.clone(),
            n_bytes: 0,
            n_left: 0,
        };
        self.check_disk(n_bytes)?;
        announced.grow(n_bytes).await?;
        announced.n_left = n_bytes;
        Ok(announced)
    }

    /// Fails with [`Error::OwnerStorageFull`] if the owner can store nothing more.
    pub async fn require_space_left(&self, owner: &Owner) -> Result<(), Error> {
        if self.space.max_owner_bytes().is_none() {
            return Ok(());
        }
        let used_bytes: i64 = owner_bytes(owner, None).fetch_one(&self.reader).await?;
        self.space.check_owner(used_bytes.unsigned_abs(), 1)
    }

    /// Fails with [`Error::OwnerStorageFull`] or `storage_full` if a result of `n_bytes` would not fit. The files are in a
    /// bucket or on the disk, which holds only a part of them at a time in the first case.
    pub async fn require_result_space(&self, owner: &Owner, n_bytes: u64) -> Result<(), Error> {
        let used_bytes: i64 = owner_bytes(owner, None).fetch_one(&self.reader).await?;
        let used_bytes = used_bytes.unsigned_abs() + self.space.announced_bytes(owner);
        self.space.check_owner(used_bytes, n_bytes)?;
        if self.blobs.are_in_bucket() {
            return Ok(());
        }
        self.check_disk(n_bytes)
    }

    /// Fails with `storage_full` if `n_bytes` more would use the reserve of the disk.
    pub fn check_disk(&self, n_bytes: u64) -> Result<(), Error> {
        self.require_free(n_bytes.saturating_add(self.space.limits.disk_reserve_bytes))
    }

    /// Fails with `storage_full` if the disk has less than `n_bytes` free.
    pub fn require_free(&self, n_bytes: u64) -> Result<(), Error> {
        if n_bytes > self.blobs.free_bytes()? {
            self.space.refusals.by_disk.fetch_add(1, Ordering::Relaxed);
            return Err(Error::Io(ErrorKind::StorageFull.into()));
        }
        Ok(())
    }

    /// Returns the space of an owner.
    pub async fn usage(&self, owner: &Owner) -> Result<Usage, Error> {
        let amount = async |rows: &str| {
            let sql = format!(
                "select count(*) as n, cast(coalesce(sum(size_bytes), 0) as bigint) as n_bytes \
                 from {rows} owner = $1"
            );
            let amount = sql::query(sql).bind(owner);
            amount.fetch_one::<Amount>(&self.reader).await
        };
        let mut stored = ResourceKind::ALL.map(|kind| (kind, Amount::default()));
        for (kind, found) in &mut stored {
            *found = amount(&format!("{} where", kind.plural())).await?;
            if *kind == ResourceKind::Dataset {
                found.n_bytes += amount("job_parts where").await?.n_bytes;
            }
        }
        Ok(Usage {
            stored,
            uploads: amount("uploads where footage_id is null and").await?,
            incoming_bytes: self.space.announced_bytes(owner).cast_signed(),
            max_bytes: self.space.max_owner_bytes(),
        })
    }

    /// Returns how many uploads and results the limits of owners, and the free disk, have refused in this process.
    pub fn n_refusals(&self) -> [u64; 2] {
        let refusals = &self.space.refusals;
        [&refusals.by_owner, &refusals.by_disk].map(|n| n.load(Ordering::Relaxed))
    }

    /// Returns the announced size of all bodies that are being received, bytes.
    pub(super) fn incoming_bytes(&self) -> u64 {
        self.space.incoming().values().sum()
    }

    /// Fails with [`Error::OwnerStorageFull`] if the owner cannot have `n_bytes` more. `instead_of` is an upload that
    /// does not count, because these bytes replace it. The result holds until the end of the transaction.
    pub(super) async fn require_owner_space(
        &self,
        transaction: &mut Transaction,
        owner: &Owner,
        n_bytes: i64,
        instead_of: Option<Uuid>,
    ) -> Result<(), Error> {
        if self.space.max_owner_bytes().is_none() {
            return Ok(());
        }
        lock_space(transaction, owner).await?;
        let used_bytes: i64 = owner_bytes(owner, instead_of)
            .fetch_one(transaction)
            .await?;
        let (used_bytes, n_bytes) = (used_bytes.unsigned_abs(), n_bytes.unsigned_abs());
        self.space.check_owner(used_bytes, n_bytes)
    }

    /// Fails with [`Error::OwnerStorageFull`] or [`Error::TooManyUploads`] if the owner cannot begin a resumable upload of
    /// `n_bytes`, and with `storage_full` if the disk has no space for it. The limits of the owner hold until the end of
    /// the transaction.
    pub(super) async fn require_upload_space(
        &self,
        transaction: &mut Transaction,
        owner: &Owner,
        n_bytes: u64,
    ) -> Result<(), Error> {
        self.check_disk(n_bytes)?;
        lock_space(transaction, owner).await?;
        let used_bytes: i64 = owner_bytes(owner, None)
            .fetch_one(&mut *transaction)
            .await?;
        let incoming_bytes = self.space.announced_bytes(owner);
        self.space
            .check_owner(used_bytes.unsigned_abs() + incoming_bytes, n_bytes)?;
        let sql = "select count(*) from uploads where owner = $1 and footage_id is null";
        let count = sql::query_scalar(sql).bind(owner);
        let n_uploads: i64 = count.fetch_one(&mut *transaction).await?;
        let max_uploads = self.space.limits.max_owner_uploads;
        if max_uploads > 0 && n_uploads >= max_uploads {
            return Err(Error::TooManyUploads { max_uploads });
        }
        Ok(())
    }
}

impl Space {
    fn incoming(&self) -> MutexGuard<'_, Incoming> {
        self.incoming.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the announced size of the bodies of an owner, bytes.
    fn announced_bytes(&self, owner: &Owner) -> u64 {
        self.incoming().get(owner).copied().unwrap_or(0)
    }

    fn max_owner_bytes(&self) -> Option<u64> {
        Some(self.limits.max_owner_bytes).filter(|max_bytes| *max_bytes > 0)
    }

    fn check_owner(&self, used_bytes: u64, n_bytes: u64) -> Result<(), Error> {
        match self.max_owner_bytes() {
            Some(max_bytes) if used_bytes.saturating_add(n_bytes) > max_bytes => {
                self.refusals.by_owner.fetch_add(1, Ordering::Relaxed);
                Err(Error::OwnerStorageFull {
                    used_bytes,
                    n_bytes,
                    max_bytes,
                })
            }
            _ => Ok(()),
        }
    }
}

impl Announced {
    /// Counts `n_bytes` that have arrived. Fails if there is no space for more.
    pub async fn receive(&mut self, n_bytes: u64) -> Result<(), Error> {
        self.store.check_disk(0)?;
        let n_announced = n_bytes.min(self.n_left);
        if n_announced < n_bytes {
            self.grow(n_bytes - n_announced).await?;
        }
        self.n_left -= n_announced;
        Ok(())
    }

    /// Announces `n_bytes` more.
    async fn grow(&mut self, n_bytes: u64) -> Result<(), Error> {
        let store = &self.store;
        let used_bytes = owner_bytes(&self.owner, None).fetch_one(&store.reader);
        let used_bytes: i64 = used_bytes.await?;
        // Counted and added under one lock, so that simultaneous bodies do not exceed the limit.
        let mut incoming = store.space.incoming();
        let announced_bytes = incoming.entry(self.owner.clone()).or_default();
        let used_bytes = used_bytes.unsigned_abs() + *announced_bytes;
        store.space.check_owner(used_bytes, n_bytes)?;
        *announced_bytes += n_bytes;
        drop(incoming);
        self.n_bytes += n_bytes;
        Ok(())
    }
}

impl Drop for Announced {
    fn drop(&mut self) {
        let mut incoming = self.store.space.incoming();
        let announced_bytes = incoming.entry(self.owner.clone()).or_default();
        *announced_bytes -= self.n_bytes;
        if *announced_bytes == 0 {
            incoming.remove(&self.owner);
        }
    }
}

impl Counted {
    /// Returns the id of the resumable upload, if it is one.
    pub fn upload(&self) -> Option<Uuid> {
        match self {
            Counted::Body(_) => None,
            Counted::Upload(id) => Some(*id),
        }
    }
}

/// Takes the lock of transactions that compare the bytes of this owner with their limit.
async fn lock_space(transaction: &mut Transaction, owner: &Owner) -> Result<(), sqlx::Error> {
    transaction.lock(&format!("space of {}", owner.0)).await
}

/// Returns the query for the bytes of an owner: stored files, and open uploads except `but`.
fn owner_bytes(owner: &Owner, but: Option<Uuid>) -> sql::ScalarQuery {
    let stored = ResourceKind::ALL.map(|kind| {
        let table = kind.plural();
        format!("select size_bytes from {table} where owner = $1 union all ")
    });
    let sql = format!(
        "select cast(coalesce(sum(size_bytes), 0) as bigint) from ({}\
         select size_bytes from job_parts where owner = $1 union all \
         select size_bytes from uploads where owner = $1 and footage_id is null and ($2 is null or id <> $2)) s",
        stored.concat()
    );
    sql::query_scalar(sql).bind(owner).bind(but)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::fresh;
    use crate::store::uploads::Upload;

    fn upload() -> Upload {
        Upload {
            id: Uuid::now_v7(),
            owner: Owner::local(),
            name: String::new(),
            size_bytes: 1,
            offset_bytes: 0,
            footage_id: None,
            expires_ms: i64::MAX,
        }
    }

    #[tokio::test]
    async fn owner_may_have_a_limited_number_of_open_uploads() {
        let data = tempfile::tempdir().unwrap();
        let store = fresh::open(data.path()).await;
        let store = store.with_space_limits(SpaceLimits {
            max_owner_uploads: 2,
            ..SpaceLimits::default()
        });
        let (first, second) = (upload(), upload());
        for upload in [&first, &second] {
            store.create_upload(upload).await.unwrap();
        }
        let refused = store.create_upload(&upload()).await.unwrap_err();
        assert!(matches!(refused, Error::TooManyUploads { max_uploads: 2 }));
        store
            .create_upload(&Upload {
                owner: Owner("other".into()),
                ..upload()
            })
            .await
            .unwrap();
        store.finish_upload(&first, Uuid::now_v7()).await.unwrap();
        store.create_upload(&upload()).await.unwrap();
        let files = std::fs::read_dir(data.path().join("uploads")).unwrap();
        let is_right = store.blobs.are_in_bucket() || files.count() == 3;
        assert!(is_right, "a refused upload left its file");
    }
}
