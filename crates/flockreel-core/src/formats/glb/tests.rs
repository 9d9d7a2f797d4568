//! Reads the file back and compares the pose of the fish in a glTF viewer with that in the renderer.

use glam::{DMat4, DQuat, DVec3};
use gltf_json::Root;

use gltf_json::animation::Property;

use super::*;
use crate::fish::Palette;
use crate::fish::sample::{SampleFilm, SampleParams};
use crate::fish::spine::{N_JOINTS, joint_frames};

/// Index of the node that carries the motion of the only fish.
const ROOT: u32 = 0;

fn motion(n_frames: usize) -> Motion {
    let params = SampleParams {
        n_frames,
        width: 64,
        height: 64,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).expect("in range");
    film.motion().clone()
}

/// Returns the file of a goldfish.
fn written(motion: &Motion) -> Vec<u8> {
    write(motion, &FishMesh::goldfish(motion.size, Palette::Goldfish))
}

/// Returns the two chunks of a GLB.
fn open(file: &[u8]) -> (Root, Vec<u8>) {
    let word =
        |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!(&file[..4], b"glTF");
    assert_eq!((word(4), word(8)), (2, file.len()));
    let json_len = word(12);
    assert_eq!(&file[16..20], b"JSON");
    let bin_at = 20 + json_len;
    assert_eq!((json_len % 4, bin_at + 8 + word(bin_at)), (0, file.len()));
    let root = Root::from_slice(&file[20..bin_at]).expect("it is JSON");
    (root, file[bin_at + 8..].to_vec())
}

/// Returns the floats of an accessor.
fn floats(root: &Root, bytes: &[u8], accessor: usize) -> Vec<f32> {
    let view = root.accessors[accessor].buffer_view.expect("it has bytes");
    let view = &root.buffer_views[view.value()];
    let at = view.byte_offset.expect("it is written").0 as usize;
    assert_eq!(at % 4, 0);
    bytes[at..at + view.byte_length.0 as usize]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().expect("four bytes")))
        .collect()
}

fn channel(root: &Root, node: u32, path: Property) -> (usize, usize) {
    let animation = &root.animations[0];
    let found = animation
        .channels
        .iter()
        .find(|c| {
            c.target.node.value() == node as usize && c.target.path.as_ref().unwrap() == &path
        })
        .expect("the channel is there");
    let sampler = &animation.samplers[found.sampler.value()];
    (sampler.input.value(), sampler.output.value())
}

#[test]
fn joints_of_the_file_are_at_the_positions_of_the_renderer() {
    let motion = motion(12);
    let (root, bytes) = open(&written(&motion));
    let k = 7;
    let key = |node, path| {
        let (_, output) = channel(&root, node, path);
        let all = floats(&root, &bytes, output);
        let n = all.len() / 12;
        all[k * n..(k + 1) * n]
            .iter()
            .map(|&v| f64::from(v))
            .collect::<Vec<f64>>()
    };
    let turn = |node| DQuat::from_slice(&key(node, Property::Rotation)).normalize();
    let place = DVec3::from_slice(&key(ROOT, Property::Translation));
    let mut world = DMat4::from_rotation_translation(turn(ROOT), place);
    let posture = &motion.frames[k];
    let joints = joint_frames(motion.size.length_m, &posture.joint_angles_rad);
    for (j, (pivot, rotation)) in joints.iter().enumerate() {
        let node = &root.nodes[ROOT as usize + 1 + j];
        let offset = node.translation.expect("it is written").map(f64::from);
        world *= DMat4::from_rotation_translation(turn(ROOT + 1 + j as u32), DVec3::from(offset));
        let want = posture.position_m + posture.rotation * *pivot;
        let got = world.transform_point3(DVec3::ZERO) * DVec3::new(1.0, -1.0, -1.0);
        assert!((got - want).length() < 1e-6, "joint {j}: {got} {want}");
        let ahead = posture.rotation * *rotation * DVec3::X;
        let got = world.transform_vector3(DVec3::X) * DVec3::new(1.0, -1.0, -1.0);
        assert!((got - ahead).length() < 1e-5, "joint {j}: {got} {ahead}");
    }
}

#[test]
fn inverse_bind_matrices_undo_the_joints_at_rest() {
    let (root, bytes) = open(&written(&motion(2)));
    let skin = &root.skins[0];
    let matrices = floats(
        &root,
        &bytes,
        skin.inverse_bind_matrices.expect("written").value(),
    );
    assert_eq!(
        (skin.joints.len(), matrices.len()),
        (N_JOINTS, 16 * N_JOINTS)
    );
    let mut world = DVec3::ZERO;
    for (joint, matrix) in skin.joints.iter().zip(matrices.chunks_exact(16)) {
        let offset = root.nodes[joint.value()].translation.expect("written");
        world += DVec3::from(offset.map(f64::from));
        let column: Vec<f64> = matrix[12..15].iter().map(|&v| f64::from(v)).collect();
        assert!((world + DVec3::from_slice(&column)).length() < 1e-7);
    }
}

#[test]
fn bounds_match_the_vertices_and_indices_are_in_range() {
    let (root, bytes) = open(&written(&motion(3)));
    for primitive in &root.meshes[0].primitives {
        let accessor = primitive.attributes[&Valid(Semantic::Positions)].value();
        let points = floats(&root, &bytes, accessor);
        let lowest = points
            .iter()
            .skip(1)
            .step_by(3)
            .fold(f32::MAX, |a, &b| a.min(b));
        let min = root.accessors[accessor].min.as_ref().expect("written");
        assert_eq!(min[1].as_f64().expect("a number") as f32, lowest);
        let indices = floats(&root, &bytes, primitive.indices.expect("written").value());
        let n_vertices = points.len() / 3;
        assert!(indices.iter().all(|v| (v.to_bits() as usize) < n_vertices));
    }
}

#[test]
fn fish_is_upright_and_times_are_those_of_the_frames() {
    let (root, bytes) = open(&written(&motion(30)));
    let (input, output) = channel(&root, ROOT, Property::Rotation);
    let times = floats(&root, &bytes, input);
    assert!((f64::from(times[29]) - 29.0 / 30.0).abs() < 1e-6);
    for turn in floats(&root, &bytes, output).chunks_exact(4) {
        let turn = DQuat::from_array([0, 1, 2, 3].map(|c| f64::from(turn[c])));
        assert!((turn * DVec3::Y).y > 0.7, "up is +y, and the back is up");
    }
}

#[test]
fn only_a_fish_with_hidden_frames_has_a_scale_track() {
    let mut motion = motion(4);
    let has_scale = |motion: &Motion| {
        let (root, _) = open(&written(motion));
        let channels = root.animations[0].channels.iter();
        channels
            .filter(|c| c.target.path.as_ref().unwrap() == &Property::Scale)
            .count()
    };
    assert_eq!(has_scale(&motion), 0);
    motion.frames[2].visible = false;
    assert_eq!(has_scale(&motion), 1);
}
