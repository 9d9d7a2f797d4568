//! Encoding of frames: an MP4 for browsers (H.264 High, 4:2:0, index in front), or another format of
//! `encoding`, some with straight alpha.
//!
//! Equal frames give equal bytes on every machine. The output of x264 depends on its number of threads, so
//! that number is fixed. Measured: 1, 2, 3 and 4 threads give four different files. With 4 threads the file
//! is the same on one core, on two and without vector instructions. Choices that depend on the processor are
//! off, and x264 writes no version.
//!
//! The file gets its final name only when it is complete.

mod encoding; // arguments of ffmpeg for each output format

use std::ffi::OsString;
use std::path::{Path, PathBuf};

pub use encoding::Encoding;

use super::error::Error;
use super::gate::Child;
use super::invocation::Invocation;
use super::limits::Limits;
use super::tools::{Tool, installed};
use flockreel_core::footage::FootageFormat;
use flockreel_core::raster::{ColorSpec, Frame};

/// Properties common to all frames of a video.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VideoFormat {
    /// Width, pixels, 1..=8192. If it is odd, H.264 repeats the last column.
    pub width: u32,
    /// Height, pixels, 1..=8192. If it is odd, H.264 repeats the last row.
    pub height: u32,
    /// Frame rate, frames per second, > 0 and <= 1000.
    pub fps: f64,
    /// Color encoding of the frames; written to the file.
    pub color: ColorSpec,
}

/// Returns the format for encoding with the footage's properties.
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

/// Encoding quality.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Constant rate factor of x264, 1..=51. At 18 the result looks like the original.
    pub crf: u8,
    /// Number of encoding threads. It is fixed, because the bytes depend on it.
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

/// A video file being written. Dropping it before [`VideoWriter::finish`] deletes it.
pub struct VideoWriter {
    format: VideoFormat,
    encoding: Encoding,
    /// `None` once the encoder has failed; all later frames are refused.
    child: Option<Child>,
    part: PartFile,
    path: PathBuf,
    padded: Vec<u8>,
}

impl VideoWriter {
    /// Starts an MP4 at `path` with default quality and limits.
    pub fn create(path: &Path, format: &VideoFormat) -> Result<VideoWriter, Error> {
        VideoWriter::create_as(path, format, Encoding::H264(Quality::default()))
    }

    /// Starts a file of another format with default limits.
    pub fn create_as(
        path: &Path,
        format: &VideoFormat,
        encoding: Encoding,
    ) -> Result<VideoWriter, Error> {
        VideoWriter::create_with(path, format, encoding, &Limits::default())
    }

    /// Starts a file. Only the limits of time, memory and output size apply.
    pub fn create_with(
        path: &Path,
        format: &VideoFormat,
        encoding: Encoding,
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
        let part = PartFile::beside(&path)?;
        let args = encoding.args(&part.0, format);
        let invocation = Invocation::new(installed(Tool::Ffmpeg)?, args, limits, limits.max_frames)
            .with_output(&part.0, limits.max_output_bytes);
        Ok(VideoWriter {
            format: *format,
            encoding,
            child: Some(Child::writing(invocation)?),
            part,
            path,
            padded: Vec::new(),
        })
    }

    /// Adds a frame with the size and colors of the video.
    pub fn write(&mut self, frame: &Frame) -> Result<(), Error> {
        let VideoFormat {
            width,
            height,
            color,
            ..
        } = self.format;
        if (frame.width, frame.height, frame.color) != (width, height, color)
            || self.encoding.takes_rgba()
        {
            return Err(Error::BadOutput(
                "the size or color format of a frame differs from that of the video",
            ));
        }
        if width % 2 == 0 && height % 2 == 0 || !self.encoding.is_even() {
            return self.send(&frame.planes);
        }
        let mut padded = std::mem::take(&mut self.padded);
        pad(frame, &mut padded);
        let written = self.send(&padded);
        self.padded = padded;
        written
    }

    /// Adds a frame of straight-alpha RGBA, row by row, with the size of the video.
    pub fn write_rgba(&mut self, rgba: &[u8]) -> Result<(), Error> {
        let n_bytes = self.format.width as usize * self.format.height as usize * 4;
        if rgba.len() != n_bytes || !self.encoding.takes_rgba() {
            return Err(Error::BadOutput(
                "the size or kind of a picture differs from that of the output",
            ));
        }
        self.send(rgba)
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let Some(child) = &mut self.child else {
            return Err(Error::BadOutput(
                "the encoder has failed before and takes no more frames",
            ));
        };
        let written = child.write_all(bytes);
        if written.is_err() {
            self.child = None;
        }
        written
    }

    /// Completes the video and moves the file to its path.
    pub fn finish(mut self) -> Result<(), Error> {
        let child = self.child.take().ok_or(Error::BadOutput(
            "the encoder has failed before and cannot finish the file",
        ))?;
        child.finish()?.check()?;
        std::fs::rename(&self.part.0, &self.path).map_err(Error::io("renaming the finished video"))
    }
}

/// Writes one RGBA picture with straight alpha, row by row, in the format of an encoding.
pub fn write_picture(
    path: &Path,
    [width, height]: [u32; 2],
    encoding: Encoding,
    rgba: &[u8],
) -> Result<(), Error> {
    let format = VideoFormat {
        width,
        height,
        fps: 1.0,
        color: ColorSpec::default(),
    };
    let mut writer = VideoWriter::create_as(path, &format, encoding)?;
    writer.write_rgba(rgba)?;
    writer.finish()
}

/// The file under its temporary name. Dropping it deletes the file, unless it was renamed.
struct PartFile(PathBuf);

impl PartFile {
    /// Creates the file empty, because the encoder may write this file but not create one.
    fn beside(path: &Path) -> Result<PartFile, Error> {
        let mut name = OsString::from(".");
        name.push(path.file_name().unwrap_or_default());
        name.push(".part");
        let part = path.with_file_name(name);
        // Remove the file of an earlier run, if any.
        std::fs::remove_file(&part).ok();
        std::fs::File::create_new(&part).map_err(Error::io("making the video"))?;
        Ok(PartFile(part))
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        // After a rename there is nothing to remove.
        std::fs::remove_file(&self.0).ok();
    }
}

/// Writes the planes with an even number of rows and columns, repeating the last ones if needed. Chroma
/// planes are already rounded up.
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
    fn odd_frame_gets_copies_of_its_last_row_and_column() {
        let mut frame = Frame::new(3, 3, ColorSpec::default());
        frame.planes = (1..=17).collect();
        let mut padded = Vec::new();
        pad(&frame, &mut padded);
        let luma = [1, 2, 3, 3, 4, 5, 6, 6, 7, 8, 9, 9, 7, 8, 9, 9];
        assert_eq!(padded[..16], luma);
        assert_eq!(padded[16..], [10, 11, 12, 13, 14, 15, 16, 17]);
    }
}
