//! Reading and writing of video files, by ffmpeg as a sandboxed child process (docs/explanation/promises.md,
//! "Confined media tools"). A crash or exploit of a decoder cannot reach this process.
//!
//! Pictures are the exception: libraries without unsafe C code decode them, and animated WebP, in this process.
//!
//! [`Video`] checks a file when it is opened. Its size, frame rate and length are then within the [`Limits`].
//! Its frames are planar YUV 4:2:0 at a constant rate.

mod allow_list; // arguments that restrict what ffmpeg may open
mod codecs; // decoders and encoders of the installed ffmpeg
mod container; // detection of the container from the first bytes
mod decode; // video file -> frames
mod encode; // VideoWriter: frames -> MP4, WebM, ProRes, GIF, WebP
mod error;
mod exit; // exit of a child and its meaning
mod gate; // the only module that starts a media tool; process groups
mod gray_range; // reduction of gray to 8 bits
mod image; // still pictures, such as a background
mod invocation; // one run of a media tool
mod limits;
mod notice; // notices about accepted footage
mod pictures; // folder, zip, TIFF or animated WebP -> frames
mod probe; // contents of a file: headers, packets, pictures, times
mod read_options; // metadata given by the user
mod sandbox; // sandbox of a child
mod tools; // paths of the tools, and the layers in which they run
mod video; // Video: video files and still pictures

pub use codecs::Codecs;
pub use encode::{Encoding, Quality, VideoFormat, VideoWriter, write_picture};
pub use error::{Damage, Error};
pub use gate::ProcessGroup;
pub use image::{decode_image, read_image};
pub use limits::Limits;
pub use notice::Notice;
pub use probe::check_ffprobe_output;
pub use read_options::ReadOptions;
pub use sandbox::{Layer, Layers};
pub use tools::{
    FoundTools, SandboxStatus, Tool, adopt_tools, configure, found_tools, required_sandbox,
    sandbox_status, search_in_background, tool_version,
};
pub use video::Video;
