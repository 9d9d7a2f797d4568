//! Signed links: until a link expires, everyone who has it can read one file without a token
//! (docs/explanation/promises.md, "Owners are isolated"). A link shows a film to another person, or opens it
//! in another program.
//!
//! The signature is an HMAC-SHA-256 of expiry and path, cut to 128 bits so that links stay short (RFC 2104, section 5).
//! Its key is stored in the database.

use axum::http::{Method, Uri};
use uuid::Uuid;

use super::caller::Caller;
use crate::api::{AppState, Problem};
use crate::jobs::clock::now_ms;
use crate::store::blobs::hex;
use crate::store::tokens::secret::{hmac_sha256, is_same};

/// Bytes of a signature: half of the HMAC, the least that RFC 2104 advises.
const SIGNATURE_BYTES: usize = 16;

/// Returns the path with expiry and signature. The link is valid until `expires_s` (seconds since 1970).
pub fn signed(key: &[u8], path: &str, expires_s: i64) -> String {
    let signature = signature(key, path, expires_s);
    format!("{path}?expires={expires_s}&signature={signature}")
}

/// Returns the caller of a valid signed link, which can only read the path of the link. Returns `None` for a
/// request without a link, or with an invalid or expired one.
pub(super) async fn link_caller(
    state: &AppState,
    method: &Method,
    uri: &Uri,
) -> Result<Option<Caller>, Problem> {
    let Some((expires_s, given)) = uri.query().and_then(parse) else {
        return Ok(None);
    };
    if !matches!(*method, Method::GET | Method::HEAD) || expires_s <= now_ms() / 1000 {
        return Ok(None);
    }
    let key = state.context.store.signing_key().await?;
    let wanted = signature(&key, uri.path(), expires_s);
    if !is_same(given.as_bytes(), wanted.as_bytes()) {
        return Ok(None);
    }
    let Some(flock) = flock_of(uri.path()) else {
        return Ok(None);
    };
    let owner = state.context.store.owner_of_flock(flock).await?;
    Ok(owner.map(|owner| Caller::with_link(owner, uri.path())))
}

/// Returns the flock that a path belongs to.
fn flock_of(path: &str) -> Option<Uuid> {
    let (id, _) = path.strip_prefix("/v1/flocks/")?.split_once('/')?;
    id.parse().ok()
}

fn signature(key: &[u8], path: &str, expires_s: i64) -> String {
    let whole = hmac_sha256(key, format!("{expires_s} {path}").as_bytes());
    hex(&whole[..SIGNATURE_BYTES])
}

fn parse(query: &str) -> Option<(i64, &str)> {
    let value = |name| {
        let mut pairs = query.split('&').filter_map(|pair| pair.split_once('='));
        pairs.find(|(key, _)| *key == name).map(|(_, value)| value)
    };
    Some((value("expires")?.parse().ok()?, value("signature")?))
}
