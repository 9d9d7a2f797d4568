//! The authenticated sender of a request, the only source of the data that a handler may read and of the
//! account that it charges (docs/explanation/promises.md, "Owners are isolated").

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

use crate::api::{AppState, Problem};
use crate::jobs::clock::now_ms;
use crate::store::owners::{Account, Owner, OwnerFilter};
use crate::store::tokens::secret::Presented;
use crate::store::tokens::{Scope, Token};
use flockreel_core::code::Code;

/// The authenticated sender of a request. Every handler that reads or writes data of an owner takes it.
#[derive(Clone, Debug)]
pub(in crate::api) struct Caller {
    /// Owners whose data this request can access.
    pub owners: OwnerFilter,
    /// Owner and quota of everything that this request creates.
    pub account: Account,
    pub(super) scope: Scope,
    proof: Proof,
}

/// Credential of a caller. Long responses check it again while they run.
#[derive(Clone)]
pub(super) enum Proof {
    /// None: a local request.
    Nothing,
    /// A signed link.
    Link,
    /// A token.
    Token(Presented),
    /// The session cookie of a browser.
    Cookie(String),
}

impl std::fmt::Debug for Proof {
    /// Writes only the kind of credential, because secrets must not get into logs.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Proof::Nothing => "nothing",
            Proof::Link => "link",
            Proof::Token(_) => "token",
            Proof::Cookie(_) => "cookie",
        })
    }
}

impl Caller {
    /// Returns the caller of a local request without a token.
    pub(super) fn local() -> Caller {
        Caller {
            owners: OwnerFilter::One(Owner::local()),
            account: Account::local(),
            scope: Scope::Write,
            proof: Proof::Nothing,
        }
    }

    /// Returns the caller of a signed link to data of `owner`. The caller can only read. `link` has checked
    /// that the signature covers the path of the request.
    pub(super) fn with_link(owner: Owner, path: &str) -> Caller {
        Caller {
            owners: OwnerFilter::One(owner),
            account: Account {
                // Every link has limits of its own. A name with a slash belongs to no token.
                owner: Owner(format!("link {path}")),
                quota: Some(0),
            },
            scope: Scope::Read,
            proof: Proof::Link,
        }
    }

    /// Returns the caller who holds a token.
    pub(super) fn with_token(token: &Token, proof: Proof) -> Caller {
        Caller {
            owners: token.visible_owners(),
            account: token.account(),
            scope: token.scope,
            proof,
        }
    }

    /// Returns whether the caller may read the metrics of the service: a local request without a token, or an
    /// administrator.
    pub(in crate::api) fn is_operator(&self) -> bool {
        matches!(self.proof, Proof::Nothing) || self.scope == Scope::Admin
    }

    /// Returns whether the credential is still valid: the token has not expired or been revoked, and the
    /// session has not ended. Returns false if the store cannot tell.
    pub(in crate::api) async fn is_still_valid(&self, state: &AppState) -> bool {
        let store = &state.context.store;
        let token = match &self.proof {
            Proof::Nothing | Proof::Link => return true,
            Proof::Token(given) => store.token(given, now_ms()).await,
            Proof::Cookie(cookie) => store.token_of_session(cookie, now_ms()).await,
        };
        matches!(token, Ok(Some(_)))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Caller {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Caller, Problem> {
        let caller = parts.extensions.get::<Caller>().cloned();
        caller.ok_or_else(|| {
            tracing::error!("an open route requires a caller: the route table is wrong");
            Code::Internal.into()
        })
    }
}
