//! flockreel measures one filmed animal and makes a flock of it.
//!
//! The modules form four rings, listed here in reading order. A module may use its own ring and the rings
//! above it, never those below. `tests/it/tidy` checks the imports.

// Ring 1: values. No I/O, no clock, no logging, no async.
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

// Ring 3: the outside world.
pub mod config; // every setting
pub mod logging; // log lines on stderr
pub mod media; // ffmpeg in a sandbox
pub mod store; // database rows and stored files

// Ring 4: interfaces.
pub mod api; // HTTP
pub mod cli; // the command line
pub mod jobs; // the queue and its workers
