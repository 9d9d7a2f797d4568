//! flockreel as a service and a command line: films in, libraries, flocks and virtual fish out. The
//! algorithms are in `flockreel_core`.
//!
//! The modules form two rings, listed here in reading order. A module may use its own ring and the ring
//! above it, never the one below. `tests/it/tidy` checks the imports.

// Ring 3: the outside world.
pub mod config; // every setting
pub mod logging; // log lines on stderr
pub mod media; // ffmpeg in a sandbox
pub mod store; // database rows and stored files
pub mod traces; // spans for a collector of OpenTelemetry

// Ring 4: interfaces.
pub mod api; // HTTP
pub mod cli; // the command line
pub mod jobs; // the queue and its workers
