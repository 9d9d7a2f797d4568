//! Which cryptography the connections to buckets use. `ring` alone: the default of what speaks to buckets is a large
//! C library that takes minutes to build. (A database's own connections name theirs by themselves: sqlx's feature.)

use std::sync::Once;

/// Chooses `ring` for the TLS connections of this process; to be called before the first client is made. Calling it
/// again changes nothing, and a choice that the embedding program made before stays.
pub fn choose_cryptography() {
    static CHOSEN: Once = Once::new();
    CHOSEN.call_once(|| {
        let provider = rustls::crypto::ring::default_provider();
        if provider.install_default().is_err() {
            tracing::debug!("the cryptography of TLS was chosen before");
        }
    });
}
