//! The short lane: small jobs do not wait behind huge ones (docs/explanation/promises.md, "Fair queue"). A process
//! with several workers keeps one of them for small jobs, and an owner's small jobs go before the others.

use super::analysis::Summary;
use super::{Context, Extent, JobInput, Subject};
use crate::store;
use crate::store::footage::Footage;
use crate::store::owners::OwnerFilter;
use crate::store::resources::Library;

/// Largest estimated cost of a small job, pixels: less than a minute on two cores. A flock of 20 individuals and 400
/// frames at 1920 x 1080 costs 0.9 billion with one file.
const MAX_SMALL_PX: f64 = 1e9;

impl Context {
    /// Returns whether the estimated cost of a job is small. A job whose subject does not exist yet is not.
    pub(super) async fn is_small<Input: JobInput>(
        &self,
        input: &Input,
    ) -> Result<bool, store::Error> {
        let extent = match input.subjects().first() {
            Some(subject) => self.extent_of(*subject).await?,
            None => None,
        };
        let cost_px = input.cost_px(extent);
        Ok(cost_px.is_some_and(|px| px <= MAX_SMALL_PX))
    }

    /// Returns the extent of a footage or library, if it exists.
    async fn extent_of(&self, subject: Subject) -> Result<Option<Extent>, store::Error> {
        let (store, owners) = (&self.store, &OwnerFilter::All);
        Ok(match subject {
            Subject::Footage(id) => {
                let row = store.resource::<Footage>(id.0, owners).await?;
                let side = |px: i64| u32::try_from(px).unwrap_or(u32::MAX);
                row.map(|row| Extent {
                    n_frames: usize::try_from(row.n_frames_hint).unwrap_or(usize::MAX),
                    image_size_px: [side(row.width), side(row.height)],
                })
            }
            Subject::Library(id) => {
                let row = store.resource::<Library>(id.0, owners).await?;
                let summary =
                    row.and_then(|row| serde_json::from_str::<Summary>(&row.summary).ok());
                summary.map(|library| Extent {
                    n_frames: library.n_frames,
                    image_size_px: library.image_size_px,
                })
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use flockreel_core::flock::Params;
    use flockreel_core::ids::LibraryId;

    use super::*;
    use crate::jobs::flock;

    /// Returns whether a flock of so many individuals and frames from a library of this size is small.
    fn is_small(count: u32, frames: u32, image_size_px: [u32; 2]) -> bool {
        let params = Params {
            count: Some(count),
            frames,
            ..Params::default()
        };
        let input = flock::Input {
            library_id: LibraryId(uuid::Uuid::nil()),
            params,
        };
        let library = Extent {
            n_frames: 1200,
            image_size_px,
        };
        input.cost_px(Some(library)).unwrap() <= MAX_SMALL_PX
    }

    #[test]
    fn a_flock_is_small_if_it_has_few_individuals_frames_and_pixels() {
        assert!(is_small(20, 400, [640, 480]));
        assert!(!is_small(2000, 400, [640, 480]), "many individuals");
        assert!(!is_small(20, 10_000, [640, 480]), "many frames");
        assert!(!is_small(20, 400, [3840, 2160]), "many pixels");
    }
}
