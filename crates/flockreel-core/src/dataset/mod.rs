//! Plan of a labelled data set: many flocks of one or more libraries, each filmed by a camera of its own
//! (docs/explanation/algorithms.md, "Data sets").
//!
//! [`Plan::new`] draws for each flock its library, its parameters, its background and its camera ([`Look`]). All
//! of it follows from the seed and the number of the flock, so each flock can be made without the others.

mod dice; // random numbers of one flock
mod look; // light, blur and noise of one camera
mod params;
mod plan; // what each flock shows

pub use look::Look;
pub use params::{Backgrounds, Format, Params, Picture};
pub use plan::{Ground, Plan, Sequence, Split};
