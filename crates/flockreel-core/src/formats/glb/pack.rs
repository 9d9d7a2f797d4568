//! Packs numbers into the buffer of a GLB file and writes the file. Each accessor starts at a multiple of
//! four bytes.

use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Buffer, Target, View};
use gltf_json::image::MimeType;
use gltf_json::validation::{Checked::Valid, USize64};
use gltf_json::{Accessor, Image, Index, Root, Value};

/// A GLB file under construction.
#[derive(Default)]
pub(super) struct Packer {
    pub(super) root: Root,
    bytes: Vec<u8>,
}

/// The element type of an accessor.
struct Kind {
    component: ComponentType,
    shape: Type,
    normalized: bool,
    target: Option<Target>,
}

impl Kind {
    fn new(component: ComponentType, shape: Type, target: Option<Target>) -> Kind {
        Kind {
            component,
            shape,
            normalized: component == ComponentType::U16,
            target,
        }
    }
}

const VERTICES: Option<Target> = Some(Target::ArrayBuffer);

impl Packer {
    /// Adds vertex positions, with the bounds that glTF requires.
    pub(super) fn positions(&mut self, points: &[[f32; 3]]) -> Index<Accessor> {
        let accessor = self.vectors(points);
        self.bound(accessor, points)
    }

    /// Adds vertex normals.
    pub(super) fn vectors(&mut self, vectors: &[[f32; 3]]) -> Index<Accessor> {
        self.floats(vectors, Type::Vec3, VERTICES)
    }

    /// Adds vertex colors; 65535 is 1.
    pub(super) fn colors(&mut self, colors: &[[u16; 4]]) -> Index<Accessor> {
        let bytes = colors
            .iter()
            .flatten()
            .flat_map(|c| c.to_le_bytes())
            .collect();
        let kind = Kind::new(ComponentType::U16, Type::Vec4, VERTICES);
        self.add(bytes, colors.len(), kind)
    }

    /// Adds positions in a picture, 0..=1 across and down.
    pub(super) fn places(&mut self, places: &[[f32; 2]]) -> Index<Accessor> {
        self.floats(places, Type::Vec2, VERTICES)
    }

    /// Adds a PNG picture.
    pub(super) fn png(&mut self, png: Vec<u8>) -> Index<Image> {
        let view = self.add_view(png, None);
        self.root.push(Image {
            buffer_view: Some(view),
            mime_type: Some(MimeType("image/png".into())),
            name: Some("animal".into()),
            uri: None,
            extensions: None,
            extras: None,
        })
    }

    /// Adds the joints of each vertex.
    pub(super) fn joints(&mut self, joints: &[[u8; 4]]) -> Index<Accessor> {
        let kind = Kind::new(ComponentType::U8, Type::Vec4, VERTICES);
        self.add(joints.concat(), joints.len(), kind)
    }

    /// Adds the weights of those joints.
    pub(super) fn weights(&mut self, weights: &[[f32; 4]]) -> Index<Accessor> {
        self.floats(weights, Type::Vec4, VERTICES)
    }

    /// Adds triangles.
    pub(super) fn indices(&mut self, triangles: &[[u32; 3]]) -> Index<Accessor> {
        let bytes = triangles
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        let target = Some(Target::ElementArrayBuffer);
        let kind = Kind::new(ComponentType::U32, Type::Scalar, target);
        self.add(bytes, 3 * triangles.len(), kind)
    }

    /// Adds column-major matrices.
    pub(super) fn matrices(&mut self, matrices: &[[f32; 16]]) -> Index<Accessor> {
        self.floats(matrices, Type::Mat4, None)
    }

    /// Adds key times in increasing order, with the bounds that glTF requires.
    pub(super) fn times(&mut self, times_s: &[f32]) -> Index<Accessor> {
        let rows: Vec<[f32; 1]> = times_s.iter().map(|&t| [t]).collect();
        let accessor = self.floats(&rows, Type::Scalar, None);
        self.bound(accessor, &rows)
    }

    /// Adds keys of translation or scale.
    pub(super) fn keys(&mut self, values: &[[f32; 3]]) -> Index<Accessor> {
        self.floats(values, Type::Vec3, None)
    }

    /// Adds keys of rotation.
    pub(super) fn turns(&mut self, values: &[[f32; 4]]) -> Index<Accessor> {
        self.floats(values, Type::Vec4, None)
    }

    /// Returns the whole file: header, JSON padded with spaces, buffer padded with zeros.
    pub(super) fn into_glb(mut self) -> Vec<u8> {
        self.root.buffers.push(Buffer {
            byte_length: USize64::from(self.bytes.len()),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut json = self.root.to_vec().expect("plain values serialise");
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.bytes.len();
        let mut file = Vec::with_capacity(total);
        file.extend(b"glTF");
        file.extend(2u32.to_le_bytes());
        file.extend((total as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bytes)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }

    fn floats<const N: usize>(
        &mut self,
        rows: &[[f32; N]],
        shape: Type,
        target: Option<Target>,
    ) -> Index<Accessor> {
        let bytes = rows
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect();
        self.add(
            bytes,
            rows.len(),
            Kind::new(ComponentType::F32, shape, target),
        )
    }

    fn add_view(&mut self, mut bytes: Vec<u8>, target: Option<Target>) -> Index<View> {
        let view = self.root.push(View {
            buffer: Index::new(0),
            byte_length: USize64::from(bytes.len()),
            byte_offset: Some(USize64::from(self.bytes.len())),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        });
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        self.bytes.append(&mut bytes);
        view
    }

    fn add(&mut self, bytes: Vec<u8>, count: usize, kind: Kind) -> Index<Accessor> {
        let view = self.add_view(bytes, kind.target);
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(kind.component)),
            extensions: None,
            extras: None,
            type_: Valid(kind.shape),
            min: None,
            max: None,
            name: None,
            normalized: kind.normalized,
            sparse: None,
        })
    }

    fn bound<const N: usize>(
        &mut self,
        index: Index<Accessor>,
        rows: &[[f32; N]],
    ) -> Index<Accessor> {
        let fold = |start: f32, pick: fn(f32, f32) -> f32| -> Value {
            let bounds = (0..N).map(|c| rows.iter().map(|r| r[c]).fold(start, pick));
            Value::from(bounds.collect::<Vec<f32>>())
        };
        let accessor = &mut self.root.accessors[index.value()];
        accessor.min = Some(fold(f32::MAX, f32::min));
        accessor.max = Some(fold(f32::MIN, f32::max));
        index
    }
}
