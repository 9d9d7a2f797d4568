//! Promise S2 on the files that lie about what they are: under strace, nothing but the input and
//! the system's libraries is opened, nothing but the two tools is started, no internet socket.

use std::path::{Path, PathBuf};
use std::process::Command;

use flockreel::media::Limits;

use super::bad::PLAYLISTS;
use super::read_whole;
use crate::common::film::Films;

/// Names the film for the test below, which this one starts under strace.
const FILM: &str = "FLOCKREEL_TRACED_FILM";

#[test]
#[ignore = "started by the tests below, under strace"]
fn read_the_named_film() {
    if let Some(film) = std::env::var_os(FILM) {
        let n_frames = read_whole(Path::new(&film), &Limits::default()).map(|frames| frames.len());
        println!("{n_frames:?}");
    }
}

/// Reads a film in a traced process; the lines of the trace.
fn trace(films: &Films, film: &Path) -> Vec<String> {
    let log = films.path("trace.log");
    let program = std::env::current_exe().expect("the path of this program");
    let calls = "trace=open,openat,openat2,execve,socket,connect";
    let done = Command::new("strace")
        .args(["-f", "-qq", "-s", "4096", "-e", calls, "-o"])
        .arg(&log)
        .arg(program)
        .args(["--exact", "media::traced::read_the_named_film", "--ignored"])
        .env(FILM, film)
        .output()
        .expect("strace is installed");
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let log = std::fs::read_to_string(log).expect("the trace");
    log.lines().map(str::to_owned).collect()
}

/// The files of the folder that a trace shows as opened.
fn opened(films: &Films, lines: &[String]) -> Vec<PathBuf> {
    let folder = films.folder().display().to_string();
    let opens = lines
        .iter()
        .filter(|line| line.contains("open") && !line.contains(" = -1 "));
    let paths = opens.filter_map(|line| line.split('"').nth(1));
    let mut paths: Vec<PathBuf> = paths
        .filter(|p| p.contains(&folder))
        .map(PathBuf::from)
        .collect();
    paths.dedup();
    paths
}

fn strace_is_there() -> bool {
    let there = Command::new("strace")
        .args(["-qq", "true"])
        .output()
        .is_ok_and(|o| o.status.success());
    if !there {
        println!("skipped: strace is not installed or may not trace here");
    }
    there
}

#[test]
fn a_film_that_names_other_files_opens_none_of_them() {
    if !strace_is_there() {
        return;
    }
    let films = Films::new();
    let args = "-c:v libx264 -pix_fmt yuv420p";
    let good = films.test_picture("64x48", 25, &format!("{args} other.mp4"));
    films.test_picture("64x48", 25, &format!("{args} other.ts"));
    // The trace does see what is opened, and started.
    let lines = trace(&films, &good);
    assert_eq!(opened(&films, &lines), [good]);
    let starts = |line: &&String| line.contains("execve(");
    let of_tools = lines
        .iter()
        .filter(starts)
        .filter(|l| l.contains("/ffmpeg\"") || l.contains("/ffprobe\""));
    assert_eq!(of_tools.count(), 3, "headers, packets, frames");
    assert_eq!(
        lines.iter().filter(starts).count(),
        4,
        "and the test itself"
    );
    for text in PLAYLISTS {
        let film = films.write("lie.mp4", text);
        let lines = trace(&films, &film);
        assert_eq!(opened(&films, &lines), [film], "{text}");
        assert!(!lines.iter().any(|line| line.contains("AF_INET")), "{text}");
    }
}

#[test]
fn a_playlist_dressed_as_a_container_opens_nothing_either() {
    if !strace_is_there() {
        return;
    }
    let films = Films::new();
    films.test_picture("64x48", 25, "-c:v libx264 -pix_fmt yuv420p other.ts");
    // First bytes that pass our own look; then the demuxer that we force and ffmpeg's lists hold.
    for head in [
        &b"\0\0\0\x10ftypisom\0\0\0\0\n"[..],
        b"\x1a\x45\xdf\xa3\n",
        b"RIFF\x10\0\0\0AVI \n",
    ] {
        let film = films.write("dressed.mp4", [head, PLAYLISTS[0].as_bytes()].concat());
        let lines = trace(&films, &film);
        assert_eq!(opened(&films, &lines), [film]);
        assert!(
            lines.iter().any(|line| line.contains("/ffprobe\"")),
            "it did come to ffprobe"
        );
    }
}
