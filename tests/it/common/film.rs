//! Films made on the spot by ffmpeg: good ones, odd ones and broken ones, never committed.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A folder of films that goes when it is dropped.
pub(crate) struct Films {
    folder: tempfile::TempDir,
}

impl Films {
    /// An empty folder.
    pub(crate) fn new() -> Films {
        let folder = tempfile::tempdir().expect("a temporary folder");
        Films { folder }
    }

    /// The path of a file in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The folder itself.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Writes bytes as they are.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, bytes).expect("a file in the folder");
        path
    }

    /// Runs ffmpeg in the folder with `args` (split at spaces), the output's name last.
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

    /// As [`Films::run`], of input that ffmpeg may complain of.
    pub(crate) fn run_though_damaged(&self, args: &str) -> PathBuf {
        let done = Command::new("ffmpeg")
            .args(["-nostdin", "-v", "fatal", "-y"])
            .args(args.split_whitespace())
            .current_dir(self.folder())
            .status();
        assert!(done.expect("ffmpeg is installed").success(), "{args}");
        self.path(args.split_whitespace().last().expect("an output"))
    }

    /// A moving test picture, `size` such as 64x48, encoded as `args` say, the output's name last.
    pub(crate) fn test_picture(&self, size: &str, n_frames: usize, args: &str) -> PathBuf {
        self.run(&format!(
            "-f lavfi -i testsrc2=size={size}:rate=25 -frames:v {n_frames} {args}"
        ))
    }

    /// The film cut off after `share` of its bytes.
    pub(crate) fn cut(&self, film: &Path, share: f64, name: &str) -> PathBuf {
        let bytes = std::fs::read(film).expect("the film to cut");
        self.write(name, &bytes[..(bytes.len() as f64 * share) as usize])
    }

    /// The raw bytes that plain ffmpeg gives for the film, as reference.
    pub(crate) fn reference(&self, film: &Path, args: &str) -> Vec<u8> {
        let film = film.display();
        let raw = self.run(&format!("-i {film} {args} -f rawvideo reference.raw"));
        std::fs::read(raw).expect("the reference")
    }
}

/// The folder of real recordings that FLOCKREEL_FOOTAGE names, if there is one.
pub(crate) fn footage() -> Option<PathBuf> {
    let folder = std::env::var_os("FLOCKREEL_FOOTAGE").map(PathBuf::from);
    let folder = folder.filter(|folder| folder.is_dir());
    if folder.is_none() {
        println!("skipped: FLOCKREEL_FOOTAGE names no folder of real footage");
    }
    folder
}
