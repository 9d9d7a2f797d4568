//! Mesh of the virtual fish, skinned to the spine of 8 joints. It has an opaque body, opaque eyes, translucent
//! fins, and a material at every vertex (docs/explanation/algorithms.md, "Virtual fish").
//!
//! The mesh is built in body lengths and then scaled: x by the length, y and z so that the silhouette, fins
//! included, has the requested height. The result is in metres, in the frame of `spine`.

use std::collections::BTreeMap;

use glam::DVec3;

use super::spine::{JointWeights, ORIGIN_S, SPINE_DOWN_BL};
use crate::library::Animal;
use crate::raster::RgbaImage;

/// Look of a point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Straight-alpha RGBA in encoded sRGB, 0..=1.
    pub color: [f32; 4],
    /// Shininess, 0..=1.
    pub shine: f32,
    /// Texture coordinates. With a picture: position in it, 0..=1 across and down. Without one, on the body: row
    /// and column of scales; on a fin: ray, and position from base to edge.
    pub grain: [f32; 2],
    /// Strength of the texture: > 0 scales, < 0 fin rays, 0 none.
    pub grain_depth: f32,
}

/// Vertex of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position when the body is straight, in metres.
    pub position_m: DVec3,
    /// Unit normal. Fins have one normal too, although they are visible from both sides.
    pub normal: DVec3,
    /// Look of the surface.
    pub material: Material,
    /// The joints that move the vertex.
    pub joints: JointWeights,
}

/// Vertices and triangles of a fish.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<Vertex>,
    /// Triangles of body and eyes, counter-clockwise as seen from outside.
    pub body: Vec<[u32; 3]>,
    /// Triangles of the fins. The renderer draws them after the body, from far to near.
    pub fins: Vec<[u32; 3]>,
    /// Size of the fish.
    pub size: Animal,
    /// Picture on the surface; `None` if the vertices have their colors.
    pub picture: Option<RgbaImage>,
}

impl Mesh {
    /// Returns the lowest and the highest coordinate of the opaque silhouette along one axis of the
    /// straight fish, in metres.
    pub fn extent_m(&self, axis: usize) -> [f64; 2] {
        extent(&self.vertices, axis)
    }
}

/// Mesh under construction, in body lengths: x is s (from the nose), y down, z left.
#[derive(Default)]
pub(super) struct MeshBuilder {
    points: Vec<SurfacePoint>,
    body: Vec<[u32; 3]>,
    fins: Vec<[u32; 3]>,
}

/// Point of a mesh under construction.
#[derive(Clone, Copy)]
pub(super) struct SurfacePoint {
    /// (s, down, left), in body lengths.
    pub(super) at: [f64; 3],
    pub(super) material: Material,
}

/// List of triangles to which a grid belongs.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Layer {
    Body,
    Fins,
}

impl MeshBuilder {
    /// Adds a grid of `n` by `m` points, row by row. `point(i, j)` returns each point.
    pub(super) fn add_grid(
        &mut self,
        layer: Layer,
        n: usize,
        m: usize,
        point: impl Fn(usize, usize) -> SurfacePoint,
    ) {
        let first = self.points.len() as u32;
        for i in 0..n {
            self.points.extend((0..m).map(|j| point(i, j)));
        }
        let triangles = match layer {
            Layer::Body => &mut self.body,
            Layer::Fins => &mut self.fins,
        };
        let at = |i: usize, j: usize| first + (i * m + j) as u32;
        for i in 0..n - 1 {
            for j in 0..m - 1 {
                let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
                triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
    }

    /// Returns the mesh, scaled to `size`.
    pub(super) fn finish(self, size: Animal) -> Mesh {
        let (mut lo, mut hi) = (f64::MAX, f64::MIN);
        for point in &self.points {
            if point.material.color[3] >= 0.5 {
                (lo, hi) = (lo.min(point.at[1]), hi.max(point.at[1]));
            }
        }
        self.scaled(size.length_m, size.height_m / ((hi - lo) * size.length_m))
    }

    /// Returns the mesh of a fish of `length_m`, made `stretch` times as high and as wide as it is built.
    pub(super) fn scaled(self, length_m: f64, stretch: f64) -> Mesh {
        let points = self.points.iter();
        let mut vertices: Vec<Vertex> = points.map(|p| vertex(p, length_m)).collect();
        for vertex in &mut vertices {
            vertex.position_m *= DVec3::new(1.0, stretch, stretch);
        }
        let [top, bottom] = extent(&vertices, 1);
        let size = Animal {
            length_m,
            height_m: bottom - top,
        };
        let body = without_slivers(self.body, &vertices);
        let fins = without_slivers(self.fins, &vertices);
        set_normals(&mut vertices, &body);
        set_normals(&mut vertices, &fins);
        Mesh {
            vertices,
            body,
            fins,
            size,
            picture: None,
        }
    }
}

fn vertex(point: &SurfacePoint, length_m: f64) -> Vertex {
    let [s, down, left] = point.at;
    Vertex {
        position_m: DVec3::new(ORIGIN_S - s, down + SPINE_DOWN_BL, left) * length_m,
        normal: DVec3::NEG_Y,
        material: point.material,
        joints: JointWeights::at(s),
    }
}

/// Returns the extent of the vertices whose alpha is at least one half.
fn extent(vertices: &[Vertex], axis: usize) -> [f64; 2] {
    let opaque = vertices.iter().filter(|v| v.material.color[3] >= 0.5);
    opaque.fold([f64::MAX, f64::MIN], |[lo, hi], v| {
        [lo.min(v.position_m[axis]), hi.max(v.position_m[axis])]
    })
}

/// Removes triangles without area, which occur where a ring shrinks to a point.
fn without_slivers(mut triangles: Vec<[u32; 3]>, vertices: &[Vertex]) -> Vec<[u32; 3]> {
    triangles.retain(|t| area_normal(t, vertices).length() > 1e-14);
    triangles
}

/// Sets each normal to the area-weighted mean over the triangles at its position. Vertices at the same
/// position, such as the seam of a ring or the tip of the nose, share one normal.
fn set_normals(vertices: &mut [Vertex], triangles: &[[u32; 3]]) {
    let mut sums = vec![DVec3::ZERO; vertices.len()];
    for triangle in triangles {
        let normal = area_normal(triangle, vertices);
        for &v in triangle {
            sums[v as usize] += normal;
        }
    }
    let key = |v: &Vertex| v.position_m.to_array().map(|c| (c + 0.0).to_bits());
    let mut sum_at = BTreeMap::<[u64; 3], DVec3>::new();
    for &v in triangles.iter().flatten() {
        sum_at.entry(key(&vertices[v as usize])).or_default();
    }
    for (vertex, sum) in vertices.iter().zip(&sums) {
        if let Some(total) = sum_at.get_mut(&key(vertex)) {
            *total += *sum;
        }
    }
    for &v in triangles.iter().flatten() {
        let vertex = &mut vertices[v as usize];
        let total = sum_at[&key(vertex)];
        vertex.normal = total / total.length().max(1e-300);
    }
}

/// Returns the normal of a triangle, with twice its area as length.
fn area_normal(triangle: &[u32; 3], vertices: &[Vertex]) -> DVec3 {
    let [a, b, c] = triangle.map(|v| vertices[v as usize].position_m);
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fish::params::Palette;

    fn fish() -> Mesh {
        let size = Animal {
            length_m: 0.1,
            height_m: 0.05,
        };
        Mesh::goldfish(size, Palette::Goldfish)
    }

    #[test]
    fn mesh_has_the_requested_length_and_height() {
        let mesh = fish();
        let [tail, nose] = mesh.extent_m(0);
        let [top, bottom] = mesh.extent_m(1);
        assert!((bottom - top - 0.05).abs() < 1e-12);
        assert!((nose - tail - 0.1).abs() < 0.003, "{}", nose - tail);
    }

    #[test]
    fn body_triangles_face_outward_and_both_sides_are_equal() {
        let mesh = fish();
        let volume_of = |t: &[u32; 3]| {
            let corner = mesh.vertices[t[0] as usize].position_m;
            area_normal(t, &mesh.vertices).dot(corner) / 6.0
        };
        let volume: f64 = mesh.body.iter().map(volume_of).sum();
        assert!(volume > 0.0, "inside out: {volume}");
        let [right, left] = mesh.extent_m(2);
        assert!((left + right).abs() < 1e-9);
        for vertex in &mesh.vertices {
            assert!((vertex.normal.length_squared() - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn back_is_darker_than_belly() {
        let mesh = fish();
        let luma = |wanted: fn(f64) -> bool| {
            let is_wanted = |v: &&Vertex| v.material.grain_depth > 0.0 && wanted(v.normal.y);
            let sums = mesh.vertices.iter().filter(is_wanted);
            let sums: Vec<f32> = sums.map(|v| v.material.color[..3].iter().sum()).collect();
            sums.iter().sum::<f32>() / sums.len() as f32
        };
        assert!(luma(|down| down < -0.8) + 0.4 < luma(|down| down > 0.8));
    }
}
