//! The virtual fish, or a school of them, as one GLB file: mesh, skins of 8 joints and animation
//! (docs/reference/formats.md, "Virtual fish"). The Khronos validator reports no errors.
//!
//! glTF is right-handed with y up. The point (x, y, z) in camera coordinates becomes (x, -y, -z), a rotation
//! by pi about the x axis. The filming camera is then at the origin and looks along -z, as glTF requires.

mod eye; // the filming camera
mod pack;
mod rig; // skeletons, skins and their animation
mod school; // flock -> school

use gltf_json::material::{AlphaMode, PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::texture::Info;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Index, Material, Mesh, Scene, Texture};

use self::eye::Eye;
use self::pack::Packer;
use self::rig::Swimmer;
pub use self::school::write_school;
use super::picture::write_rgba;
use crate::fish::Motion;
use crate::fish::mesh::{Mesh as FishMesh, Vertex};
use crate::raster::RgbaImage;

/// Returns the motion of a fish as the bytes of a GLB file.
pub fn write(motion: &Motion, fish: &FishMesh) -> Vec<u8> {
    write_scene(
        &Stage {
            name: "virtual fish",
            fps: motion.fps,
            swimmers: vec![Swimmer {
                id: None,
                size: 1.0,
                frames: &motion.frames,
            }],
            eye: Eye::of_camera(&motion.camera, motion.image_size_px),
        },
        fish,
    )
}

/// Animals that swim in one scene.
struct Stage<'a> {
    name: &'a str,
    fps: f64,
    swimmers: Vec<Swimmer<'a>>,
    /// The filming camera, if glTF can represent it.
    eye: Option<Eye>,
}

/// Returns a scene as a GLB file. All swimmers have the same mesh, and their motions are one animation: viewers play
/// one at a time.
fn write_scene(stage: &Stage, fish: &FishMesh) -> Vec<u8> {
    let mut packer = Packer::default();
    let mesh = add_mesh(&mut packer, fish);
    let nodes = rig::add(&mut packer, stage, mesh, fish.size.length_m);
    let eye = stage.eye.as_ref().map(|eye| eye.add(&mut packer));
    let scene = packer.root.push(Scene {
        extensions: None,
        extras: None,
        name: Some(stage.name.into()),
        nodes: nodes.into_iter().chain(eye).collect(),
    });
    packer.root.scene = Some(scene);
    packer.root.asset.generator = Some(concat!("flockreel ", env!("CARGO_PKG_VERSION")).into());
    packer.into_glb()
}

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
    let padded = padded(picture);
    let share = [
        picture.width as f32 / padded.width as f32,
        picture.height as f32 / padded.height as f32,
    ];
    let place = |v: &Vertex| [0, 1].map(|c| v.material.grain[c] * share[c]);
    let places: Vec<[f32; 2]> = vertices.map(place).collect();
    let png = write_rgba(padded.width, padded.height, &padded.pixels);
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

/// Returns the picture with sides that are powers of two, as some viewers need for repeated or reduced textures. Its last
/// column and row go on.
fn padded(picture: &RgbaImage) -> RgbaImage {
    let size = [picture.width, picture.height].map(u32::next_power_of_two);
    let mut padded = RgbaImage::new(size[0], size[1]);
    for (k, pixel) in padded.pixels.chunks_exact_mut(4).enumerate() {
        let (x, y) = (k as u32 % size[0], k as u32 / size[0]);
        let (x, y) = (x.min(picture.width - 1), y.min(picture.height - 1));
        let at = 4 * (y * picture.width + x) as usize;
        pixel.copy_from_slice(&picture.pixels[at..at + 4]);
    }
    padded
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

/// Converts a point from camera coordinates to glTF coordinates.
fn y_up([x, y, z]: [f64; 3]) -> [f32; 3] {
    // Adding 0.0 turns -0 into 0.
    [x as f32 + 0.0, 0.0 - y as f32, 0.0 - z as f32]
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
