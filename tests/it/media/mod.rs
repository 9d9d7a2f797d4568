//! Reading and writing of media files through ffmpeg: good films, bad input and the sandbox
//! (docs/explanation/promises.md, "Bad input", "Confined media tools" and "Sandbox").

mod advice;
mod alpha;
mod animated;
pub(crate) mod bad;
pub(crate) mod corpus;
mod good;
mod gray;
mod headers;
mod index;
mod kinds;
mod pictures;
mod real;
pub(crate) mod sandbox;
mod shown;
mod speed;
mod traced;
mod written;

use std::path::Path;

use flockreel::media::{Limits, Video};
use flockreel_core::code::Code;
use flockreel_core::footage::{FrameSource, SourceError};
use flockreel_core::raster::Frame;

/// Opens a film that the default limits accept.
fn open(film: &Path) -> Video {
    Video::open(film, &Limits::default()).unwrap_or_else(|error| panic!("{film:?}: {error}"))
}

/// Returns all frames of a film with their times, or the code with which opening or reading is refused.
fn read_whole(path: &Path, limits: &Limits) -> Result<Vec<(f64, Frame)>, Code> {
    let video = Video::open(path, limits).map_err(|error| error.code())?;
    read_all(&video).map_err(|error| error.code)
}

fn read_all(source: &dyn FrameSource) -> Result<Vec<(f64, Frame)>, SourceError> {
    let mut stream = source.open()?;
    let mut frames = Vec::new();
    let mut frame = Frame::default();
    while let Some(time_s) = stream.next_frame(&mut frame)? {
        frames.push((time_s, frame.clone()));
    }
    Ok(frames)
}

/// Returns the number of processes whose arguments contain `text`.
fn n_processes_with(text: &str) -> usize {
    let processes = std::fs::read_dir("/proc").expect("a Linux machine");
    let about = |entry: &std::fs::DirEntry| {
        let arguments = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&arguments).contains(text)
    };
    processes.flatten().filter(about).count()
}
