//! Test films that ffmpeg generates at run time: good, unusual and damaged ones. None are committed.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A temporary folder of films, deleted on drop.
pub(crate) struct Films {
    folder: tempfile::TempDir,
}

impl Films {
    /// Creates an empty folder.
    pub(crate) fn new() -> Films {
        let folder = tempfile::tempdir().expect("a temporary folder");
        Films { folder }
    }

    /// Returns the path of a file in the folder. The file need not exist.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the folder.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file and returns its path.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).expect("a file in the folder");
        path
    }

    /// Runs ffmpeg in the folder and returns the path of its output. `args` is split at spaces; the last word
    /// names the output. Panics if ffmpeg fails.
    pub(crate) fn run(&self, args: &str) -> PathBuf {
        let done = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "error", "-y"])
            .args(args.split_whitespace())
            .current_dir(self.folder())
            .output()
            .expect("ffmpeg is installed");
        let complaint = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.success(), "{args}: {complaint}");
        self.path(args.split_whitespace().last().expect("an output"))
    }

    /// Like [`Films::run`], for damaged input: ffmpeg prints fatal errors only.
    pub(crate) fn run_though_damaged(&self, args: &str) -> PathBuf {
        let done = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "fatal", "-y"])
            .args(args.split_whitespace())
            .current_dir(self.folder())
            .status();
        assert!(done.expect("ffmpeg is installed").success(), "{args}");
        self.path(args.split_whitespace().last().expect("an output"))
    }

    /// Encodes ffmpeg's moving test picture at 25 frames/s and returns the path. `size` is written `64x48`.
    /// The last word of `args` names the output.
    pub(crate) fn test_picture(&self, size: &str, n_frames: usize, args: &str) -> PathBuf {
        self.run(&format!(
            "-f lavfi -i testsrc2=size={size}:rate=25 -frames:v {n_frames} {args}"
        ))
    }

    /// Writes the first `share` (0 to 1) of the film's bytes to a file and returns its path.
    pub(crate) fn cut(&self, film: &Path, share: f64, name: &str) -> PathBuf {
        let bytes = std::fs::read(film).expect("the film to cut");
        self.write(name, &bytes[..(bytes.len() as f64 * share) as usize])
    }

    /// Returns the raw frames that ffmpeg decodes from the film, as a reference.
    pub(crate) fn reference(&self, film: &Path, args: &str) -> Vec<u8> {
        let film = film.display();
        let raw = self.run(&format!("-i {film} {args} -f rawvideo reference.raw"));
        std::fs::read(raw).expect("the reference")
    }
}

/// Returns the folder of real recordings, from FLOCKREEL_FOOTAGE. `None` if it does not name a folder.
pub(crate) fn footage() -> Option<PathBuf> {
    let folder = std::env::var_os("FLOCKREEL_FOOTAGE").map(PathBuf::from);
    let folder = folder.filter(|folder| folder.is_dir());
    if folder.is_none() {
        println!("skipped: FLOCKREEL_FOOTAGE names no folder of real footage");
    }
    folder
}
