//! Shell scripts in place of `flockreel attempt`. They make results without decoding or computing anything, and end
//! in ways in which a computation seldom ends.

use std::path::PathBuf;

use flockreel::jobs::Context;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

/// Sets `$folder` to the folder of the attempt.
const BEGIN: &str = "for folder; do :; done; ";

/// A command that runs until the attempt is asked to stop.
pub(crate) const UNTIL_STOPPED: &str = "cat >/dev/null; ";

/// Returns a context whose attempts run these shell commands after reading the order. `$folder` is the folder of the
/// attempt.
pub(crate) fn with_script(context: &Context, commands: &str) -> Context {
    with_program(context, &format!("read -r order; {commands}"))
}

/// Like [`with_script`], but the order is left on stdin for a program among the commands.
pub(crate) fn with_program(context: &Context, commands: &str) -> Context {
    let arguments = ["-c", &format!("{BEGIN}{commands}"), "sh"];
    let arguments = arguments.map(Into::into).to_vec();
    Context {
        attempt_program: (PathBuf::from("/bin/sh"), arguments),
        ..context.clone()
    }
}

/// Returns commands that make a result of these files. Names and contents have no quotation mark.
pub(crate) fn done(files: &[(&str, &str)], summary: &Value) -> String {
    let write =
        |(name, content): &(&str, &str)| format!("printf %s '{content}' >\"$folder/{name}\"; ");
    let described = files.iter().map(|(name, content)| {
        let sha256 = Sha256::digest(content).to_vec();
        json!({"name": name, "size_bytes": content.len(), "sha256": sha256})
    });
    let product = json!({"film": null, "params": "{}", "summary": summary.to_string()});
    let described: Vec<Value> = described.collect();
    let end = end(&json!({"done": [product, described]}));
    files.iter().map(write).collect::<String>() + &end
}

/// Returns a command that fails with this code.
pub(crate) fn failed(code: &str, is_transient: bool) -> String {
    let failure =
        json!({"code": code, "sentence": "why", "is_transient": is_transient, "mends": []});
    end(&json!({"failed": failure}))
}

/// Returns commands that wait until a file exists.
pub(crate) fn until_exists(file: &std::path::Path) -> String {
    format!("while [ ! -e '{}' ]; do sleep 0.02; done; ", file.display())
}

fn end(end: &Value) -> String {
    let message = json!({ "end": end });
    format!("printf '%s\\n' '{message}'; ")
}
