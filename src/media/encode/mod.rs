//! Frames to a file: an MP4 that browsers play (H.264 High, 4:2:0, index in front), or one of the other
//! kinds of `coding`, some with straight alpha (ECOSYSTEM.md 5).
//!
//! Equal frames give equal bytes whatever the machine: x264 gets a fixed number of threads (measured:
//! 1, 2, 3 and 4 give four different films; 4 gives the same on one core, on two and without vector
//! instructions), no processor-dependent choices, and writes no name of itself.
//! The file appears under its own name only when it is whole.

mod coding; // what the encoder is told for each kind of file

use std::ffi::OsString;
use std::path::{Path, PathBuf};

pub use coding::Coding;

use super::error::Error;
use super::gate::{Child, Order};
use super::limits::Limits;
use super::tools::Tool;
use crate::footage::FootageFormat;
use crate::raster::{ColorSpec, Frame};

/// What all frames of a video have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VideoFormat {
    /// Columns, 1..=8192; an odd number gains one column, a copy of the last.
    pub width: u32,
    /// Rows, 1..=8192; as the columns.
    pub height: u32,
    /// Frames a second, > 0 and <= 1000.
    pub fps: f64,
    /// How the values of the frames are to be read; written into the file.
    pub color: ColorSpec,
}

/// The format in which a footage would be written again.
impl From<FootageFormat> for VideoFormat {
    fn from(footage: FootageFormat) -> VideoFormat {
        VideoFormat {
            width: footage.width,
            height: footage.height,
            fps: footage.fps,
            color: footage.color,
        }
    }
}

/// How well to encode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// x264's constant rate factor, 1 ..= 51; 18 looks like the original.
    pub crf: u8,
    /// Encoding threads. The bytes depend on them, so this is no automatic number.
    pub threads: u32,
}

impl Default for Quality {
    fn default() -> Quality {
        Quality {
            crf: 18,
            threads: 4,
        }
    }
}

/// A video file being written. Dropped before [`VideoWriter::finish`], it leaves nothing behind.
pub struct VideoWriter {
    format: VideoFormat,
    coding: Coding,
    /// None once the encoder has failed: every later frame is refused.
    child: Option<Child>,
    part: Part,
    path: PathBuf,
    padded: Vec<u8>,
}

impl VideoWriter {
    /// Starts an MP4 at `path`, with the default quality and limits.
    pub fn create(path: &Path, format: &VideoFormat) -> Result<VideoWriter, Error> {
        VideoWriter::create_with(path, format, Quality::default(), &Limits::default())
    }

    /// Starts a file of another kind, with the default limits.
    pub fn create_as(
        path: &Path,
        format: &VideoFormat,
        coding: Coding,
    ) -> Result<VideoWriter, Error> {
        VideoWriter::start(path, format, coding, &Limits::default())
    }

    /// As `create`; of the limits, those on time, memory and output bytes hold.
    pub fn create_with(
        path: &Path,
        format: &VideoFormat,
        quality: Quality,
        limits: &Limits,
    ) -> Result<VideoWriter, Error> {
        VideoWriter::start(path, format, Coding::H264(quality), limits)
    }

    fn start(
        path: &Path,
        format: &VideoFormat,
        coding: Coding,
        limits: &Limits,
    ) -> Result<VideoWriter, Error> {
        let sides = 1..=8192;
        if !(sides.contains(&format.width) && sides.contains(&format.height)) {
            return Err(Error::BadOutput("a size outside 1..=8192"));
        }
        if !(format.fps > 0.0 && format.fps <= 1000.0) {
            return Err(Error::BadOutput("a frame rate outside 0..=1000"));
        }
        let path = std::path::absolute(path).map_err(Error::io("finding the output folder"))?;
        let part = Part::beside(&path)?;
        let args = coding.args(&part.0, format);
        let order = Order::new(Tool::Ffmpeg, args, limits, limits.max_frames)
            .with_output(&part.0, limits.max_output_bytes);
        Ok(VideoWriter {
            format: *format,
            coding,
            child: Some(Child::writing(order)?),
            part,
            path,
            padded: Vec::new(),
        })
    }

    /// Adds a frame, of the video's size and colors.
    pub fn write(&mut self, frame: &Frame) -> Result<(), Error> {
        let VideoFormat {
            width,
            height,
            color,
            ..
        } = self.format;
        if (frame.width, frame.height, frame.color) != (width, height, color)
            || self.coding.takes_rgba()
        {
            return Err(Error::BadOutput("a frame of another size or color"));
        }
        if width % 2 == 0 && height % 2 == 0 || !self.coding.is_even() {
            return self.give(&frame.planes);
        }
        let mut padded = std::mem::take(&mut self.padded);
        pad(frame, &mut padded);
        let written = self.give(&padded);
        self.padded = padded;
        written
    }

    /// Adds a frame of straight-alpha RGBA, by rows, of the video's size.
    pub fn write_rgba(&mut self, rgba: &[u8]) -> Result<(), Error> {
        let n_bytes = self.format.width as usize * self.format.height as usize * 4;
        if rgba.len() != n_bytes || !self.coding.takes_rgba() {
            return Err(Error::BadOutput("a picture of another size or kind"));
        }
        self.give(rgba)
    }

    fn give(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let Some(child) = &mut self.child else {
            return Err(Error::BadOutput("a frame after a failure"));
        };
        let written = child.write_all(bytes);
        if written.is_err() {
            self.child = None;
        }
        written
    }

    /// Ends the video; only now does the file appear at its path.
    pub fn finish(mut self) -> Result<(), Error> {
        let child = self
            .child
            .take()
            .ok_or(Error::BadOutput("an end after a failure"))?;
        child.finish()?.check()?;
        std::fs::rename(&self.part.0, &self.path).map_err(Error::io("naming the video"))
    }
}

/// The file under its working name; removed when dropped, unless it has been renamed.
struct Part(PathBuf);

impl Part {
    /// Made here, empty, because the encoder may write this file and make no other.
    fn beside(path: &Path) -> Result<Part, Error> {
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(".part");
        let part = path.with_file_name(name);
        // What another run has left, if anything, whatever it is.
        std::fs::remove_file(&part).ok();
        std::fs::File::create_new(&part).map_err(Error::io("making the video"))?;
        Ok(Part(part))
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        std::fs::remove_file(&self.0).ok();
    }
}

/// The planes with an even number of rows and columns, the last ones doubled where needed. The
/// chroma planes of an odd size are rounded up already.
fn pad(frame: &Frame, padded: &mut Vec<u8>) {
    let (width, height) = (frame.width as usize, frame.height as usize);
    padded.clear();
    let rows = frame.luma().chunks_exact(width);
    let last = frame.luma().len() - width;
    let extra = (height % 2 == 1).then(|| &frame.luma()[last..]);
    for row in rows.chain(extra) {
        padded.extend_from_slice(row);
        if width % 2 == 1 {
            padded.push(row[width - 1]);
        }
    }
    padded.extend_from_slice(&frame.planes[width * height..]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_odd_frame_gains_copies_of_its_last_row_and_column() {
        let mut frame = Frame::new(3, 3, ColorSpec::default());
        frame.planes = (1..=17).collect();
        let mut padded = Vec::new();
        pad(&frame, &mut padded);
        let luma = [1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9, 9, 7, 8, 9, 9];
        assert_eq!(padded[..16], luma);
        assert_eq!(padded[16..], [10, 11, 12, 13, 14, 15, 16, 17]);
    }
}
