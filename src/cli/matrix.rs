//! To be written.

/// Arguments of `matrix`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Not there yet.
pub fn run(_args: Args) -> Result<Option<super::Summary>, super::Error> {
    Err(super::Error::Usage("not there yet: matrix".into()))
}
