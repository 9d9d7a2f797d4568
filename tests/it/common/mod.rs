//! Test fixtures: a running service, films and pictures, and the service as a separate process.

pub(crate) mod app;
pub(crate) mod clip;
pub(crate) mod film;
pub(crate) mod pictures;
pub(crate) mod place;
pub(crate) mod process;
pub(crate) mod results;
pub(crate) mod substitute;
pub(crate) mod tus;

pub(crate) use app::TestApp;
pub(crate) use place::Place;

/// Returns an HTTP client. Installs the TLS provider first, because `Client::new()` needs one.
pub(crate) fn client() -> reqwest::Client {
    flockreel::store::tls::choose_cryptography();
    reqwest::Client::new()
}
