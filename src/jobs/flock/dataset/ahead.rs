//! Estimated size of a data set and a sheet of samples, made while a client waits.

use super::job::SHEET_QUALITY;
use super::{Dataset, Estimate};
use crate::jobs::synchronous::compute;
use crate::jobs::{Context, Error};
use crate::store::owners::Owner;
use crate::store::resources::Library;
use flockreel_core::dataset::Params;
use flockreel_core::formats::library_dir::StoredLibrary;
use flockreel_core::formats::picture;

/// Estimates the size of a data set.
pub async fn estimate(
    context: &Context,
    owner: &Owner,
    libraries: &[Library],
    params: Params,
) -> Result<Estimate, Error> {
    compute(context, owner, libraries, |stored, _, cancellation| {
        Ok(dataset(params, stored)?.estimate(cancellation)?)
    })
    .await
}

/// Returns the sheet of samples of a data set, JPEG.
pub async fn sheet(
    context: &Context,
    owner: &Owner,
    libraries: &[Library],
    params: Params,
) -> Result<Vec<u8>, Error> {
    compute(context, owner, libraries, |stored, _, cancellation| {
        let sheet = dataset(params, stored)?.sheet(cancellation)?;
        Ok(picture::write_jpeg_of(&sheet, SHEET_QUALITY))
    })
    .await
}

fn dataset(params: Params, stored: Vec<StoredLibrary>) -> Result<Dataset, Error> {
    let libraries = stored.into_iter().map(|stored| stored.library).collect();
    let dataset = Dataset::new(params, libraries, Vec::new());
    Ok(dataset.map_err(std::io::Error::other)?)
}
