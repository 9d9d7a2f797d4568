//! What tests arrange with: a real service on a port of its own, films, a service as a process.

pub(crate) mod app;
pub(crate) mod clip;
pub(crate) mod film;
pub(crate) mod pictures;
pub(crate) mod place;
pub(crate) mod process;

pub(crate) use app::TestApp;
pub(crate) use place::Place;

/// A client of the service. `Client::new()` alone would ask for cryptography that nobody has chosen yet.
pub(crate) fn client() -> reqwest::Client {
    flockreel::store::tls::choose_cryptography();
    reqwest::Client::new()
}
