//! Reading and writing of video files, by ffmpeg as a sandboxed child process (docs/explanation/promises.md,
//! "Confined media tools"). A crash or exploit of a decoder cannot reach this process.
//!
//! Still pictures are the exception: libraries without unsafe C code decode them in this process.
//!
//! [`Video`] checks a file when it is opened. Its size, frame rate and length are then within the [`Limits`].
//! Its frames are planar YUV 4:2:0 at a constant rate.

mod allow_list; // arguments that restrict what ffmpeg may open
mod coders; // decoders and encoders of the installed ffmpeg
mod container; // detection of the container from the first bytes
mod decode; // video file -> frames
mod encode; // VideoWriter: frames -> MP4, WebM, ProRes, GIF, WebP
mod end; // exit of a child and its meaning
mod error;
mod gate; // the only module that starts a media tool
mod hints; // metadata given by the user
mod image; // still pictures, such as a background
mod limits;
mod niceness; // priority of media tools
mod note; // notes about accepted footage
mod pictures; // folder, zip or TIFF of pictures -> frames
mod probe; // contents of a file: headers, packets, pictures, times
mod sandbox; // sandbox of a child
mod stretch; // reduction of gray to 8 bits
mod tools; // paths of the tools, and the layers in which they run
mod video; // Video: video files and still pictures

pub use coders::Coders;
pub use encode::{Coding, Quality, VideoFormat, VideoWriter};
pub use error::{Damage, Error};
pub use hints::Hints;
pub use image::{decode_image, read_image};
pub use limits::Limits;
pub use note::Note;
pub use sandbox::{Layer, Layers};
pub use tools::{Tool, Walls, demanded_walls, look_for, set_up, tool_version, walls};
pub use video::Video;
