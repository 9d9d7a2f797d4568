//! Lighting of the virtual fish: one key light from above and in front, and ambient light that is stronger
//! from above. Wet skin has a highlight. Scales and fin rays make a fine pattern.
//!
//! All colors are encoded sRGB, like the pictures over which the fish is drawn.

/// Properties of one surface sample before lighting.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Normal in the camera frame, of any length.
    pub(super) normal: [f32; 3],
    /// Straight-alpha RGBA, 0..=1.
    pub(super) color: [f32; 4],
    /// Shininess, 0..=1.
    pub(super) shine: f32,
    /// Texture coordinates (see `Vertex`).
    pub(super) grain: [f32; 2],
    /// Strength of the texture: > 0 scales, < 0 fin rays, 0 none.
    pub(super) grain_depth: f32,
}

/// Unit vector toward the key light in the camera frame: above, slightly left, in front. Free choice.
const KEY: [f32; 3] = [-0.34, -0.80, -0.495];
/// Unit vector halfway between the key light and the camera. Derived from `KEY`.
const HALF: [f32; 3] = [-0.197, -0.463, -0.864];

impl Surface {
    /// Returns the surface inside a triangle, interpolated from its corners.
    pub(super) fn between(corners: [&Surface; 3], weights: [f32; 3]) -> Surface {
        let mix = |of: fn(&Surface) -> f32| -> f32 {
            weights[0] * of(corners[0]) + weights[1] * of(corners[1]) + weights[2] * of(corners[2])
        };
        Surface {
            normal: [
                mix(|s| s.normal[0]),
                mix(|s| s.normal[1]),
                mix(|s| s.normal[2]),
            ],
            color: [
                mix(|s| s.color[0]),
                mix(|s| s.color[1]),
                mix(|s| s.color[2]),
                mix(|s| s.color[3]),
            ],
            shine: mix(|s| s.shine),
            grain: [mix(|s| s.grain[0]), mix(|s| s.grain[1])],
            grain_depth: mix(|s| s.grain_depth),
        }
    }
}

/// Returns the color of a sample after lighting, 0..=1 per channel.
pub(super) fn shade(surface: &Surface) -> [f32; 3] {
    let mut n = surface.normal;
    let length = dot(n, n).sqrt().max(1e-12);
    // A fin is visible from both sides, so its normal is turned toward the camera.
    let turn = if n[2] > 0.0 && surface.grain_depth < 0.0 {
        -1.0
    } else {
        1.0
    };
    n = n.map(|c| turn * c / length);
    let wrapped = ((dot(n, KEY) + 0.35) / 1.35).max(0.0);
    let sky = 0.5 - 0.5 * n[1];
    let light = match surface.grain_depth < 0.0 {
        // Light shines through a fin from either side.
        true => 0.72 + 0.30 * wrapped.max(0.55),
        false => 0.54 + 0.16 * sky + 0.40 * wrapped,
    };
    let grain = 1.0 + grain(surface);
    let glint = surface.shine * (0.50 * power32(dot(n, HALF)) + 0.10 * power4(dot(n, HALF)));
    // Near the outline, wet skin reflects the water around it.
    let facing = (-n[2]).clamp(0.0, 1.0);
    let rim = surface.shine * 0.22 * power4(1.0 - facing);
    let water = [0.55, 0.78, 0.84];
    std::array::from_fn(|c| {
        let lit = surface.color[c] * light * grain;
        (lit + glint * (0.55 + 0.45 * surface.color[c]) + rim * (water[c] - lit)).clamp(0.0, 1.0)
    })
}

/// Returns the relative brightness of the pattern. A scale is brighter in its middle, and every second row
/// is offset by half a scale. Fin rays are darker lines.
fn grain(surface: &Surface) -> f32 {
    let [u, v] = surface.grain;
    if surface.grain_depth > 0.0 {
        let row = u.floor();
        let offset = if row.rem_euclid(2.0) < 0.5 { 0.0 } else { 0.5 };
        let (x, y) = (u - row - 0.35, (v + offset).fract() - 0.5);
        let rim = (1.7 * (x * x + y * y)).min(1.0);
        return surface.grain_depth * (0.45 - rim);
    }
    let ray = (2.0 * (u - u.floor()) - 1.0).abs();
    surface.grain_depth * (ray * ray - 0.33)
}

fn power4(x: f32) -> f32 {
    let x2 = x.max(0.0) * x.max(0.0);
    x2 * x2
}

fn power32(x: f32) -> f32 {
    let x4 = power4(x);
    let x8 = x4 * x4;
    x8 * x8 * x8 * x8
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_directions_of_light_have_unit_length() {
        for direction in [KEY, HALF] {
            assert!(
                (dot(direction, direction) - 1.0).abs() < 2e-2,
                "{direction:?}"
            );
        }
    }

    #[test]
    fn what_faces_up_is_brighter_than_what_faces_down() {
        let facing = |normal| {
            shade(&Surface {
                normal,
                color: [0.5, 0.5, 0.5, 1.0],
                shine: 0.0,
                grain: [0.0; 2],
                grain_depth: 0.0,
            })[0]
        };
        assert!(facing([0.0, -1.0, 0.0]) > facing([0.0, 0.0, -1.0]));
        assert!(facing([0.0, 0.0, -1.0]) > facing([0.0, 1.0, 0.0]) + 0.1);
    }
}
