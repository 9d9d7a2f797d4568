//! Algorithms and file formats of flockreel: measures one filmed animal and makes a flock and a virtual fish
//! of it. No I/O except in `formats::library_dir`, no clock, no logging, no async.
//!
//! The modules form two rings, listed here in reading order. A module may use its own ring and the ring
//! above it. `tests/it/tidy` checks the imports.
//!
//! A video is any [`footage::FrameSource`]. [`analysis::analyze`] makes a [`library::Library`] of it,
//! [`flock::plan_flock`] a flock of the library, and [`fish::drive()`] the motion of a virtual fish.

// Ring 1: values.
pub mod code; // every stable error code
pub mod cpu; // which vector instructions to use
pub mod footage; // the video interface that the algorithms read
pub mod geometry; // angles, rectangles, the pinhole camera
pub mod ids; // identifiers of stored things
pub mod library; // result of an analysis: poses, sprites, transitions, patches
pub mod order; // medians and percentiles
pub mod parameters; // limits and presets of parameters, and their check
pub mod progress; // progress reports and cancellation
pub mod random; // counter-based random numbers
pub mod raster; // frames, images, masks, components, resampling, blending
pub mod scratch; // temporary storage for large intermediate data

// Ring 2: algorithms. One folder for each job, command and API noun.
pub mod analysis; // footage -> library
pub mod fish; // poses -> virtual fish
pub mod flock; // library -> flock
pub mod formats; // values to bytes and back

// A plan over several flocks, which also knows their formats.
pub mod dataset; // libraries -> plan of a labelled data set
