//! Similar moments of a footage: distances between clips, transitions between similar clips, and the playback
//! graph that the transitions form (docs/explanation/algorithms.md, "Distances" and "Transitions and
//! playback").

pub mod distance;
mod group;
mod kernel;
pub mod playback;
pub mod transition;
