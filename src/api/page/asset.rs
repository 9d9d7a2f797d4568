//! Files of the page in memory: one copy of each, also of its compressed form, for all responses
//! (docs/explanation/promises.md, "Slow clients").

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

use axum::body::Body;
use axum::http::{HeaderMap, Response, header};
use axum::response::IntoResponse;
use bytes::Bytes;
use flate2::Compression;
use flate2::write::GzEncoder;
use rust_embed::EmbeddedFile;
use sha2::{Digest, Sha256};

use super::{media_type, tagged};
use crate::api::download::compression::{accepts_gzip, is_compressed};
use crate::store::blobs::hex;

/// The assets that were asked for, by path. A debug build reads the files again, and replaces those that changed.
static ASSETS: LazyLock<Mutex<HashMap<String, Arc<Asset>>>> = LazyLock::new(Mutex::default);

/// A file of the page.
#[derive(Debug)]
pub(super) struct Asset {
    /// Content.
    pub(super) bytes: Bytes,
    /// Content compressed by gzip, if that is of use.
    gzip: Option<Bytes>,
    media_type: &'static str,
    etag: String,
}

impl Asset {
    /// Returns the only copy of an embedded file.
    pub(super) fn of(path: &str, file: EmbeddedFile) -> Arc<Asset> {
        let etag = format!("\"{}\"", hex(&file.metadata.sha256_hash()));
        let mut assets = ASSETS.lock().unwrap_or_else(PoisonError::into_inner);
        match assets.get(path) {
            Some(known) if known.etag == etag => known.clone(),
            _ => {
                let asset = Arc::new(Asset::new(path, file.data, etag));
                assets.insert(path.to_owned(), asset.clone());
                asset
            }
        }
    }

    /// Returns an asset whose content never changes.
    pub(super) fn fixed(path: &str, data: Cow<'static, [u8]>) -> Asset {
        let etag = format!("\"{}\"", hex(&Sha256::digest(&data)));
        Asset::new(path, data, etag)
    }

    fn new(path: &str, data: Cow<'static, [u8]>, etag: String) -> Asset {
        let bytes = match data {
            Cow::Borrowed(bytes) => Bytes::from_static(bytes),
            Cow::Owned(bytes) => Bytes::from(bytes),
        };
        let media_type = media_type(path);
        let gzip = is_compressed(media_type).then(|| gzipped(&bytes).ok());
        Asset {
            gzip: gzip.flatten().filter(|gzip| gzip.len() < bytes.len()),
            bytes,
            media_type,
            etag,
        }
    }

    /// Returns the response to a request with these headers.
    pub(super) fn answer(&self, headers: &HeaderMap) -> Response<Body> {
        tagged(headers, &self.etag, || {
            let media_type = [(header::CONTENT_TYPE, self.media_type)];
            match &self.gzip {
                Some(gzip) if accepts_gzip(headers) => {
                    let coding = [
                        (header::CONTENT_ENCODING, "gzip"),
                        (header::VARY, "accept-encoding"),
                    ];
                    (media_type, coding, gzip.clone()).into_response()
                }
                _ => (media_type, self.bytes.clone()).into_response(),
            }
        })
    }
}

fn gzipped(bytes: &[u8]) -> io::Result<Bytes> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?.into())
}
