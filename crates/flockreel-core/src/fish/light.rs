//! Lighting of the virtual fish: one key light from above and in front, and ambient light that is stronger
//! from above. Wet skin has a highlight. Scales and fin rays make a fine pattern.
//!
//! All colors are encoded sRGB, like the pictures over which the fish is drawn.

use glam::Vec3;

use super::mesh::Material;

/// One sample of the surface before lighting.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Normal in the camera frame, of any length.
    pub(super) normal: Vec3,
    pub(super) material: Material,
}

/// Unit vector toward the key light in the camera frame: above, slightly left, in front. Free choice.
const KEY: Vec3 = Vec3::new(-0.34, -0.80, -0.495);
/// Unit vector halfway between the key light and the camera. Derived from `KEY`.
const HALF: Vec3 = Vec3::new(-0.197, -0.463, -0.864);

impl Surface {
    /// Returns the surface inside a triangle, interpolated from its corners.
    pub(super) fn interpolate(corners: [&Surface; 3], weights: [f32; 3]) -> Surface {
        let materials = corners.map(|corner| &corner.material);
        let [shine, grain_depth] = mix(materials.map(|m| [m.shine, m.grain_depth]), weights);
        Surface {
            normal: mix(corners.map(|c| c.normal.to_array()), weights).into(),
            material: Material {
                color: mix(materials.map(|m| m.color), weights),
                shine,
                grain: mix(materials.map(|m| m.grain), weights),
                grain_depth,
            },
        }
    }
}

/// Returns the weighted sum of three vectors.
fn mix<const N: usize>(values: [[f32; N]; 3], weights: [f32; 3]) -> [f32; N] {
    let [a, b, c] = values;
    std::array::from_fn(|k| weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k])
}

/// Returns the color of a sample after lighting, 0..=1 per channel.
pub(super) fn shade(surface: &Surface) -> [f32; 3] {
    let Surface { normal, material } = surface;
    let length = normal.length().max(1e-12);
    let is_fin = material.grain_depth < 0.0;
    // A fin is visible from both sides, so its normal is turned toward the camera.
    let turn = if normal.z > 0.0 && is_fin { -1.0 } else { 1.0 };
    let n = turn * *normal / length;
    let wrapped = ((n.dot(KEY) + 0.35) / 1.35).max(0.0);
    let sky = 0.5 - 0.5 * n.y;
    let light = if is_fin {
        // Light shines through a fin from either side.
        0.72 + 0.30 * wrapped.max(0.55)
    } else {
        0.54 + 0.16 * sky + 0.40 * wrapped
    };
    let grain = 1.0 + grain(material);
    let toward_half = n.dot(HALF);
    let glint = material.shine * (0.50 * power32(toward_half) + 0.10 * power4(toward_half));
    // Near the outline, wet skin reflects the water around it.
    let facing = (-n.z).clamp(0.0, 1.0);
    let rim = material.shine * 0.22 * power4(1.0 - facing);
    let water = [0.55, 0.78, 0.84];
    std::array::from_fn(|c| {
        let lit = material.color[c] * light * grain;
        (lit + glint * (0.55 + 0.45 * material.color[c]) + rim * (water[c] - lit)).clamp(0.0, 1.0)
    })
}

/// Returns the relative brightness of the pattern. A scale is brighter in its middle, and every second row
/// is offset by half a scale. Fin rays are darker lines.
fn grain(material: &Material) -> f32 {
    let [u, v] = material.grain;
    if material.grain_depth > 0.0 {
        let row = u.floor();
        let offset = if row.rem_euclid(2.0) < 0.5 { 0.0 } else { 0.5 };
        let (x, y) = (u - row - 0.35, (v + offset).fract() - 0.5);
        let rim = (1.7 * (x * x + y * y)).min(1.0);
        return material.grain_depth * (0.45 - rim);
    }
    let ray = (2.0 * (u - u.floor()) - 1.0).abs();
    material.grain_depth * (ray * ray - 0.33)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_directions_have_unit_length() {
        for direction in [KEY, HALF] {
            assert!(
                (direction.length_squared() - 1.0).abs() < 2e-2,
                "{direction}"
            );
        }
    }

    #[test]
    fn surfaces_facing_up_are_brighter_than_surfaces_facing_down() {
        let material = Material {
            color: [0.5, 0.5, 0.5, 1.0],
            shine: 0.0,
            grain: [0.0; 2],
            grain_depth: 0.0,
        };
        let facing = |normal| shade(&Surface { normal, material })[0];
        assert!(facing(Vec3::NEG_Y) > facing(Vec3::NEG_Z));
        assert!(facing(Vec3::NEG_Z) > facing(Vec3::Y) + 0.1);
    }
}
