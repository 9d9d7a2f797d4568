//! `flockreel token`: creates, lists and revokes access tokens
//! (docs/explanation/promises.md, "Owners are isolated").
//!
//! The command writes to the database directly, even while a service runs. Changes take effect with the next
//! request. A new token is printed to stdout once.

use clap::Subcommand;
use clap::builder::PossibleValuesParser;
use serde_json::{Value, json};

use super::{Error, Summary, say};
use crate::config::Storage;
use crate::jobs::clock::now_ms;
use crate::store::Store;
use crate::store::owners::Owner;
use crate::store::tokens::{NewToken, Scope, Token};

/// Arguments of `token`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Create a token and print it. It cannot be shown again.
    Create(CreateArgs),
    /// List all tokens, without their secrets.
    List,
    /// Revoke a token and end the browser sessions that use it.
    Revoke {
        /// Id of the token: the part between the underscores. The whole token is accepted too.
        id: String,
    },
}

#[derive(Debug, clap::Args)]
struct CreateArgs {
    /// Name of the token, for people.
    #[arg(long)]
    name: String,
    /// Permissions: `read` only reads, `write` also creates and deletes, `admin` does both for the data of
    /// all owners.
    #[arg(long, default_value = "write",
        value_parser = PossibleValuesParser::new(Scope::ALL.map(Scope::name)))]
    scope: String,
    /// Lifetime of the token, such as 30d, 12h or 90m. Default: unlimited.
    #[arg(long, value_parser = duration_ms, value_name = "TIME")]
    expires: Option<i64>,
    /// Maximum number of jobs of the owner that are queued or running at once.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(i64).range(0..), value_name = "N")]
    quota: i64,
    /// Owner whose data the token accesses: the id of another token, to share its data or to replace it, or
    /// `local` for data that was created without a token. Default: a new owner without data.
    #[arg(long, value_name = "ID")]
    owner: Option<String>,
}

/// Creates, lists or revokes tokens. The result is one line of JSON with `json`, else plain lines.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    super::runtime()?.block_on(async {
        let store = Store::open_beside(args.storage).await?;
        let result = match args.action {
            Action::Create(args) => create(&store, args).await,
            Action::List => list(&store).await,
            Action::Revoke { id } => revoke(&store, &id).await,
        };
        store.close().await;
        let result = result?;
        if !json {
            super::print_lines(&lines(&result))?;
        }
        Ok(json.then_some(Summary(result)))
    })
}

/// Returns a new token, or one line per token of a list.
fn lines(result: &Value) -> Vec<String> {
    match result {
        Value::Array(tokens) => tokens.iter().map(line).collect(),
        result => result["token"]
            .as_str()
            .map(str::to_owned)
            .into_iter()
            .collect(),
    }
}

fn line(token: &Value) -> String {
    let text = |name: &str| token[name].as_str().unwrap_or_default();
    let (id, scope, name) = (text("id"), text("scope"), text("name"));
    let state = if token["good"] == true {
        "good"
    } else {
        "ended"
    };
    let quota = &token["quota"];
    format!("{id}  {state:5}  {scope:5}  {quota:>5}  {name}")
}

async fn create(store: &Store, args: CreateArgs) -> Result<Value, Error> {
    let now_ms = now_ms();
    let scope = Scope::from_name(&args.scope)
        .ok_or_else(|| Error::Usage(format!("no such scope: {}", args.scope)))?;
    let new = NewToken {
        name: args.name,
        owner: args.owner.map(Owner),
        scope,
        quota: args.quota,
        expires_ms: args
            .expires
            .map(|lifetime_ms| now_ms.saturating_add(lifetime_ms)),
    };
    let (token, text) = store.add_token(&new, now_ms).await?;
    say("flockreel: store this token, it is not shown again");
    let mut value = to_json(&token);
    value["token"] = json!(text);
    Ok(value)
}

async fn list(store: &Store) -> Result<Value, Error> {
    let tokens = store.list_tokens().await?;
    Ok(tokens.iter().map(to_json).collect())
}

async fn revoke(store: &Store, id: &str) -> Result<Value, Error> {
    // The whole token is accepted in place of its id.
    let id = id.strip_prefix("frl_").unwrap_or(id);
    let id = id.split('_').next().unwrap_or(id);
    if store.revoke_token(id, now_ms()).await? {
        Ok(json!({"id": id, "revoked": true}))
    } else {
        Err(Error::Usage(format!(
            "no token with this id can be revoked: {id}"
        )))
    }
}

fn to_json(token: &Token) -> Value {
    json!({
        "id": token.id,
        "name": token.name,
        "owner": token.owner.0,
        "scope": token.scope.name(),
        "quota": token.quota,
        "created_ms": token.created_ms,
        "expires_ms": token.expires_ms,
        "revoked_ms": token.revoked_ms,
        "good": token.is_valid(now_ms()),
    })
}

/// Parses a whole number of days, hours or minutes, such as `30d`. Returns milliseconds, > 0.
fn duration_ms(text: &str) -> Result<i64, String> {
    let wrong = || "the duration must be a whole number with d, h or m, such as 30d".to_owned();
    let unit = text.chars().next_back().ok_or_else(wrong)?;
    let minutes = match unit {
        'd' => 24 * 60,
        'h' => 60,
        'm' => 1,
        _ => return Err(wrong()),
    };
    let count: i64 = text[..text.len() - 1]
        .parse()
        .map_err(|_not_a_number| wrong())?;
    let lifetime_ms = count.checked_mul(minutes * 60_000).ok_or_else(wrong)?;
    (count > 0).then_some(lifetime_ms).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::duration_ms;

    #[test]
    fn duration_is_a_number_of_days_hours_or_minutes() {
        assert_eq!(duration_ms("30d"), Ok(30 * 86_400_000));
        assert_eq!(duration_ms("12h"), Ok(43_200_000));
        assert_eq!(duration_ms("1m"), Ok(60_000));
        for wrong in [
            "",
            "d",
            "30",
            "-1d",
            "0d",
            "1w",
            "1.5d",
            "99999999999999999d",
            "3é",
        ] {
            assert!(duration_ms(wrong).is_err(), "{wrong}");
        }
    }
}
