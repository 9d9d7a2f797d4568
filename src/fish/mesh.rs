//! Mesh of the virtual fish: our own geometry, skinned to the spine of 8 joints. It has an opaque body,
//! opaque eyes, translucent fins, and a color at every vertex
//! (docs/explanation/algorithms.md, "Virtual fish").
//!
//! The mesh is built in body lengths and then scaled: x by the length, y and z so that the silhouette, fins
//! included, has the requested height. The result is in metres, in the frame of `spine`.

use super::body;
use super::fins;
use super::paint::Coat;
use super::params::Palette;
use super::spine::{ORIGIN_S, SPINE_DOWN_BL, joints_at};
use crate::library::Animal;

/// Vertex of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Position when the body is straight, in metres.
    pub position_m: [f64; 3],
    /// Unit normal. Fins have one normal too, although they are visible from both sides.
    pub normal: [f64; 3],
    /// Straight-alpha RGBA in encoded sRGB, 0..=1.
    pub color: [f32; 4],
    /// The two joints that move the vertex.
    pub joints: [u8; 2],
    /// Weight of the second joint, 0..=1.
    pub share: f32,
    /// Shininess, 0..=1.
    pub shine: f32,
    /// Texture coordinates. On the body: row and column of scales. On a fin: ray, and position from base to
    /// edge.
    pub grain: [f32; 2],
    /// Strength of the texture: > 0 scales, < 0 fin rays, 0 none.
    pub grain_depth: f32,
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
}

impl Mesh {
    /// Returns a goldfish mesh of the given size and colors.
    pub fn goldfish(size: Animal, palette: Palette) -> Mesh {
        let coat = Coat::of(palette);
        let mut sketch = Sketch::default();
        body::add_trunk(&mut sketch, &coat);
        body::add_eyes(&mut sketch, &coat);
        fins::add_fins(&mut sketch, &coat);
        sketch.finish(size)
    }

    /// Returns the lowest and the highest coordinate of the opaque silhouette along one axis of the
    /// straight fish, in metres.
    pub fn extent_m(&self, axis: usize) -> [f64; 2] {
        extent(&self.vertices, axis)
    }
}

/// Mesh under construction, in body lengths: x is s (from the nose), y down, z left.
#[derive(Default)]
pub(super) struct Sketch {
    points: Vec<SketchPoint>,
    body: Vec<[u32; 3]>,
    fins: Vec<[u32; 3]>,
}

/// Point of a sketch.
#[derive(Clone, Copy)]
pub(super) struct SketchPoint {
    /// (s, down, left), in body lengths.
    pub(super) at: [f64; 3],
    pub(super) color: [f32; 4],
    pub(super) shine: f32,
    pub(super) grain: [f32; 2],
    pub(super) grain_depth: f32,
}

/// List of triangles to which a grid belongs.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Layer {
    Body,
    Fins,
}

impl Sketch {
    /// Adds a grid of `n` by `m` points, row by row. `point(i, j)` returns each point.
    pub(super) fn add_grid(
        &mut self,
        layer: Layer,
        n: usize,
        m: usize,
        point: impl Fn(usize, usize) -> SketchPoint,
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

    fn finish(self, size: Animal) -> Mesh {
        let mut vertices: Vec<Vertex> = self
            .points
            .iter()
            .map(|p| vertex(p, size.length_m))
            .collect();
        let [top, bottom] = extent(&vertices, 1);
        let scale = size.height_m / (bottom - top);
        for vertex in &mut vertices {
            vertex.position_m[1] *= scale;
            vertex.position_m[2] *= scale;
        }
        let (body, fins) = (
            drop_slivers(self.body, &vertices),
            drop_slivers(self.fins, &vertices),
        );
        set_normals(&mut vertices, &[&body, &fins]);
        Mesh {
            vertices,
            body,
            fins,
            size,
        }
    }
}

fn vertex(point: &SketchPoint, length_m: f64) -> Vertex {
    let [s, down, left] = point.at;
    let (a, b, share) = joints_at(s);
    Vertex {
        position_m: [
            (ORIGIN_S - s) * length_m,
            (down + SPINE_DOWN_BL) * length_m,
            left * length_m,
        ],
        normal: [0.0, -1.0, 0.0],
        color: point.color,
        joints: [a as u8, b as u8],
        share: share as f32,
        shine: point.shine,
        grain: point.grain,
        grain_depth: point.grain_depth,
    }
}

/// Returns the extent of the vertices whose alpha is at least one half.
fn extent(vertices: &[Vertex], axis: usize) -> [f64; 2] {
    vertices
        .iter()
        .filter(|v| v.color[3] >= 0.5)
        .fold([f64::MAX, f64::MIN], |[lo, hi], v| {
            [lo.min(v.position_m[axis]), hi.max(v.position_m[axis])]
        })
}

/// Removes triangles without area, which occur where a ring shrinks to a point.
fn drop_slivers(triangles: Vec<[u32; 3]>, vertices: &[Vertex]) -> Vec<[u32; 3]> {
    let length = |v: [f64; 3]| dot(v, v).sqrt();
    triangles
        .into_iter()
        .filter(|t| length(area_normal(t, vertices)) > 1e-14)
        .collect()
}

/// Sets each normal to the area-weighted mean over the triangles at its position. Vertices at the same
/// position, such as the seam of a ring or the tip of the nose, share one normal.
fn set_normals(vertices: &mut [Vertex], layers: &[&[[u32; 3]]]) {
    for triangles in layers {
        let mut sums = vec![[0.0; 3]; vertices.len()];
        for triangle in *triangles {
            let normal = area_normal(triangle, vertices);
            for &v in triangle {
                add(&mut sums[v as usize], normal);
            }
        }
        let mut at_place = std::collections::BTreeMap::<[u64; 3], [f64; 3]>::new();
        for &v in triangles.iter().flatten() {
            at_place
                .entry(vertices[v as usize].position_m.map(|c| (c + 0.0).to_bits()))
                .or_default();
        }
        for (vertex, sum) in vertices.iter().zip(&sums) {
            if let Some(total) = at_place.get_mut(&vertex.position_m.map(|c| (c + 0.0).to_bits())) {
                add(total, *sum);
            }
        }
        for &v in triangles.iter().flatten() {
            let vertex = &mut vertices[v as usize];
            let total = at_place[&vertex.position_m.map(|c| (c + 0.0).to_bits())];
            let length = dot(total, total).sqrt().max(1e-300);
            vertex.normal = total.map(|c| c / length);
        }
    }
}

fn area_normal(triangle: &[u32; 3], vertices: &[Vertex]) -> [f64; 3] {
    let [a, b, c] = triangle.map(|v| vertices[v as usize].position_m);
    let (u, v) = (sub(b, a), sub(c, a));
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn add(sum: &mut [f64; 3], v: [f64; 3]) {
    for (s, c) in sum.iter_mut().zip(v) {
        *s += c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fish() -> Mesh {
        let size = Animal {
            length_m: 0.1,
            height_m: 0.05,
        };
        Mesh::goldfish(size, Palette::Goldfish)
    }

    #[test]
    fn it_is_as_long_and_as_tall_as_asked_for() {
        let mesh = fish();
        let [tail, nose] = mesh.extent_m(0);
        let [top, bottom] = mesh.extent_m(1);
        assert!((bottom - top - 0.05).abs() < 1e-12);
        assert!((nose - tail - 0.1).abs() < 0.003, "{}", nose - tail);
    }

    #[test]
    fn the_body_is_turned_outside_out_and_even_on_both_sides() {
        let mesh = fish();
        let volume: f64 = mesh
            .body
            .iter()
            .map(|t| {
                dot(
                    area_normal(t, &mesh.vertices),
                    mesh.vertices[t[0] as usize].position_m,
                )
            })
            .sum::<f64>()
            / 6.0;
        assert!(volume > 0.0, "inside out: {volume}");
        let [right, left] = mesh.extent_m(2);
        assert!((left + right).abs() < 1e-9);
        for vertex in &mesh.vertices {
            assert!((dot(vertex.normal, vertex.normal) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_back_is_darker_than_the_belly() {
        let mesh = fish();
        let luma = |wanted: fn(f64) -> bool| {
            let of: Vec<f32> = mesh
                .vertices
                .iter()
                .filter(|v| v.grain_depth > 0.0 && wanted(v.normal[1]))
                .map(|v| v.color[0] + v.color[1] + v.color[2])
                .collect();
            of.iter().sum::<f32>() / of.len() as f32
        };
        assert!(luma(|down| down < -0.8) + 0.4 < luma(|down| down > 0.8));
    }
}
