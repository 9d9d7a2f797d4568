//! Replays the inputs in `fuzz/corpus` on their targets (docs/explanation/promises.md, "Parsers do not fall over").
//!
//! Each target runs in a process of its own, a further instance of this test program: a fault may abort it or never
//! end. The targets are those of `make fuzz`, without libFuzzer.

#[expect(
    unreachable_pub,
    reason = "the package of the targets exports these items"
)]
#[path = "../../fuzz/src/targets/mod.rs"]
mod targets;

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Environment variable with the name of the target that a process replays.
const TARGET: &str = "FLOCKREEL_FUZZ_TARGET";
/// Longest time for all inputs of a target. An input takes milliseconds.
const LONGEST: Duration = Duration::from_secs(300);

/// Returns the inputs of a target, in the order of their names.
fn inputs(target: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fuzz/corpus")
        .join(target);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|_| panic!("{}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

#[test]
fn every_kept_input_is_read_without_a_fault() {
    let folder = tempfile::tempdir().unwrap();
    let children = targets::ALL.map(|(name, _)| {
        let mut child = Command::new(std::env::current_exe().unwrap());
        child.args(["--exact", "fuzz::replay", "--ignored", "--nocapture"]);
        // Threads reserve address space for stacks and arenas. A machine with many cores would reach the limit.
        child.envs([("MALLOC_ARENA_MAX", "2"), ("RAYON_NUM_THREADS", "2")]);
        let child = child.env(TARGET, name).env("TMPDIR", folder.path());
        let piped = child.stdout(Stdio::null()).stderr(Stdio::piped());
        (name, piped.spawn().unwrap())
    });
    let end = Instant::now() + LONGEST;
    let mut faults = Vec::new();
    for (name, mut child) in children {
        let mut stderr = child.stderr.take().unwrap();
        let said = std::thread::spawn(move || {
            let mut said = Vec::new();
            stderr.read_to_end(&mut said).map(|_| said)
        });
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break Some(status),
                None if Instant::now() > end => break None,
                None => std::thread::sleep(Duration::from_millis(20)),
            }
        };
        if status.is_none() {
            child.kill().unwrap();
            child.wait().unwrap();
        }
        if !status.is_some_and(|status| status.success()) {
            let said = said.join().unwrap().unwrap();
            faults.push(format!(
                "{name}: {status:?}\n{}",
                String::from_utf8_lossy(&said)
            ));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
#[ignore = "started by the test above, once for each target"]
fn replay() {
    let name = std::env::var(TARGET).unwrap();
    targets::limit_memory();
    let paths = inputs(&name);
    assert!(!paths.is_empty(), "no inputs");
    for path in paths {
        // The last line names the input of a fault.
        eprintln!("{}", path.file_name().unwrap().display());
        targets::run(&name, &std::fs::read(&path).unwrap());
    }
}
