//! Short signed links: whoever holds one may fetch that one file until it ends, without a token, so that
//! a film can be shown to somebody else or opened by another program (RELIABILITY.md, S6). The signature
//! covers the path and the end; the key is this data folder's own.

use axum::http::{Method, Uri};
use uuid::Uuid;

use super::Caller;
use crate::api::{AppState, Problem};
use crate::jobs::clock::now_ms;
use crate::store::blobs::hex;
use crate::store::tokens::secret::{hmac_sha256, is_same};

/// The path with its signature, good until `expires_s` (seconds since 1970).
pub fn signed(key: &[u8], path: &str, expires_s: i64) -> String {
    let signature = signature(key, path, expires_s);
    format!("{path}?expires={expires_s}&signature={signature}")
}

/// The caller that a good link stands for: it reads, and its path is the only one it is good for.
pub(super) async fn caller_of_link(
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
    Ok(owner.map(Caller::of_link))
}

/// The flock whose file the path is.
fn flock_of(path: &str) -> Option<Uuid> {
    let (id, _) = path.strip_prefix("/v1/flocks/")?.split_once('/')?;
    id.parse().ok()
}

fn signature(key: &[u8], path: &str, expires_s: i64) -> String {
    hex(&hmac_sha256(key, format!("{expires_s} {path}").as_bytes()))
}

fn parse(query: &str) -> Option<(i64, &str)> {
    let value = |name| {
        let mut pairs = query.split('&').filter_map(|pair| pair.split_once('='));
        pairs.find(|(key, _)| *key == name).map(|(_, value)| value)
    };
    Some((value("expires")?.parse().ok()?, value("signature")?))
}
