//! A school: every individual of a flock as a virtual animal in the space of the tank.
//!
//! A flock shows filmed frames, turned and mirrored, at places in a tank. The school shows the virtual animal of the
//! same frames there. A frame's direction is that relative to the line of sight, so the animal looks from the camera as
//! the sprite does. Cross-fades between two sprites become postures between both.

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;

use crate::fish::motion::{nearest_sign, slerp, toward_sight, upright_along};
use crate::fish::spine::N_JOINTS;
use crate::fish::{Film, Motion, Posture};
use crate::flock::{Flock, Individual, Space};
use crate::formats::glb::eye::Eye;
use crate::formats::glb::rig::Swimmer;
use crate::formats::glb::{Stage, write_scene};
use crate::geometry::Camera;
use crate::library::View;

/// Returns the school of a flock as the bytes of a GLB file. `film` is the virtual animal of the flock's library, which
/// was filmed from `view`. Panics if the flock does not fit the library (`Flock::fits`).
pub fn write_school(flock: &Flock, view: View, film: &Film) -> Vec<u8> {
    let school = School {
        space: &flock.space,
        length_px: flock.length_px,
        view,
        motion: film.motion(),
    };
    let postures: Vec<Vec<Posture>> = flock
        .individuals
        .par_iter()
        .map(|one| school.swim(one))
        .collect();
    let swimmers = flock.individuals.iter().zip(&postures);
    write_scene(
        &Stage {
            name: "school",
            fps: flock.fps,
            swimmers: swimmers
                .map(|(one, frames)| Swimmer {
                    id: Some(one.id),
                    size: one.size,
                    frames,
                })
                .collect(),
            eye: school.eye(flock.image_size_px),
        },
        film.renderer().mesh(),
    )
}

struct School<'a> {
    space: &'a Space,
    /// One body length in the picture, pixels.
    length_px: f64,
    view: View,
    /// Motion of the animal in the footage.
    motion: &'a Motion,
}

/// A filmed frame as a flock shows it.
struct Shown {
    source_frame: u32,
    mirrored: bool,
    rotation_rad: f64,
}

/// Direction and bend of an animal.
#[derive(Clone, Copy)]
struct Look {
    rotation: DQuat,
    joint_angles_rad: [f64; N_JOINTS],
}

impl School<'_> {
    /// Returns the posture of an individual in every frame.
    fn swim(&self, one: &Individual) -> Vec<Posture> {
        let mut before = DQuat::IDENTITY;
        (0..one.source_frame.len())
            .map(|k| {
                let place_bl = self.place_bl(one, k);
                let look = self.look_at(one, k, place_bl);
                before = nearest_sign(before, look.rotation);
                let center_m = DVec3::from(place_bl) * self.motion.size.length_m;
                let ahead_m = one.size * self.motion.origin_ahead_m();
                Posture {
                    position_m: center_m + before * DVec3::X * ahead_m,
                    rotation: before,
                    joint_angles_rad: look.joint_angles_rad,
                    visible: true,
                }
            })
            .collect()
    }

    /// Returns where an individual is in a frame: where its sprite is drawn, as deep in the tank as its boid.
    fn place_bl(&self, one: &Individual, k: usize) -> [f64; 3] {
        let behind_bl = one.boid.position_px[k][2] / self.length_px;
        let depth_bl = self.space.front_bl + behind_bl;
        self.space.lens.place_bl(one.centroid_px[k], depth_bl)
    }

    /// Returns the look of an individual: that of its sprite, and during a fade one between those of both sprites.
    fn look_at(&self, one: &Individual, k: usize, place_bl: [f64; 3]) -> Look {
        let mut look = self.look(
            &Shown {
                source_frame: one.source_frame[k],
                mirrored: one.mirrored[k],
                rotation_rad: one.rotation_rad[k],
            },
            place_bl,
        );
        for fade in &one.fades {
            let at = k.wrapping_sub(fade.start as usize);
            let Some(&weight) = fade.weight.get(at) else {
                continue;
            };
            let other = Shown {
                source_frame: fade.source_frame[at],
                mirrored: fade.mirrored,
                rotation_rad: fade.rotation_rad[at],
            };
            let other = self.look(&other, place_bl);
            let (a, b) = (look.joint_angles_rad, other.joint_angles_rad);
            look = Look {
                rotation: slerp(look.rotation, other.rotation, weight),
                joint_angles_rad: std::array::from_fn(|j| a[j] + weight * (b[j] - a[j])),
            };
        }
        look
    }

    /// Returns the look of the animal of a shown frame at a place in the tank.
    fn look(&self, shown: &Shown, place_bl: [f64; 3]) -> Look {
        let filmed = &self.motion.frames[shown.source_frame as usize];
        let sign = if shown.mirrored { -1.0 } else { 1.0 };
        let in_picture = |rotation: DQuat| {
            let mirrored = if shown.mirrored {
                mirror_image(rotation)
            } else {
                rotation
            };
            about_z(shown.rotation_rad) * mirrored
        };
        let rotation = match self.view {
            View::Top => in_picture(filmed.rotation),
            View::Side => {
                let sight = DVec3::from(self.space.lens.sight(place_bl));
                let sight = DQuat::from_rotation_arc(DVec3::Z, sight);
                let filmed_sight = toward_sight(&self.motion.camera, filmed.position_m);
                let seen = in_picture(filmed_sight.inverse() * filmed.rotation);
                // The back stays up at every place: only the direction turns with the line of sight.
                let upright = upright_along(sight * seen * DVec3::X);
                let mut roll = upright_along(filmed.forward()).inverse() * filmed.rotation;
                roll.x *= sign;
                upright * roll
            }
        };
        Look {
            rotation,
            joint_angles_rad: filmed.joint_angles_rad.map(|angle| sign * angle),
        }
    }

    /// Returns the camera of the tank, if glTF can represent it.
    fn eye(&self, image_size_px: [u32; 2]) -> Option<Eye> {
        let length_m = self.motion.size.length_m;
        let Some(camera) = self.space.lens.camera() else {
            return Some(Eye::flat(image_size_px, length_m / self.length_px));
        };
        let camera = Camera {
            z_min_m: 1.0,
            pane_px_per_m: camera.focal_px,
            center_px: camera.center_px,
            medium_index: camera.medium_index,
        };
        Eye::of_camera(&camera, image_size_px)
    }
}

/// Returns the rotation of the animal in a picture that is mirrored left to right. Its own left and right change too.
fn mirror_image(rotation: DQuat) -> DQuat {
    let flip = DVec3::new(-1.0, 1.0, 1.0);
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::NEG_Z].map(|axis| rotation * axis * flip);
    DQuat::from_mat3(&DMat3::from_cols(x, y, z))
}

/// Returns the rotation in the picture by an angle, clockwise.
fn about_z(angle_rad: f64) -> DQuat {
    let half = 0.5 * angle_rad;
    DQuat::from_xyzw(0.0, 0.0, libm::sin(half), libm::cos(half))
}

#[cfg(test)]
mod tests;
