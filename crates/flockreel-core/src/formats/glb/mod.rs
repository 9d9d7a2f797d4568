//! The virtual fish as one GLB file: mesh, skin of 8 joints and animation (docs/reference/formats.md,
//! "Virtual fish"). The Khronos validator reports no errors.
//!
//! glTF is right-handed with y up. The point (x, y, z) in camera coordinates becomes (x, -y, -z), a rotation
//! by pi about the x axis. The filming camera is then at the origin and looks along -z, as glTF requires.

mod pack;

use gltf_json::animation::{Channel, Interpolation, Property, Sampler, Target};
use gltf_json::camera::{Perspective, Type as CameraType};
use gltf_json::material::{AlphaMode, PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::scene::UnitQuaternion;
use gltf_json::texture::Info;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Animation, Camera, Index, Material, Mesh, Node, Scene, Skin, Texture};

use self::pack::Packer;
use super::picture::write_rgba;
use crate::fish::Motion;
use crate::fish::mesh::{Mesh as FishMesh, Vertex};
use crate::fish::spine::{N_JOINTS, about_y, joint_at_rest_m};

/// Returns the motion of a fish as the bytes of a GLB file.
pub fn write(motion: &Motion, fish: &FishMesh) -> Vec<u8> {
    let mut packer = Packer::default();
    let mesh = add_mesh(&mut packer, fish);
    let first_joint = add_skeleton(&mut packer, motion);
    let skin = add_skin(&mut packer, motion, first_joint);
    let root = Index::new(ROOT);
    let surface = packer.root.push(Node {
        mesh: Some(mesh),
        skin: Some(skin),
        name: Some("surface".into()),
        ..Node::default()
    });
    let mut nodes = vec![root, surface];
    nodes.extend(add_camera(&mut packer, motion));
    add_animation(&mut packer, motion, first_joint);
    let scene = packer.root.push(Scene {
        extensions: None,
        extras: None,
        name: Some("virtual fish".into()),
        nodes,
    });
    packer.root.scene = Some(scene);
    packer.root.asset.generator = Some(concat!("flockreel ", env!("CARGO_PKG_VERSION")).into());
    packer.into_glb()
}

/// Index of the node that carries the motion of the whole fish: the first node.
const ROOT: u32 = 0;

fn add_mesh(packer: &mut Packer, fish: &FishMesh) -> Index<Mesh> {
    let of = |pick: fn(&Vertex) -> [f64; 3]| -> Vec<[f32; 3]> {
        fish.vertices.iter().map(|v| y_up(pick(v))).collect()
    };
    let weights: Vec<[f32; 4]> = fish.vertices.iter().map(weights).collect();
    let joints: Vec<[u8; 4]> = fish.vertices.iter().map(joints).collect();
    let (look, picture) = add_look(packer, fish);
    let attributes = [
        (
            Semantic::Positions,
            packer.positions(&of(|v| v.position_m.to_array())),
        ),
        (
            Semantic::Normals,
            packer.vectors(&of(|v| v.normal.to_array())),
        ),
        look,
        (Semantic::Joints(0), packer.joints(&joints)),
        (Semantic::Weights(0), packer.weights(&weights)),
    ];
    let mut primitives = Vec::new();
    let surfaces = [
        (&fish.body, "body", AlphaMode::Opaque, 0.42),
        (&fish.fins, "fins", AlphaMode::Blend, 0.6),
    ];
    for (triangles, name, alpha, rough) in surfaces {
        if triangles.is_empty() {
            continue;
        }
        let material = add_material(packer, name, alpha, rough, picture);
        primitives.push(Primitive {
            attributes: attributes
                .iter()
                .cloned()
                .map(|(s, a)| (Valid(s), a))
                .collect(),
            extensions: None,
            extras: None,
            indices: Some(packer.indices(triangles)),
            material: Some(material),
            mode: Valid(Mode::Triangles),
            targets: None,
        });
    }
    packer.root.push(Mesh {
        extensions: None,
        extras: None,
        name: Some("animal".into()),
        primitives,
        weights: None,
    })
}

/// Adds what colors the surface: a picture and its coordinates, or a color at every vertex.
fn add_look(
    packer: &mut Packer,
    fish: &FishMesh,
) -> ((Semantic, Index<Accessor>), Option<Index<Texture>>) {
    let vertices = fish.vertices.iter();
    let Some(picture) = &fish.picture else {
        let colors: Vec<[u16; 4]> = vertices.map(|v| linear(v.material.color)).collect();
        return ((Semantic::Colors(0), packer.colors(&colors)), None);
    };
    let places: Vec<[f32; 2]> = vertices.map(|v| v.material.grain).collect();
    let png = write_rgba(picture.width, picture.height, &picture.pixels);
    let image = packer.png(png);
    let texture = packer.root.push(Texture {
        name: None,
        sampler: None,
        source: image,
        extensions: None,
        extras: None,
    });
    (
        (Semantic::TexCoords(0), packer.places(&places)),
        Some(texture),
    )
}

fn add_material(
    packer: &mut Packer,
    name: &str,
    alpha: AlphaMode,
    rough: f32,
    picture: Option<Index<Texture>>,
) -> Index<Material> {
    packer.root.push(Material {
        alpha_mode: Valid(alpha),
        double_sided: alpha == AlphaMode::Blend,
        name: Some(name.into()),
        pbr_metallic_roughness: PbrMetallicRoughness {
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(rough),
            base_color_texture: picture.map(|index| Info {
                index,
                tex_coord: 0,
                extensions: None,
                extras: None,
            }),
            ..PbrMetallicRoughness::default()
        },
        ..Material::default()
    })
}

/// Adds the root and the chain of joints below it, all at rest. Returns the first joint.
fn add_skeleton(packer: &mut Packer, motion: &Motion) -> u32 {
    let child = |node: u32| Some(vec![Index::new(node)]);
    let start = motion.frames.first();
    packer.root.push(Node {
        children: child(ROOT + 1),
        name: Some("fish".into()),
        translation: start.map(|p| y_up(p.position_m.to_array())),
        rotation: start.map(|p| UnitQuaternion(turned(p.rotation))),
        ..Node::default()
    });
    for j in 0..N_JOINTS {
        let here = joint_at_rest_m(motion.size.length_m, j);
        let offset = match j {
            0 => here,
            j => here - joint_at_rest_m(motion.size.length_m, j - 1),
        };
        packer.root.push(Node {
            children: (j + 1 < N_JOINTS).then(|| vec![Index::new(ROOT + 2 + j as u32)]),
            name: Some(format!("spine {j}")),
            translation: Some(y_up(offset.to_array())),
            ..Node::default()
        });
    }
    ROOT + 1
}

fn add_skin(packer: &mut Packer, motion: &Motion, first_joint: u32) -> Index<Skin> {
    let inverse: Vec<[f32; 16]> = (0..N_JOINTS)
        .map(|j| {
            let [x, y, z] = y_up(joint_at_rest_m(motion.size.length_m, j).to_array());
            [
                1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -x, -y, -z, 1.0,
            ]
        })
        .collect();
    let inverse_bind_matrices = Some(packer.matrices(&inverse));
    packer.root.push(Skin {
        extensions: None,
        extras: None,
        inverse_bind_matrices,
        joints: (0..N_JOINTS as u32)
            .map(|j| Index::new(first_joint + j))
            .collect(),
        name: Some("spine".into()),
        skeleton: Some(Index::new(ROOT)),
    })
}

/// Adds the filming camera if glTF can represent it: principal point in the middle of the image and no
/// refraction.
fn add_camera(packer: &mut Packer, motion: &Motion) -> Option<Index<Node>> {
    let (camera, [width, height]) = (&motion.camera, motion.image_size_px.map(f64::from));
    if camera.center_px != [0.5 * width, 0.5 * height] || camera.medium_index != 1.0 {
        return None;
    }
    let yfov = 2.0 * libm::atan(0.5 * height / camera.focal_px());
    let lens = packer.root.push(Camera {
        name: Some("filming camera".into()),
        orthographic: None,
        perspective: Some(Perspective {
            aspect_ratio: Some((width / height) as f32),
            yfov: yfov as f32,
            zfar: None,
            znear: 0.01,
            extensions: None,
            extras: None,
        }),
        type_: Valid(CameraType::Perspective),
        extensions: None,
        extras: None,
    });
    Some(packer.root.push(Node {
        camera: Some(lens),
        name: Some("filming camera".into()),
        ..Node::default()
    }))
}

fn add_animation(packer: &mut Packer, motion: &Motion, first_joint: u32) {
    let frames = &motion.frames;
    if frames.is_empty() {
        return;
    }
    let times: Vec<f32> = (0..frames.len())
        .map(|k| (k as f64 / motion.fps) as f32)
        .collect();
    let mut tracks = Tracks {
        times: packer.times(&times),
        channels: Vec::new(),
        samplers: Vec::new(),
    };
    let places: Vec<[f32; 3]> = frames
        .iter()
        .map(|p| y_up(p.position_m.to_array()))
        .collect();
    let turns: Vec<[f32; 4]> = frames.iter().map(|p| turned(p.rotation)).collect();
    tracks.add(
        ROOT,
        Property::Translation,
        packer.keys(&places),
        Interpolation::Linear,
    );
    tracks.add(
        ROOT,
        Property::Rotation,
        packer.turns(&turns),
        Interpolation::Linear,
    );
    if frames.iter().any(|p| !p.visible) {
        let sizes: Vec<[f32; 3]> = frames.iter().map(|p| [f32::from(p.visible); 3]).collect();
        tracks.add(
            ROOT,
            Property::Scale,
            packer.keys(&sizes),
            Interpolation::Step,
        );
    }
    for j in 0..N_JOINTS {
        let bends: Vec<[f32; 4]> = frames
            .iter()
            .map(|p| turned(about_y(p.joint_angles_rad[j])))
            .collect();
        let keys = packer.turns(&bends);
        tracks.add(
            first_joint + j as u32,
            Property::Rotation,
            keys,
            Interpolation::Linear,
        );
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
    times: Index<gltf_json::Accessor>,
    channels: Vec<Channel>,
    samplers: Vec<Sampler>,
}

impl Tracks {
    fn add(
        &mut self,
        node: u32,
        path: Property,
        output: Index<gltf_json::Accessor>,
        interpolation: Interpolation,
    ) {
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

/// Converts a point from camera coordinates to glTF coordinates.
fn y_up([x, y, z]: [f64; 3]) -> [f32; 3] {
    // Adding 0.0 turns -0 into 0.
    [x as f32 + 0.0, 0.0 - y as f32, 0.0 - z as f32]
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

fn joints(vertex: &Vertex) -> [u8; 4] {
    let [first, second] = vertex.joints.joints;
    let has_weight = vertex.joints.second_weight > 0.0;
    [first, if has_weight { second } else { 0 }, 0, 0]
}

fn weights(vertex: &Vertex) -> [f32; 4] {
    let second = vertex.joints.second_weight;
    [1.0 - second, second, 0.0, 0.0]
}

/// Converts encoded sRGB to the linear values of glTF's vertex colors; alpha is unchanged.
fn linear([r, g, b, a]: [f32; 4]) -> [u16; 4] {
    let whole = |v: f64| (v.clamp(0.0, 1.0) * 65535.0).round() as u16;
    let decode = |v: f32| {
        let v = f64::from(v);
        whole(if v <= 0.04045 {
            v / 12.92
        } else {
            libm::pow((v + 0.055) / 1.055, 2.4)
        })
    };
    [decode(r), decode(g), decode(b), whole(f64::from(a))]
}

#[cfg(test)]
mod tests;
