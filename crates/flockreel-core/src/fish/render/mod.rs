//! Renderer of the virtual fish, for one posture at a time.
//!
//! It skins the mesh, projects it with the camera, shades every sample by its own normal, and averages 3 x
//! 3 samples per pixel for soft edges. The body is drawn first, with a depth buffer. The translucent fins
//! follow, from far to near (docs/explanation/algorithms.md, "Virtual fish").

use super::light::{Surface, shade};
use super::mesh::{Mesh, Vertex};
use super::motion::Posture;
use super::spine::{joint_at_rest_m, joint_frames};
use crate::geometry::{Camera, Rect};
use crate::raster::{RgbImage, RgbaImage};

/// Number of samples along each side of a pixel. Free choice.
const SAMPLES: usize = 3;
/// Least distance from the camera, in metres. A fish with a nearer vertex is not drawn. Free choice.
const NEAREST_M: f64 = 0.02;

/// Renderer of one fish.
pub struct Renderer {
    mesh: Mesh,
}

/// Drawn fish: the pixels of its bounding box.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Bounding box in the image; empty if the fish is out of sight.
    pub rect: Rect,
    /// Premultiplied RGBA of the box, 0..=1, by rows.
    pub pixels: Vec<[f32; 4]>,
}

impl Renderer {
    /// Returns a renderer of a mesh.
    pub fn new(mesh: Mesh) -> Renderer {
        Renderer { mesh }
    }

    /// Returns the mesh of the fish.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Draws one posture as the camera sees it. An invisible posture gives an empty box.
    pub fn draw(&self, camera: &Camera, image_size_px: [u32; 2], posture: &Posture) -> Drawing {
        let points = if posture.visible {
            self.project(camera, posture)
        } else {
            Vec::new()
        };
        let rect = bounds(&points, image_size_px);
        let mut samples = Samples::new(rect, self.mesh.picture.as_ref());
        if !rect.is_empty() {
            for triangle in &self.mesh.body {
                samples.fill(&points, triangle, Samples::write_opaque);
            }
            for triangle in far_to_near(&self.mesh.fins, &points) {
                samples.fill(&points, &triangle, Samples::blend_over);
            }
        }
        samples.average()
    }

    /// Returns every vertex, moved by the posture: image position in samples, depth, and surface in the
    /// camera frame.
    fn project(&self, camera: &Camera, posture: &Posture) -> Vec<Point> {
        let length_m = self.mesh.size.length_m;
        let joints = joint_frames(length_m, &posture.joint_angles_rad);
        let place = |vertex: &Vertex| {
            let moved = vertex.joints.joints.map(|joint| {
                let j = usize::from(joint);
                let (pivot, turn) = joints[j];
                let from_joint = vertex.position_m - joint_at_rest_m(length_m, j);
                [pivot + turn * from_joint, turn * vertex.normal]
            });
            let share = f64::from(vertex.joints.second_weight);
            let [at, normal] = [0, 1].map(|k| moved[0][k].lerp(moved[1][k], share));
            let at = posture.position_m + posture.rotation * at;
            let normal = posture.rotation * normal.normalize();
            let [x, y] = camera.image_from_camera([at.x, at.y, at.z.max(NEAREST_M)]);
            Point {
                x: (x * SAMPLES as f64) as f32,
                y: (y * SAMPLES as f64) as f32,
                z: at.z as f32,
                surface: Surface {
                    normal: normal.as_vec3(),
                    material: vertex.material,
                },
            }
        };
        self.mesh.vertices.iter().map(place).collect()
    }
}

impl Drawing {
    /// Returns the alpha of pixel (x, y) of the box, 0..=1. Panics outside the box.
    pub fn alpha(&self, x: u32, y: u32) -> f32 {
        self.pixels[(y * self.rect.w + x) as usize][3]
    }

    /// Draws the fish over an image of the size for which it was drawn. Panics if the image is smaller.
    pub fn over(&self, image: &mut RgbImage) {
        for y in 0..self.rect.h {
            for x in 0..self.rect.w {
                let [r, g, b, a] = self.pixels[(y * self.rect.w + x) as usize];
                let (px, py) = (self.rect.x + x, self.rect.y + y);
                let under = image.pixel(px, py);
                let mut rgb = [r, g, b];
                for (over, below) in rgb.iter_mut().zip(under) {
                    *over = *over * 255.0 + (1.0 - a) * f32::from(below);
                }
                image.set_pixel(px, py, rgb.map(byte));
            }
        }
    }
}

/// Vertex projected into the image.
struct Point {
    x: f32,
    y: f32,
    z: f32,
    surface: Surface,
}

/// Returns the box around the points, clipped to the image. Empty if a point is not beyond `NEAREST_M`.
fn bounds(points: &[Point], [width, height]: [u32; 2]) -> Rect {
    let mut lo = [f32::MAX; 2];
    let mut hi = [f32::MIN; 2];
    for point in points {
        if f64::from(point.z) <= NEAREST_M {
            return Rect::default();
        }
        lo = [lo[0].min(point.x), lo[1].min(point.y)];
        hi = [hi[0].max(point.x), hi[1].max(point.y)];
    }
    if points.is_empty() {
        return Rect::default();
    }
    let pixel = |v: f32| (v / SAMPLES as f32).floor() as i64;
    let [left, top] = lo.map(|v| pixel(v) - 1);
    let [right, bottom] = hi.map(|v| pixel(v) + 2);
    Rect::clipped(left, top, right, bottom, width, height)
}

/// Returns the triangles from far to near. Ties keep their order.
fn far_to_near(triangles: &[[u32; 3]], points: &[Point]) -> Vec<[u32; 3]> {
    let depth = |t: &[u32; 3]| t.iter().map(|&v| points[v as usize].z).sum::<f32>();
    let mut sorted: Vec<(f32, [u32; 3])> = triangles.iter().map(|t| (depth(t), *t)).collect();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    sorted.into_iter().map(|(_, t)| t).collect()
}

/// Samples of a box, 3 x 3 per pixel.
struct Samples<'a> {
    picture: Option<&'a RgbaImage>,
    rect: Rect,
    width: usize,
    height: usize,
    color: Vec<[f32; 4]>,
    depth: Vec<f32>,
}

impl<'a> Samples<'a> {
    fn new(rect: Rect, picture: Option<&'a RgbaImage>) -> Samples<'a> {
        let (width, height) = (rect.w as usize * SAMPLES, rect.h as usize * SAMPLES);
        Samples {
            picture,
            rect,
            width,
            height,
            color: vec![[0.0; 4]; width * height],
            depth: vec![f32::MAX; width * height],
        }
    }

    /// Calls `write` for every sample whose middle lies in the triangle and in front of the depth buffer.
    fn fill(
        &mut self,
        points: &[Point],
        triangle: &[u32; 3],
        write: fn(&mut Samples<'a>, usize, f32, Surface),
    ) {
        let [a, b, c] = triangle.map(|v| &points[v as usize]);
        let origin = [self.rect.x, self.rect.y].map(|px| (px as usize * SAMPLES) as f32);
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area == 0.0 {
            return;
        }
        let span = |lo: f32, hi: f32, origin: f32, limit: usize| {
            let first = (lo - origin - 0.5).ceil().max(0.0) as usize;
            let end = ((hi - origin - 0.5).floor() + 1.0).clamp(0.0, limit as f32) as usize;
            first..end
        };
        let (x_lo, x_hi) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        let (y_lo, y_hi) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        for row in span(y_lo, y_hi, origin[1], self.height) {
            let y = origin[1] + row as f32 + 0.5;
            for column in span(x_lo, x_hi, origin[0], self.width) {
                let x = origin[0] + column as f32 + 0.5;
                let u = ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x)) / area;
                let v = ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x)) / area;
                let w = 1.0 - u - v;
                if u < 0.0 || v < 0.0 || w < 0.0 {
                    continue;
                }
                let at = row * self.width + column;
                let z = u * a.z + v * b.z + w * c.z;
                if z < self.depth[at] {
                    let corners = [&a.surface, &b.surface, &c.surface];
                    write(self, at, z, Surface::interpolate(corners, [u, v, w]));
                }
            }
        }
    }

    /// Writes an opaque sample, which hides everything behind it.
    fn write_opaque(&mut self, at: usize, z: f32, surface: Surface) {
        let [r, g, b, _] = self.paint(&surface);
        self.depth[at] = z;
        self.color[at] = [r, g, b, 1.0];
    }

    /// Blends a translucent sample over the present color.
    fn blend_over(&mut self, at: usize, _z: f32, surface: Surface) {
        let [r, g, b, alpha] = self.paint(&surface);
        let under = self.color[at];
        let over = [r * alpha, g * alpha, b * alpha, alpha];
        self.color[at] = std::array::from_fn(|k| over[k] + (1.0 - alpha) * under[k]);
    }

    /// Returns color and alpha of a sample. A picture shows the light in which the animal was filmed.
    fn paint(&self, surface: &Surface) -> [f32; 4] {
        let Some(picture) = self.picture else {
            let [r, g, b] = shade(surface);
            return [r, g, b, surface.material.color[3]];
        };
        let [u, v] = surface.material.grain;
        let [w, h] = picture.size();
        let (x, y) = (u * w as f32 - 0.5, v * h as f32 - 0.5);
        let pixel = |dx: f32, dy: f32| {
            let within = |v: f32, side: u32| v.clamp(0.0, side as f32 - 1.0) as u32;
            let texel = picture.pixel(within(x.floor() + dx, w), within(y.floor() + dy, h));
            texel.map(|c| f32::from(c) / 255.0)
        };
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let [a, b, c, d] = [
            pixel(0.0, 0.0),
            pixel(1.0, 0.0),
            pixel(0.0, 1.0),
            pixel(1.0, 1.0),
        ];
        std::array::from_fn(|k| {
            let (upper, lower) = (a[k] + fx * (b[k] - a[k]), c[k] + fx * (d[k] - c[k]));
            upper + fy * (lower - upper)
        })
    }

    /// Returns the mean over the samples of each pixel.
    fn average(self) -> Drawing {
        let mut pixels = vec![[0.0f32; 4]; self.rect.area() as usize];
        for (row, samples) in self.color.chunks_exact(self.width.max(1)).enumerate() {
            let start = row / SAMPLES * self.rect.w as usize;
            let groups = samples.chunks_exact(SAMPLES);
            for (pixel, group) in pixels[start..].iter_mut().zip(groups) {
                for (k, sum) in pixel.iter_mut().enumerate() {
                    *sum += group.iter().map(|sample| sample[k]).sum::<f32>();
                }
            }
        }
        let share = 1.0 / (SAMPLES * SAMPLES) as f32;
        for pixel in &mut pixels {
            *pixel = pixel.map(|sum| sum * share);
        }
        Drawing {
            rect: self.rect,
            pixels,
        }
    }
}

fn byte(value: f32) -> u8 {
    (value + 0.5).clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests;
