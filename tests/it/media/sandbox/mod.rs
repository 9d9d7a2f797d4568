//! Attacks from inside the sandbox (docs/explanation/promises.md, "Sandbox"). A program in place of ffmpeg
//! tries what a decoder taken over by a malicious film could try. All attacks fail inside all layers. All
//! succeed outside all layers, which shows that they are real. For each attack, the test also checks which
//! layers stop it alone, and whether it succeeds when one layer is missing.

use std::net::{TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use flockreel::media::{Encoding, Layer, Layers, Limits, Quality, Video, VideoFormat, VideoWriter};
use flockreel_core::raster::{ColorSpec, Frame};

use super::n_processes_with;
use crate::common::film::Films;

/// Environment variable with the folder of the attack, for tests in a process of their own.
const FOLDER: &str = "FLOCKREEL_ATTACK_FOLDER";
/// Environment variable with the name of the missing layer, for the test of the parent's death.
const MISSING: &str = "FLOCKREEL_ATTACK_MISSING";

/// Compiles the attack into the folder, under the names of both tools, and returns its path.
pub(crate) fn compile_attack(folder: &Path) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/media/sandbox/attack.rs");
    let program = folder.join("ffmpeg");
    let done = Command::new("rustc")
        .args(["--edition", "2024", "-C", "panic=abort", "-o"])
        .arg(&program)
        .arg(source)
        .output()
        .expect("rustc is installed");
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    for name in ["ffprobe", "other"] {
        std::fs::copy(&program, folder.join(name)).expect("a copy");
    }
    program
}

/// Returns a command that runs one ignored test of this program, with the attack in place of the tools.
fn rerun(test: &str, folder: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("the path of this program"));
    command
        .args(["--exact", test, "--ignored", "--nocapture"])
        .env("PATH", folder)
        .env(FOLDER, folder);
    command
}

#[test]
fn attacks_are_stopped_by_exactly_the_intended_layers() {
    let films = Films::new();
    compile_attack(films.folder());
    let done = rerun(
        "media::sandbox::attack_in_every_set_of_layers",
        films.folder(),
    )
    .output()
    .expect("this program");
    let said = String::from_utf8_lossy(&done.stdout);
    let complaint = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{complaint}{said}");
    println!("{said}");
}

/// One attack.
struct Attempt {
    name: &'static str,
    target: String,
    /// True if a film is written rather than read. The child then has an output file.
    writes: bool,
    /// Sets of layers that stop the attack. Any one set is enough; it needs all of its layers.
    stopped_by: Vec<Vec<Layer>>,
}

fn attempts(folder: &Path, tcp: &str, udp: &str) -> Vec<Attempt> {
    use Layer::{Calls, Files, Limits, Network, Privileges, Signals};
    let path = |name: &str| folder.join(name).display().to_string();
    let alone = |layers: &[Layer]| layers.iter().map(|&layer| vec![layer]).collect::<Vec<_>>();
    let is_root = rustix::process::getuid().is_root();
    let attempt = |name, target: String, stopped_by| Attempt {
        name,
        target,
        writes: false,
        stopped_by,
    };
    let writing = |name, target: String, stopped_by| Attempt {
        writes: true,
        ..attempt(name, target, stopped_by)
    };
    let mut traced = alone(&[Files, Network, Signals, Calls]);
    let mut raised = alone(&[Calls]);
    if is_root {
        traced.push(vec![Privileges]);
    }
    // With CAP_SYS_RESOURCE, a process can raise its limits until the privileges are dropped.
    let capabilities = rustix::thread::capabilities(None).expect("Linux");
    let may_raise = capabilities
        .effective
        .contains(rustix::thread::CapabilitySet::SYS_RESOURCE);
    raised.push(if may_raise {
        vec![Limits, Privileges]
    } else {
        vec![Limits]
    });
    vec![
        attempt("read", path("secret"), alone(&[Files])),
        attempt("list", path(""), alone(&[Files])),
        attempt("write", path("made"), alone(&[Files])),
        writing("write", path("made"), alone(&[Files])),
        writing("read", path("secret"), alone(&[Files])),
        writing("remove", path("removable"), alone(&[Files])),
        writing("grow", String::new(), alone(&[Limits])),
        attempt("exec", path("other"), alone(&[Files])),
        attempt("tcp", tcp.to_owned(), alone(&[Network, Calls])),
        attempt("udp", udp.to_owned(), alone(&[Calls])),
        attempt("fork", String::new(), alone(&[Calls])),
        attempt("memory", String::new(), alone(&[Limits])),
        // Two tools read a film at the same time, but only one process may trace the parent. So write one.
        writing("trace", String::new(), traced),
        attempt("stop", String::new(), alone(&[Signals, Calls])),
        attempt("stop-thread", String::new(), alone(&[Signals, Calls])),
        attempt("truncate", path("secret"), alone(&[Files, Calls])),
        attempt("chmod", path("secret"), alone(&[Calls])),
        attempt("chown", path("secret"), alone(&[Calls])),
        attempt("touch", path("secret"), alone(&[Calls])),
        attempt("slip", String::new(), alone(&[Calls])),
        attempt("raise", String::new(), raised),
    ]
}

#[test]
#[ignore = "started by the test above, with the attack in the place of the tools"]
fn attack_in_every_set_of_layers() {
    let folder = PathBuf::from(std::env::var_os(FOLDER).expect("a folder"));
    let (tcp, udp) = (
        TcpListener::bind("127.0.0.1:0"),
        UdpSocket::bind("127.0.0.1:0"),
    );
    let (tcp, udp) = (tcp.expect("a listener"), udp.expect("a socket"));
    let address = |of: std::io::Result<std::net::SocketAddr>| of.expect("an address").to_string();
    let attempts = attempts(
        &folder,
        &address(tcp.local_addr()),
        &address(udp.local_addr()),
    );
    let here = flockreel::media::sandbox_status()
        .expect("the attack tells its version")
        .layers;
    let missing = here
        .iter()
        .filter(|(_, lack)| lack.is_some())
        .map(|(layer, _)| *layer);
    let here = missing.fold(Layers::ALL, Layers::without);
    let each =
        |change: fn(Layers, Layer) -> Layers, from| Layer::ALL.map(|layer| change(from, layer));
    let layer_sets = [
        vec![Layers::NONE, Layers::ALL],
        each(Layers::without, Layers::ALL).to_vec(),
    ];
    let layer_sets = [
        layer_sets.concat(),
        each(Layers::with, Layers::NONE).to_vec(),
    ]
    .concat();
    for attempt in attempts {
        for &layers in &layer_sets {
            let layers = layers.and(here);
            let is_stopped = attempt
                .stopped_by
                .iter()
                .any(|set| set.iter().all(|&layer| layers.has(layer)));
            let verdict = attempt.make(&folder, layers);
            let names: Vec<_> = Layer::ALL
                .iter()
                .filter(|&&l| layers.has(l))
                .map(|l| l.name())
                .collect();
            assert_eq!(
                verdict.contains("ATTACK DONE"),
                !is_stopped,
                "{} {} in {names:?}: {verdict}",
                attempt.name,
                attempt.target
            );
        }
        println!(
            "{}: stopped by any of {:?}",
            attempt.name, attempt.stopped_by
        );
    }
}

impl Attempt {
    /// Runs the attack inside these layers and returns its verdict.
    fn make(&self, folder: &Path, layers: Layers) -> String {
        wait_until_untraced();
        std::fs::write(folder.join("secret"), "of another").expect("a file");
        std::fs::write(folder.join("removable"), "of another").expect("a file");
        std::fs::remove_file(folder.join("made")).ok();
        let limits = Limits {
            layers,
            max_output_bytes: 1 << 20,
            ..Limits::default()
        };
        let order = format!("ATTACK {} {}\n", self.name, self.target);
        if self.writes {
            write(&folder.join("film.mp4"), &order, &limits)
        } else {
            read(&folder.join("film"), &order, &limits)
        }
    }
}

/// Waits until no process traces this one. The tracer of an earlier attack may live on for a moment, and a
/// process has only one tracer.
fn wait_until_untraced() {
    let is_traced = || {
        let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
        !status.lines().any(|line| line == "TracerPid:\t0")
    };
    let end = Instant::now() + Duration::from_secs(10);
    while is_traced() && Instant::now() < end {
        std::thread::sleep(Duration::from_millis(5));
    }
}

fn read(film: &Path, order: &str, limits: &Limits) -> String {
    std::fs::write(
        film,
        [b"\0\0\0\x10ftypisom\0\0\0\0\n", order.as_bytes()].concat(),
    )
    .expect("a film");
    Video::open(film, limits)
        .expect_err("an attack is no film")
        .to_string()
}

fn write(film: &Path, order: &str, limits: &Limits) -> String {
    let format = VideoFormat {
        width: 64,
        height: 64,
        fps: 25.0,
        color: ColorSpec::default(),
    };
    let mut frame = Frame::new(64, 64, format.color);
    frame.planes[..order.len()].copy_from_slice(order.as_bytes());
    let encoding = Encoding::H264(Quality::default());
    let mut writer =
        VideoWriter::create_with(film, &format, encoding, limits).expect("the attack starts");
    let written = writer.write(&frame).and_then(|()| writer.finish());
    written.expect_err("an attack writes no film").to_string()
}

#[test]
fn child_outlives_its_parent_only_without_leash_or_calls() {
    let films = Films::new();
    compile_attack(films.folder());
    let film = films.write("film", b"\0\0\0\x10ftypisom\0\0\0\0\nATTACK outlive \n");
    let name = film.display().to_string();
    for (missing, outlives) in [
        ("none", false),
        ("limits", false),
        ("leash", true),
        ("calls", true),
    ] {
        let mut parent = rerun(
            "media::sandbox::start_a_child_that_outlives_its_parent",
            films.folder(),
        )
        .env(MISSING, missing)
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("this program");
        wait_until(|| n_processes_with(&name) > 0);
        // Leave the child time to clear its parent-death signal.
        std::thread::sleep(Duration::from_millis(300));
        parent.kill().expect("a process of ours");
        parent.wait().expect("a process of ours");
        if outlives {
            std::thread::sleep(Duration::from_millis(300))
        } else {
            wait_until(|| n_processes_with(&name) == 0)
        }
        assert_eq!(n_processes_with(&name) > 0, outlives, "without {missing}");
        kill_all(&name);
    }
}

#[test]
#[ignore = "started by the test above, with the attack in the place of the tools"]
fn start_a_child_that_outlives_its_parent() {
    let folder = PathBuf::from(std::env::var_os(FOLDER).expect("a folder"));
    let missing = std::env::var(MISSING).expect("a layer");
    let missing = Layer::ALL.into_iter().find(|layer| layer.name() == missing);
    let layers = missing.map_or(Layers::ALL, |layer| Layers::ALL.without(layer));
    let limits = Limits {
        layers,
        ..Limits::default()
    };
    println!("{:?}", Video::open(&folder.join("film"), &limits).map(drop));
}

fn wait_until(condition: impl Fn() -> bool) {
    let start = Instant::now();
    while !condition() {
        assert!(start.elapsed() < Duration::from_secs(10), "waited in vain");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Kills the processes whose arguments contain `text`. All of them belong to this test.
fn kill_all(text: &str) {
    for entry in std::fs::read_dir("/proc")
        .expect("a Linux machine")
        .flatten()
    {
        let arguments = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        let id = entry
            .file_name()
            .to_str()
            .and_then(|name| name.parse().ok());
        if String::from_utf8_lossy(&arguments).contains(text)
            && let Some(process) = id.and_then(rustix::process::Pid::from_raw)
        {
            rustix::process::kill_process(process, rustix::process::Signal::KILL).ok();
        }
    }
}
