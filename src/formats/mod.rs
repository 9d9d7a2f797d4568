//! Values to bytes and back: the files that are a contract (DESIGN.md). Only `library_dir` touches
//! the file system.

pub mod csv;
pub mod distance_map;
pub mod evidence;
pub mod flock_json;
pub mod flock_overlay;
pub mod glb;
pub mod ground_truth;
pub mod library_dir;
pub mod library_json;
mod mover;
pub mod npy;
pub mod overlay;
pub mod params;
pub mod picture;
pub mod picture_archive;
pub mod poses_json;
pub mod svg;
