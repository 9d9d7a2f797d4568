//! Skeletons of the swimmers, their skins, and the animation that moves them.

use gltf_json::animation::{Channel, Interpolation, Property, Sampler, Target};
use gltf_json::scene::UnitQuaternion;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Animation, Index, Mesh, Node, Skin};

use super::Stage;
use super::pack::Packer;
use super::y_up;
use crate::fish::Posture;
use crate::fish::spine::{N_JOINTS, about_y, joint_at_rest_m};

/// One animal of a scene.
pub(super) struct Swimmer<'a> {
    /// Number among several; `None` if there is only one.
    pub(super) id: Option<u32>,
    /// Length relative to the mesh.
    pub(super) size: f64,
    /// Posture in every frame.
    pub(super) frames: &'a [Posture],
}

impl Swimmer<'_> {
    /// Returns the name of a part.
    fn named(&self, part: &str) -> Option<String> {
        Some(match self.id {
            Some(id) => format!("animal {id} {part}"),
            None => part.to_owned(),
        })
    }
}

/// Adds all swimmers with their skins and motions. Returns the nodes of the scene: for each swimmer the root, and the
/// surface, which has no place of its own.
pub(super) fn add(
    packer: &mut Packer,
    stage: &Stage,
    mesh: Index<Mesh>,
    length_m: f64,
) -> Vec<Index<Node>> {
    let at_rest: Vec<[f32; 3]> = (0..N_JOINTS)
        .map(|j| y_up(joint_at_rest_m(length_m, j).to_array()))
        .collect();
    let inverse: Vec<[f32; 16]> = at_rest.iter().map(inverse_of_move).collect();
    let inverse = packer.matrices(&inverse);
    let mut nodes = Vec::new();
    let mut roots = Vec::new();
    for swimmer in &stage.swimmers {
        let root = add_skeleton(packer, swimmer, &at_rest);
        let skin = packer.root.push(Skin {
            extensions: None,
            extras: None,
            inverse_bind_matrices: Some(inverse),
            joints: (1..=N_JOINTS as u32)
                .map(|j| Index::new(root + j))
                .collect(),
            name: swimmer.named("spine"),
            skeleton: Some(Index::new(root)),
        });
        let surface = packer.root.push(Node {
            mesh: Some(mesh),
            skin: Some(skin),
            name: swimmer.named("surface"),
            ..Node::default()
        });
        nodes.extend([Index::new(root), surface]);
        roots.push(root);
    }
    add_animation(packer, stage, &roots);
    nodes
}

/// Adds the root and the chain of joints below it, all at rest. Returns the root; its joints follow it.
fn add_skeleton(packer: &mut Packer, swimmer: &Swimmer, at_rest: &[[f32; 3]]) -> u32 {
    let root = packer.root.nodes.len() as u32;
    let child = |node: u32| Some(vec![Index::new(node)]);
    let start = swimmer.frames.first();
    packer.root.push(Node {
        children: child(root + 1),
        name: swimmer.named("fish"),
        translation: start.map(|p| y_up(p.position_m.to_array())),
        rotation: start.map(|p| UnitQuaternion(turned(p.rotation))),
        scale: (swimmer.size != 1.0).then_some([swimmer.size as f32; 3]),
        ..Node::default()
    });
    for (j, here) in at_rest.iter().enumerate() {
        let before = if j == 0 { [0.0; 3] } else { at_rest[j - 1] };
        packer.root.push(Node {
            children: (j + 1 < N_JOINTS)
                .then(|| child(root + 2 + j as u32))
                .flatten(),
            name: swimmer.named(&format!("spine {j}")),
            translation: Some([0, 1, 2].map(|c| here[c] - before[c])),
            ..Node::default()
        });
    }
    root
}

/// Returns the matrix that undoes a move, column by column.
fn inverse_of_move([x, y, z]: &[f32; 3]) -> [f32; 16] {
    [
        1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -x, -y, -z, 1.0,
    ]
}

/// Adds one animation of all swimmers, whose roots are given.
fn add_animation(packer: &mut Packer, stage: &Stage, roots: &[u32]) {
    let n_frames = stage.swimmers.first().map_or(0, |one| one.frames.len());
    if n_frames == 0 {
        return;
    }
    let times: Vec<f32> = (0..n_frames)
        .map(|k| (k as f64 / stage.fps) as f32)
        .collect();
    let mut tracks = Tracks {
        times: packer.times(&times),
        channels: Vec::new(),
        samplers: Vec::new(),
    };
    for (swimmer, &root) in stage.swimmers.iter().zip(roots) {
        tracks.add_swimmer(packer, swimmer, root);
    }
    packer.root.push(Animation {
        extensions: None,
        extras: None,
        channels: tracks.channels,
        name: Some("swim".into()),
        samplers: tracks.samplers,
    });
}

/// Animation channels that share one list of times.
struct Tracks {
    times: Index<Accessor>,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

impl Tracks {
    fn add_swimmer(&mut self, packer: &mut Packer, swimmer: &Swimmer, root: u32) {
        use Property::{Rotation, Scale, Translation};
        let frames = swimmer.frames.iter();
        let places: Vec<[f32; 3]> = frames
            .clone()
            .map(|p| y_up(p.position_m.to_array()))
            .collect();
        self.add(root, Translation, packer.keys(&places));
        let turns: Vec<[f32; 4]> = frames.clone().map(|p| turned(p.rotation)).collect();
        self.add(root, Rotation, packer.turns(&turns));
        if frames.clone().any(|p| !p.visible) {
            let size = |p: &Posture| [swimmer.size as f32 * f32::from(p.visible); 3];
            let sizes: Vec<[f32; 3]> = frames.clone().map(size).collect();
            self.add(root, Scale, packer.keys(&sizes));
        }
        for j in 0..N_JOINTS {
            let bend = |p: &Posture| turned(about_y(p.joint_angles_rad[j]));
            let bends: Vec<[f32; 4]> = frames.clone().map(bend).collect();
            self.add(root + 1 + j as u32, Rotation, packer.turns(&bends));
        }
    }

    fn add(&mut self, node: u32, path: Property, output: Index<Accessor>) {
        let interpolation = match path {
            Property::Scale => Interpolation::Step,
            _ => Interpolation::Linear,
        };
        let sampler = Index::push(
            &mut self.samplers,
            Sampler {
                extensions: None,
                extras: None,
                input: self.times,
                interpolation: Valid(interpolation),
                output,
            },
        );
        self.channels.push(Channel {
            sampler,
            target: Target {
                extensions: None,
                extras: None,
                node: Index::new(node),
                path: Valid(path),
            },
            extensions: None,
            extras: None,
        });
    }
}

/// Converts a rotation from camera coordinates to glTF coordinates.
fn turned(rotation: glam::DQuat) -> [f32; 4] {
    let q = rotation.normalize();
    [
        q.x as f32 + 0.0,
        0.0 - q.y as f32,
        0.0 - q.z as f32,
        q.w as f32,
    ]
}
