//! flockreel: one filmed animal in, a flock of it out.
//!
//! The map. Four rings; each may use the rings above it, never the ones below
//! (`tests/it/tidy.rs` checks it). Read in this order.

// Ring 1, values: no I/O, no clock, no logging, no async.
pub mod code; // every stable error code
pub mod cpu; // which vector instructions to use
pub mod footage; // what the algorithms ask of a video
pub mod geometry; // angles, rectangles, the pinhole camera
pub mod ids; // identifiers of stored things
pub mod library; // the value in the middle: poses, sprites, transitions, patches
pub mod order; // medians and percentiles
pub mod progress; // how far a computation is, and whether to go on
pub mod random; // counter-based random numbers
pub mod raster; // frames, images, masks, components, resampling, blending
pub mod scratch; // bytes put aside

// Ring 2, algorithms: one folder per job, command and API noun.
pub mod analysis; // footage -> library
pub mod fish; // poses -> virtual fish
pub mod flock; // library -> flock
pub mod formats; // values to bytes and back

// Ring 3, the outside world.
pub mod config;
pub mod logging; // lines on stderr
pub mod media; // ffmpeg behind its gate
pub mod store; // SQLite rows and blobs // every setting

// Ring 4, doors.
pub mod api; // HTTP
pub mod cli;
pub mod jobs; // the queue and its workers // the command line
