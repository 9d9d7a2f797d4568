//! The filming camera of a GLB file.

use gltf_json::camera::{Orthographic, Perspective, Type};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Camera as Lens, Index, Node};

use super::pack::Packer;
use super::y_up;
use crate::geometry::Camera;

/// Filming camera that looks along z.
pub(super) struct Eye {
    /// Position, camera frame, metres.
    at_m: [f64; 3],
    /// Width divided by height of the picture.
    aspect: f64,
    half_height: HalfHeight,
}

/// Half of the height of the picture.
enum HalfHeight {
    /// As an angle, radians.
    Angle(f64),
    /// As a length that is the same at every depth, metres.
    Length(f64),
}

/// Distance of the near plane from the camera, metres. Free choice.
const NEAR_M: f64 = 0.01;

impl Eye {
    /// Returns a camera at the origin; `None` if glTF cannot represent it: it has the principal point in the middle of
    /// the image and no refraction.
    pub(super) fn of_camera(camera: &Camera, image_size_px: [u32; 2]) -> Option<Eye> {
        let [width, height] = image_size_px.map(f64::from);
        if camera.center_px != [0.5 * width, 0.5 * height] || camera.medium_index != 1.0 {
            return None;
        }
        let tangent = 0.5 * height / camera.focal_px();
        Some(Eye {
            at_m: [0.0; 3],
            aspect: width / height,
            half_height: HalfHeight::Angle(libm::atan(tangent)),
        })
    }

    /// Returns a camera without perspective, for a picture whose first pixel is at the origin.
    pub(super) fn flat(image_size_px: [u32; 2], m_per_px: f64) -> Eye {
        let [width, height] = image_size_px.map(|side_px| f64::from(side_px) * m_per_px);
        Eye {
            // As far from what it films as the picture is high; any distance shows the same.
            at_m: [0.5 * width, 0.5 * height, -height],
            aspect: width / height,
            half_height: HalfHeight::Length(0.5 * height),
        }
    }

    /// Adds the camera. Returns its node.
    pub(super) fn add(&self, packer: &mut Packer) -> Index<Node> {
        let (mut perspective, mut orthographic) = (None, None);
        let type_ = match self.half_height {
            HalfHeight::Angle(half_rad) => {
                perspective = Some(Perspective {
                    aspect_ratio: Some(self.aspect as f32),
                    yfov: (2.0 * half_rad) as f32,
                    zfar: None,
                    znear: NEAR_M as f32,
                    extensions: None,
                    extras: None,
                });
                Type::Perspective
            }
            HalfHeight::Length(half_m) => {
                orthographic = Some(Orthographic {
                    xmag: (self.aspect * half_m) as f32,
                    ymag: half_m as f32,
                    // Twice as far as what it films.
                    zfar: (NEAR_M + 4.0 * half_m) as f32,
                    znear: NEAR_M as f32,
                    extensions: None,
                    extras: None,
                });
                Type::Orthographic
            }
        };
        let lens = packer.root.push(Lens {
            name: Some("filming camera".into()),
            orthographic,
            perspective,
            type_: Valid(type_),
            extensions: None,
            extras: None,
        });
        let is_moved = self.at_m != [0.0; 3];
        packer.root.push(Node {
            camera: Some(lens),
            name: Some("filming camera".into()),
            translation: is_moved.then(|| y_up(self.at_m)),
            ..Node::default()
        })
    }
}
