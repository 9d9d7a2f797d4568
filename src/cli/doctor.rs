//! `flockreel doctor`: checks whether this machine has everything that flockreel needs, and explains the
//! effect of each missing part. Exit status 0 if nothing is missing, else 1.

use std::fmt::Display;
use std::path::Path;

use serde_json::{Value, json};

use super::{Error, Summary};
use crate::config::{self, Config, Storage};
use crate::media::{self, Codecs};
use flockreel_core::cpu::Level;

/// Arguments of `doctor`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    storage: Storage,
}

/// Result of one check.
struct Finding {
    /// Stable name.
    name: String,
    /// Description of what was found.
    found: String,
    /// Effect of the missing part; `None` if nothing is missing.
    effect: Option<String>,
}

/// Runs all checks and prints their results. Fails if a part is missing.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    let mut findings = vec![Finding::ok("flockreel", env!("CARGO_PKG_VERSION"))];
    findings.extend(tools());
    findings.extend(sandbox());
    findings.extend(machine());
    findings.push(disk(&args.storage.data));
    let lines: Vec<String> = if json {
        vec![as_json(&findings).to_string()]
    } else {
        findings.iter().map(Finding::line).collect()
    };
    super::print_lines(&lines)?;
    match findings.iter().filter(|f| f.effect.is_some()).count() {
        0 => Ok(None),
        n_missing => Err(Error::MissingParts { n_missing }),
    }
}

fn tools() -> Vec<Finding> {
    let version = match media::tool_version() {
        Ok(version) => Finding::ok("ffmpeg", version),
        Err(error) => {
            let effect = "films cannot be read or written: install ffmpeg";
            return vec![Finding::missing("ffmpeg", error, effect)];
        }
    };
    match Codecs::installed() {
        Ok(codecs) => {
            let available = Finding::ok("codecs", codecs.available.join(" "));
            let missing = codecs.missing.into_iter();
            let missing = missing.map(|(name, effect)| Finding::missing(name, "missing", effect));
            [version, available].into_iter().chain(missing).collect()
        }
        Err(error) => {
            let effect = "the readable codecs are unknown";
            vec![version, Finding::missing("codecs", error, effect)]
        }
    }
}

fn sandbox() -> Vec<Finding> {
    // `tools` has already reported a missing tool.
    let Ok(sandbox) = media::sandbox_status() else {
        return Vec::new();
    };
    let layers = sandbox.layers.into_iter().map(|(layer, reason)| {
        let name = format!("sandbox.{}", layer.name());
        match reason {
            None => Finding::ok(name, "on"),
            Some(reason) => Finding::missing(name, format!("off: {reason}"), layer.meaning()),
        }
    });
    let version = sandbox.landlock_abi;
    let version = version.map_or("none".to_owned(), |abi| abi.to_string());
    let landlock = Finding::ok("landlock", format!("interface {version}"));
    layers.chain([landlock]).collect()
}

fn machine() -> [Finding; 2] {
    let level = Level::detect();
    let vectors = match level {
        Level::Scalar => {
            let effect = "computing distances takes several times as long";
            Finding::missing("vectors", level.name(), effect)
        }
        _ => Finding::ok("vectors", level.name()),
    };
    let (cores, workers) = (config::cores(), config::default_workers());
    let threads = config::threads_per_worker(workers);
    let found = format!("{cores}: {workers} jobs at once, {threads} threads each");
    [vectors, Finding::ok("cores", found)]
}

fn disk(data: &Path) -> Finding {
    let disk = match rustix::fs::statvfs(super::nearest_folder(data)) {
        Ok(disk) => disk,
        Err(error) => {
            let effect = "the free space of the data folder is unknown";
            return Finding::missing("disk", error, effect);
        }
    };
    let free_bytes = disk.f_bavail.saturating_mul(disk.f_frsize);
    let free_gib = free_bytes as f64 / f64::from(1 << 30);
    let found = format!("{free_gib:.1} GiB free for {}", data.display());
    if free_bytes < Config::DISK_RESERVE_BYTES {
        let effect = "uploads are refused until disk space is free";
        Finding::missing("disk", found, effect)
    } else {
        Finding::ok("disk", found)
    }
}

impl Finding {
    fn ok(name: impl Display, found: impl Display) -> Finding {
        Finding {
            name: name.to_string(),
            found: found.to_string(),
            effect: None,
        }
    }

    fn missing(name: impl Display, found: impl Display, effect: impl Into<String>) -> Finding {
        Finding {
            effect: Some(effect.into()),
            ..Finding::ok(name, found)
        }
    }

    fn line(&self) -> String {
        let (name, found) = (&self.name, &self.found);
        match &self.effect {
            None => format!("ok    {name}: {found}"),
            Some(effect) => format!("LACK  {name}: {found}; {effect}"),
        }
    }
}

fn as_json(findings: &[Finding]) -> Value {
    let all = findings.iter().map(
        |f| json!({"name": f.name, "found": f.found, "ok": f.effect.is_none(), "meaning": f.effect}),
    );
    json!({"ok": findings.iter().all(|f| f.effect.is_none()), "findings": all.collect::<Vec<_>>()})
}
