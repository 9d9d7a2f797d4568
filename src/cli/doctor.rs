//! `flockreel doctor`: checks whether this machine has everything that flockreel needs, and explains the
//! effect of each missing part. Exit status 0 if nothing is missing, else 1.

use std::path::Path;

use serde_json::{Value, json};

use super::{Error, Summary};
use crate::config::{self, Config, Storage};
use crate::cpu::Level;
use crate::media::{self, Coders};

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
    lack: Option<String>,
}

/// Runs all checks and prints their results. Fails if a part is missing.
pub fn run(args: Args, json: bool) -> Result<Option<Summary>, Error> {
    let mut findings = vec![finding("flockreel", env!("CARGO_PKG_VERSION"), None)];
    tools(&mut findings);
    walls(&mut findings);
    machine(&mut findings);
    findings.push(disk(&args.storage.data));
    let n_lacks = findings.iter().filter(|f| f.lack.is_some()).count();
    let lines: Vec<String> = match json {
        true => vec![as_json(&findings).to_string()],
        false => findings.iter().map(Finding::line).collect(),
    };
    super::print_lines(&lines).map_err(Error::io("cannot write to stdout"))?;
    match n_lacks {
        0 => Ok(None),
        n_lacks => Err(Error::Lacks { n_lacks }),
    }
}

fn tools(findings: &mut Vec<Finding>) {
    match media::tool_version() {
        Ok(version) => findings.push(finding("ffmpeg", &version, None)),
        Err(error) => {
            let meaning = "films cannot be read or written: install ffmpeg";
            findings.push(finding("ffmpeg", &error.to_string(), Some(meaning)));
            return;
        }
    }
    match Coders::installed() {
        Ok(coders) => {
            findings.push(finding("codecs", &coders.has.join(" "), None));
            let lacks = coders.lacks.iter();
            findings.extend(lacks.map(|(name, meaning)| finding(name, "missing", Some(meaning))));
        }
        Err(error) => {
            let meaning = "the readable codecs are unknown";
            findings.push(finding("codecs", &error.to_string(), Some(meaning)));
        }
    }
}

fn walls(findings: &mut Vec<Finding>) {
    // `tools` has already reported a missing tool.
    let Ok(walls) = media::walls() else { return };
    for (layer, lack) in &walls.layers {
        let name = format!("sandbox.{}", layer.name());
        findings.push(match lack {
            None => finding(&name, "on", None),
            Some(reason) => finding(&name, &format!("off: {reason}"), Some(layer.meaning())),
        });
    }
    let version = walls
        .landlock_abi
        .map_or("none".to_owned(), |abi| abi.to_string());
    findings.push(finding("landlock", &format!("interface {version}"), None));
}

fn machine(findings: &mut Vec<Finding>) {
    let level = Level::detect();
    let slow =
        (level == Level::Scalar).then_some("computing distances takes several times as long");
    findings.push(finding("vectors", level.name(), slow));
    let workers = config::default_workers();
    let threads = config::threads_per_worker(workers);
    let cores = format!(
        "{}: {workers} jobs at once, {threads} threads each",
        config::cores()
    );
    findings.push(finding("cores", &cores, None));
}

fn disk(data: &Path) -> Finding {
    let folder = data.ancestors().find(|folder| folder.is_dir());
    let folder = folder.unwrap_or(Path::new("."));
    let reserve = Config::DISK_RESERVE_BYTES;
    match rustix::fs::statvfs(folder) {
        Ok(disk) => {
            let room = disk.f_bavail.saturating_mul(disk.f_frsize);
            let gib = room as f64 / f64::from(1 << 30);
            let full = (room < reserve).then_some("uploads are refused until disk space is free");
            finding(
                "disk",
                &format!("{gib:.1} GiB free for {}", data.display()),
                full,
            )
        }
        Err(error) => finding(
            "disk",
            &error.to_string(),
            Some("the free space of the data folder is unknown"),
        ),
    }
}

fn finding(name: &str, found: &str, lack: Option<&str>) -> Finding {
    Finding {
        name: name.to_owned(),
        found: found.to_owned(),
        lack: lack.map(str::to_owned),
    }
}

impl Finding {
    fn line(&self) -> String {
        let Finding { name, found, lack } = self;
        match lack {
            None => format!("ok    {name}: {found}"),
            Some(meaning) => format!("LACK  {name}: {found}; {meaning}"),
        }
    }
}

fn as_json(findings: &[Finding]) -> Value {
    let all = findings.iter().map(
        |f| json!({"name": f.name, "found": f.found, "ok": f.lack.is_none(), "meaning": f.lack}),
    );
    json!({"ok": findings.iter().all(|f| f.lack.is_none()), "findings": all.collect::<Vec<_>>()})
}
