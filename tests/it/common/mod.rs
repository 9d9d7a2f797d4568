//! What tests arrange with: a real service on a port of its own, films, a service as a process.

pub mod app;
pub mod clip;
pub mod film;
pub mod process;

pub use app::TestApp;
