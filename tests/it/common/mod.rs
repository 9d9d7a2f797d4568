//! What several doors' tests need.

pub(crate) mod film;
