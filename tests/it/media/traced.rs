//! Reads the corpus of bad films, and writes a film in each format, under strace (docs/explanation/promises.md, "Bad
//! input" and "Confined media tools"). Each bad film ends with an allowed code in time. The media tools open only
//! their input or output and their libraries, start no processes and create no sockets. The sandbox is off, so only
//! the tools' options count.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use flockreel::media::{Encoding, Layers, Limits, Quality, Video, VideoFormat, VideoWriter};
use flockreel_core::code::Code;
use flockreel_core::raster::{ColorSpec, Frame};

use super::corpus::{Case, corpus};
use super::read_all;
use crate::common::film::Films;

/// Environment variable with the folder of films, for the test that runs under strace.
const FOLDER: &str = "FLOCKREEL_TRACED_FOLDER";
/// Time limit for one file.
const LONGEST: Duration = Duration::from_secs(30);
/// All formats of output.
const ENCODINGS: [Encoding; 8] = [
    Encoding::H264(Quality {
        crf: 18,
        threads: 4,
    }),
    Encoding::Seekable,
    Encoding::Gif,
    Encoding::Vp9 { alpha: true },
    Encoding::ProRes { alpha: true },
    Encoding::Webp,
    Encoding::StillWebp,
    Encoding::Thumb(50),
];

#[test]
fn bad_films_fail_with_their_code_and_open_no_other_file() {
    let films = Films::new();
    let cases = corpus(&films);
    assert!(cases.len() >= 80, "{}", cases.len());
    let (said, trace) = read_in_a_process(&films);
    let ends: BTreeMap<&str, &str> = said
        .lines()
        .filter_map(|l| l.strip_prefix("end ")?.split_once(": "))
        .collect();
    let faults: Vec<String> = cases.iter().filter_map(|case| fault(case, &ends)).collect();
    assert_eq!(faults, Vec::<String>::new(), "of {} files", cases.len());
    match trace {
        Some(trace) => assert_eq!(strangers(&trace), Vec::<String>::new()),
        None => println!("not traced: strace is not installed or may not trace here"),
    }
}

/// Returns a message if the file ended in a way that its case does not allow.
fn fault(case: &Case, ends: &BTreeMap<&str, &str>) -> Option<String> {
    let name = case.path.file_name().unwrap().to_str().unwrap();
    let end = *ends.get(name).unwrap_or(&"never read");
    let allowed = match end {
        "good" => case.may_be_good,
        code => Code::from_name(code).is_some_and(|code| case.codes.contains(&code)),
    };
    (!allowed).then(|| format!("{name}: {end}, not one of {:?}", case.codes))
}

#[test]
#[ignore = "started by the test above, under strace"]
fn read_the_folder() {
    let folder = PathBuf::from(std::env::var_os(FOLDER).expect("a folder"));
    // Test the command-line options of the tools without the layers that would also stop them.
    let limits = Limits {
        layers: Layers::BASIC,
        ..Limits::default()
    };
    for entry in std::fs::read_dir(&folder).expect("the folder").flatten() {
        let start = Instant::now();
        let end = Video::open(&entry.path(), &limits)
            .map_err(|error| error.code())
            .and_then(|video| read_all(&video).map_err(|error| error.code));
        let end = end.map_or_else(Code::name, |_frames| "good");
        let name = entry.file_name().into_string().expect("a name of ours");
        assert!(start.elapsed() < LONGEST, "{name} took too long");
        println!("end {name}: {end}");
    }
    for (k, encoding) in ENCODINGS.into_iter().enumerate() {
        write(&folder.join(format!("written {k}")), encoding, &limits);
    }
}

/// Writes a film of two gray frames; a still picture has one.
fn write(path: &Path, encoding: Encoding, limits: &Limits) {
    let [width, height] = [64, 48];
    let format = VideoFormat {
        width,
        height,
        fps: 25.0,
        color: ColorSpec::default(),
    };
    let mut writer = VideoWriter::create_with(path, &format, encoding, limits).expect("an encoder");
    let is_still = matches!(encoding, Encoding::StillWebp | Encoding::Thumb(_));
    for _ in 0..if is_still { 1 } else { 2 } {
        let written = if encoding.takes_rgba() {
            writer.write_rgba(&vec![128; (width * height * 4) as usize])
        } else {
            writer.write(&Frame::new(width, height, format.color))
        };
        written.expect("space in the pipe");
    }
    writer.finish().expect("a film");
}

/// Reads the folder in a second process. Returns its stdout, and its trace if strace is available.
fn read_in_a_process(films: &Films) -> (String, Option<String>) {
    let log = tempfile::NamedTempFile::new().expect("a file");
    let calls = "trace=open,openat,openat2,execve,execveat,socket,connect,clone,clone3,fork,vfork";
    let traces = Command::new("strace").args(["-qq", "true"]).output();
    let traces = traces.is_ok_and(|done| done.status.success());
    let program = std::env::current_exe().expect("the path of this program");
    let mut command = if traces {
        let mut command = Command::new("strace");
        let options = [
            "-f",
            "-qq",
            "--seccomp-bpf",
            "-s",
            "4096",
            "-e",
            calls,
            "-o",
        ];
        command.args(options).arg(log.path()).arg(program);
        command
    } else {
        Command::new(program)
    };
    let done = command
        .args([
            "--exact",
            "media::traced::read_the_folder",
            "--ignored",
            "--nocapture",
        ])
        .env(FOLDER, films.folder())
        .output()
        .expect("this program");
    let said = String::from_utf8_lossy(&done.stdout).into_owned();
    assert!(
        done.status.success(),
        "{said}{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let trace = std::fs::read_to_string(log.path()).expect("the trace");
    (said, traces.then_some(trace))
}

/// Returns the traced calls that a media tool must not make.
fn strangers(trace: &str) -> Vec<String> {
    let mut tools = Tools::default();
    let strangers: BTreeSet<String> = trace
        .lines()
        .filter_map(|line| {
            let (thread, call) = line.split_once(' ')?;
            tools
                .look(thread.parse().ok()?, call.trim())
                .then(|| call.to_owned())
        })
        .collect();
    assert!(
        tools.n_started > 200,
        "the trace shows too little: {} starts",
        tools.n_started
    );
    assert!(
        tools.n_read > 200,
        "the trace shows too little: {} inputs",
        tools.n_read
    );
    assert_eq!(tools.n_written, ENCODINGS.len(), "outputs in the trace");
    strangers.into_iter().collect()
}

/// The threads of media tools in the trace, each with the file that its tool may open.
#[derive(Default)]
struct Tools {
    files: BTreeMap<u32, Option<String>>,
    n_started: usize,
    n_read: usize,
    n_written: usize,
}

impl Tools {
    /// Returns true if a media tool must not make this call.
    fn look(&mut self, thread: u32, call: &str) -> bool {
        let quoted: Vec<&str> = call.split('"').skip(1).step_by(2).collect();
        if call.starts_with("execve(") && quoted[0].ends_with(['g', 'e']) && is_tool(quoted[0]) {
            let again = self.files.contains_key(&thread);
            let file = quoted.iter().find_map(|word| word.strip_prefix("file:"));
            self.files.insert(thread, file.map(str::to_owned));
            self.n_started += 1;
            return again;
        }
        let Some(file) = self.files.get(&thread).cloned() else {
            return false;
        };
        if let Some((_, new)) = call.rsplit_once(" = ")
            && (call.contains("clone") || call.contains("fork"))
        {
            if let Ok(new) = new.parse() {
                self.files.insert(new, file);
            }
            return !call.contains("CLONE_THREAD")
                && call.starts_with(['c', 'f', 'v'])
                && !call.contains("unfinished");
        }
        if call.starts_with("open") {
            let path = quoted.first().copied();
            let is_file = path.is_some() && file.as_deref() == path;
            let writes = call.contains("O_CREAT");
            self.n_written += usize::from(is_file && writes);
            self.n_read += usize::from(is_file && !writes);
            let is_own = !writes && path.is_some_and(is_of_the_program);
            return !is_file && !is_own && !call.contains(" = -1 ");
        }
        call.starts_with("execve") || call.starts_with("socket") || call.starts_with("connect")
    }
}

fn is_tool(path: &str) -> bool {
    let name = Path::new(path).file_name();
    name.is_some_and(|name| name == "ffmpeg" || name == "ffprobe")
}

/// Returns true for libraries and the files that they read when they are loaded.
fn is_of_the_program(path: &str) -> bool {
    let places = [
        "/lib",
        "/usr/lib",
        "/usr/local/lib",
        "/etc/ld.so.",
        "/proc/",
        "/sys/devices/system/",
        "/dev/null",
        // Settings and time zone, which libraries read.
        "/etc/gcrypt/",
        "/etc/localtime",
    ];
    places.iter().any(|place| path.starts_with(place))
}
