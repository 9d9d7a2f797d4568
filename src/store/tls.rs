//! The cryptography library for TLS connections to buckets: `ring`. The default of the bucket client is a
//! large C library that takes minutes to build. Database connections select theirs by a feature of sqlx.

use std::sync::Once;

/// Selects `ring` for the TLS connections of this process. Must be called before the first client is created.
/// Further calls have no effect, and a choice made earlier by an embedding program is kept.
pub fn choose_cryptography() {
    static CHOSEN: Once = Once::new();
    CHOSEN.call_once(|| {
        let provider = rustls::crypto::ring::default_provider();
        if provider.install_default().is_err() {
            tracing::debug!("the TLS crypto provider was already installed");
        }
    });
}
