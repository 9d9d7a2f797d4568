//! Video files in and out, by ffmpeg as a child process behind one gate (RELIABILITY.md, "Facts"
//! and "The gate"; ECOSYSTEM.md 5). A decoder's crash or exploit must never be ours.
//!
//! Pictures are the exception: libraries without unsafe C decode them here.
//!
//! [`Video`] parses a foreign file at the door: once it is open, its size, rate and length are
//! within the [`Limits`], and its frames come as planar 4:2:0 at a constant rate.

mod allow_list; // what ffmpeg may open and run
mod coders; // what the installed ffmpeg can read and write
mod container; // which of the accepted containers a file is, by its first bytes
mod decode; // a film -> frames
mod encode; // VideoWriter: frames -> MP4, WebM, ProRes, GIF, WebP
mod end; // how a child ended
mod error;
mod gate; // the one place that starts a process
mod hints; // what a person says of a film
mod image; // a given background
mod limits;
mod niceness; // who steps back for whom
mod note; // what is worth knowing of a film that was accepted
mod pictures; // a folder, a zip or a TIFF of pictures -> frames
mod probe; // what a file holds: headers, packets, pictures, times
mod sandbox; // what the child may do
mod stretch; // which levels of gray become black and white
mod tools; // where the tools lie, and in which walls they work
mod video; // Video: films and pictures alike

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
