//! `space` of flock.json: the camera and the walls of the tank, in body lengths (docs/reference/formats.md,
//! "flock.json").
//!
//! A boid at `position` (x, y, behind) is at depth z = `front_bl` + behind / `length_px` body lengths from
//! the camera. It is (x - cx) / px body lengths to the right of the camera, and likewise in y. With a camera,
//! cx is from `center_px` and px = `focal_px` / (`pane_bl` + (z - `pane_bl`) / `medium_index`). Without one,
//! cx is 0 and px = `length_px`.

use serde::{Deserialize, Serialize};

use crate::flock::Space;
use crate::flock::boids::tank::Wall;
use crate::flock::lens::{Lens, Pinhole};

/// `camera` is null if the size in the picture does not depend on the position.
#[derive(Serialize, Deserialize)]
pub(super) struct SpaceFile {
    camera: Option<CameraFile>,
    front_bl: f64,
    up: [f64; 3],
    walls: Vec<WallFile>,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct CameraFile(#[serde(with = "CameraFields")] Pinhole);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Pinhole")]
struct CameraFields {
    focal_px: f64,
    center_px: [f64; 2],
    pane_bl: f64,
    medium_index: f64,
    /// Metres per body length; null if unknown.
    #[serde(rename = "m_per_bl")]
    metres: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(transparent)]
struct WallFile(#[serde(with = "WallFields")] Wall);

/// A point is inside if `outward` . point <= `offset_bl`.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Wall")]
struct WallFields {
    outward: [f64; 3],
    offset_bl: f64,
}

impl SpaceFile {
    pub(super) fn new(space: &Space) -> SpaceFile {
        SpaceFile {
            camera: space.lens.camera().copied().map(CameraFile),
            front_bl: space.front_bl,
            up: space.up,
            walls: space.walls.iter().copied().map(WallFile).collect(),
        }
    }

    /// Returns the space; for an older file without one, a plane without walls.
    pub(super) fn into_space(file: Option<SpaceFile>, length_px: f64) -> Space {
        let Some(file) = file else {
            return Space {
                lens: Lens::flat(length_px),
                front_bl: 0.0,
                up: [0.0, 0.0, 1.0],
                walls: Vec::new(),
            };
        };
        Space {
            lens: Lens::with(length_px, file.camera.map(|camera| camera.0)),
            front_bl: file.front_bl,
            up: file.up,
            walls: file.walls.into_iter().map(|wall| wall.0).collect(),
        }
    }
}
