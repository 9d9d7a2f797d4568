//! Background of the sample film: a tank with shafts of light, a gravel floor, stones and plants.
//!
//! The scene is painted with seeded random numbers and is the same on every machine.

use crate::random;
use crate::raster::RgbImage;

/// Height at which the floor meets the back wall, as a share of the image height from the top. Free choice.
const HORIZON: f64 = 0.765;
/// Color of the water at the top and at the bottom, 0..=255. Free choice.
const WATER: [[f64; 3]; 2] = [[126.0, 184.0, 188.0], [34.0, 84.0, 98.0]];

/// Returns the scene without the fish.
pub(super) fn tank_scene(width: u32, height: u32, seed: u64) -> RgbImage {
    let mut scene = Painting::new(width, height, seed);
    scene.plants(&PlantBed {
        key: 1,
        n: 16,
        span: [0.04, 0.96],
        foot: 0.772,
        tall: [0.16, 0.36],
        wide: 0.0042,
        haze: 0.62,
    });
    scene.gravel();
    scene.plants(&PlantBed {
        key: 2,
        n: 9,
        span: [0.01, 0.15],
        foot: 0.80,
        tall: [0.22, 0.56],
        wide: 0.0062,
        haze: 0.34,
    });
    scene.plants(&PlantBed {
        key: 3,
        n: 11,
        span: [0.82, 0.99],
        foot: 0.81,
        tall: [0.18, 0.62],
        wide: 0.0066,
        haze: 0.30,
    });
    scene.rocks();
    scene.plants(&PlantBed {
        key: 4,
        n: 7,
        span: [0.63, 0.74],
        foot: 0.80,
        tall: [0.06, 0.17],
        wide: 0.0048,
        haze: 0.36,
    });
    scene.into_image()
}

/// Returns the floor of gravel under the camera, without the fish.
pub(super) fn gravel_scene(width: u32, height: u32, seed: u64) -> RgbImage {
    let mut scene = Painting::new(width, height, seed);
    scene.floor();
    scene.into_image()
}

struct Painting {
    width: usize,
    height: usize,
    seed: u64,
    pixels: Vec<[f64; 3]>,
}

/// Row of plants. Horizontal lengths are shares of the image width, vertical lengths of the image height.
struct PlantBed {
    key: u64,
    n: u64,
    span: [f64; 2],
    foot: f64,
    tall: [f64; 2],
    wide: f64,
    haze: f64,
}

/// Ellipse lit from the upper left, in pixels.
struct Pebble {
    at: [f64; 2],
    radii: [f64; 2],
    color: [f64; 3],
}

impl Painting {
    fn new(width: u32, height: u32, seed: u64) -> Painting {
        let (w, h) = (width as usize, height as usize);
        let mut pixels = Vec::with_capacity(w * h);
        for y in 0..h {
            for x in 0..w {
                pixels.push(water([x as f64 / w as f64, y as f64 / h as f64], seed));
            }
        }
        Painting {
            width: w,
            height: h,
            seed,
            pixels,
        }
    }

    /// Returns random number `k` of a plant or stone, in [0, 1).
    fn random(&self, key: u64, item: u64, k: u64) -> f64 {
        random::uniform(self.seed, &[0x73_6365_6e65, key, item, k])
    }

    /// Draws a row of plants. Their leaves are ribbons that sway individually and narrow toward the tip.
    fn plants(&mut self, bed: &PlantBed) {
        for plant in 0..bed.n {
            let at = |k: u64| self.random(bed.key, plant, k);
            let root = bed.span[0] + (bed.span[1] - bed.span[0]) * at(0);
            let n_leaves = 3 + (4.0 * at(1)) as u64;
            let (red, green, blue) = (60.0 * at(2), 52.0 * at(3), 22.0 * at(4));
            let color = [38.0 + red, 112.0 + green, 40.0 + blue];
            let tall = bed.tall[0] + (bed.tall[1] - bed.tall[0]) * at(5);
            for leaf in 0..n_leaves {
                let id = bed.key * 100 + plant;
                let of = |k: u64| self.random(id, leaf, 10 + k);
                let spread = 2.0 * of(0) - 1.0;
                let light = 0.72 + 0.5 * of(1);
                let blade = Blade {
                    root: [root + 0.006 * spread, bed.foot + 0.012 * of(2)],
                    tall: tall * (0.6 + 0.4 * of(3)),
                    lean: 0.055 * spread,
                    sway: 0.012 * (2.0 * of(4) - 1.0),
                    wave_rad: 3.0 + 3.0 * of(5),
                    phase_rad: 6.3 * of(6),
                    wide: bed.wide * (0.7 + 0.6 * of(7)),
                };
                self.blade(&blade, color.map(|c| c * light), bed.haze);
            }
        }
    }

    fn blade(&mut self, blade: &Blade, color: [f64; 3], haze: f64) {
        let (w, h) = (self.width as f64, self.height as f64);
        let n = (blade.tall * h * 1.5) as usize + 2;
        for k in 0..n {
            let t = k as f64 / (n - 1) as f64;
            let wave = libm::sin(blade.wave_rad * t + blade.phase_rad);
            let sway = blade.sway * t * wave + blade.lean * t * t;
            let [x, y] = [blade.root[0] + sway, blade.root[1] - blade.tall * t];
            let at = [x * w, y * h];
            let radius = blade.wide * w * (1.0 - 0.85 * t * t) * (0.5 + 0.5 * (6.0 * t).min(1.0));
            // The foot is dark and the tip bright. The left edge is brighter than the rest.
            let glow = 0.62 + 0.55 * t;
            let far = water([at[0] / w, at[1] / h], self.seed);
            let tint = |gain: f64| -> [f64; 3] {
                std::array::from_fn(|c| color[c] * glow * gain * (1.0 - haze) + far[c] * haze)
            };
            self.disc(at, radius, tint(0.86));
            self.disc([at[0] - 0.3 * radius, at[1]], 0.55 * radius, tint(1.12));
        }
    }

    /// Draws the floor: sand with pebbles, small and dim at the back, larger and brighter in front.
    fn gravel(&mut self) {
        let (w, h) = (self.width as f64, self.height as f64);
        for y in (HORIZON * h) as usize..self.height {
            for x in 0..self.width {
                let bumps = 0.004 * libm::sin(0.021 * x as f64 * 640.0 / w);
                let near = ((y as f64 / h - HORIZON + bumps) / (1.0 - HORIZON)).clamp(0.0, 1.0);
                let sand = [120.0 + 40.0 * near, 112.0 + 28.0 * near, 92.0 + 14.0 * near];
                let edge = (near * 14.0).min(1.0);
                let under = &mut self.pixels[y * self.width + x];
                *under = std::array::from_fn(|c| under[c] + edge * (sand[c] * 0.8 - under[c]));
            }
        }
        const N: u64 = 5200;
        for k in 0..N {
            let depth = k as f64 / N as f64;
            let near = depth * depth * (0.35 + 0.65 * depth);
            let of = |i: u64| self.random(50, k, i);
            let y = HORIZON + 0.012 + (1.03 - HORIZON) * near + 0.012 * (of(0) - 0.5);
            let size = w * (0.0018 + 0.0068 * near) * (0.55 + 0.75 * of(1));
            let pebble = self.grain(k, y * h, size, 0.70 + 0.34 * near);
            self.pebble(&pebble, 0.42 * (1.0 - near));
        }
    }

    /// Draws a floor of pebbles of one size over the whole picture.
    fn floor(&mut self) {
        let (w, h) = (self.width as f64, self.height as f64);
        self.pixels.fill([96.0, 90.0, 74.0]);
        const N: u64 = 5200;
        for k in 0..N {
            let of = |i: u64| self.random(50, k, i);
            let (y, size) = (h * (1.04 * of(0) - 0.02), w * (0.003 + 0.005 * of(1)));
            let pebble = self.grain(k, y, size, 0.8);
            self.pebble(&pebble, 0.3);
        }
    }

    /// Returns pebble `k` at height `y` of the picture, at a random place across it and of a random color.
    fn grain(&self, k: u64, y: f64, size: f64, light: f64) -> Pebble {
        let of = |i: u64| self.random(50, k, i);
        let gray = 92.0 + 92.0 * of(2);
        let warm = of(3);
        Pebble {
            at: [self.width as f64 * (1.04 * of(4) - 0.02), y],
            radii: [size * (0.95 + 0.5 * of(5)), size * 0.72],
            color: [
                light * gray * (1.0 + 0.14 * warm),
                light * gray * (0.98 - 0.02 * warm),
                light * gray * (0.92 - 0.22 * warm),
            ],
        }
    }

    /// Draws three stones at the back.
    fn rocks(&mut self) {
        let (w, h) = (self.width as f64, self.height as f64);
        for (x, y, rx, ry, gray) in [
            (0.215, 0.795, 0.070, 0.075, 84.0),
            (0.285, 0.818, 0.046, 0.046, 104.0),
            (0.700, 0.815, 0.034, 0.034, 96.0),
        ] {
            let pebble = Pebble {
                at: [x * w, y * h],
                radii: [rx * w, ry * h],
                color: [gray, gray * 0.98, gray * 0.92],
            };
            self.pebble(&pebble, 0.30);
        }
    }

    /// Draws a stone, shaded as a rounded body with a grain. `haze` is the share of water color mixed in,
    /// 0..=1.
    fn pebble(&mut self, stone: &Pebble, haze: f64) {
        let ([cx, cy], [rx, ry]) = (stone.at, stone.radii);
        let (w, h) = (self.width as f64, self.height as f64);
        let grain_seed = self.seed ^ (cx * 64.0) as u64;
        self.blend_near([cx, cy], [rx + 1.0, ry + 1.0], |[x, y]| {
            let [u, v] = [(x - cx) / rx, (y - cy) / ry];
            let out = (u * u + v * v).sqrt();
            let cover = ((1.0 - out) * ry.min(rx) + 0.5).clamp(0.0, 1.0);
            let height = (1.0 - (out * out).min(1.0)).sqrt();
            let lit = 0.46 + 0.60 * (0.62 * height - 0.30 * u - 0.62 * v).max(0.0);
            let cell = [(x * 0.9) as u64, (y * 0.9) as u64];
            let grain = 0.93 + 0.14 * random::uniform(grain_seed, &cell);
            let far = water([x / w, y / h], 0);
            let color = std::array::from_fn(|c| {
                stone.color[c] * lit * grain * (1.0 - haze) + far[c] * haze
            });
            (cover, color)
        });
    }

    fn disc(&mut self, center: [f64; 2], radius: f64, color: [f64; 3]) {
        self.blend_near(center, [radius + 1.0; 2], |[x, y]| {
            let gap = (x - center[0]).hypot(y - center[1]);
            ((radius + 0.5 - gap).clamp(0.0, 1.0), color)
        });
    }

    /// Blends the coverage and color that `paint` returns for every pixel center within `reach` of
    /// `center`.
    fn blend_near(
        &mut self,
        center: [f64; 2],
        reach: [f64; 2],
        paint: impl Fn([f64; 2]) -> (f64, [f64; 3]),
    ) {
        let span = |at: f64, reach: f64, limit: usize| {
            let clip = |v: f64| v.clamp(0.0, limit as f64) as usize;
            clip((at - reach).floor())..clip((at + reach).ceil())
        };
        for y in span(center[1], reach[1], self.height) {
            for x in span(center[0], reach[0], self.width) {
                let (cover, color) = paint([x as f64 + 0.5, y as f64 + 0.5]);
                let under = &mut self.pixels[y * self.width + x];
                *under = std::array::from_fn(|c| under[c] + cover * (color[c] - under[c]));
            }
        }
    }

    fn into_image(self) -> RgbImage {
        let byte = |v: f64| (v + 0.5).clamp(0.0, 255.0) as u8;
        RgbImage {
            width: self.width as u32,
            height: self.height as u32,
            pixels: self.pixels.iter().flatten().map(|&v| byte(v)).collect(),
        }
    }
}

/// One leaf. Horizontal lengths are shares of the image width, vertical lengths of the image height.
struct Blade {
    root: [f64; 2],
    tall: f64,
    lean: f64,
    sway: f64,
    /// Phase of the sway along the leaf, and at its root.
    wave_rad: f64,
    phase_rad: f64,
    wide: f64,
}

/// Returns the color of the water at a position, 0..=1 across and down. The water is lighter at the top and
/// in the middle, with slanting shafts of light that fade downward.
fn water([x, y]: [f64; 2], seed: u64) -> [f64; 3] {
    let down = y.clamp(0.0, 1.0);
    let ramp = 1.0 - (1.0 - down) * (1.0 - down);
    let side = 2.0 * x - 1.0;
    let slant = x + 0.32 * y + (seed % 7) as f64 * 0.03;
    let shafts = libm::sin(19.0 * slant)
        + 0.7 * libm::sin(31.0 * slant + 1.0)
        + 0.5 * libm::sin(53.0 * slant);
    let light = 1.0 - 0.20 * side * side + 0.035 * shafts * (1.0 - down) * (1.0 - down);
    std::array::from_fn(|c| (WATER[0][c] + ramp * (WATER[1][c] - WATER[0][c])) * light)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scene_depends_only_on_the_seed() {
        assert_eq!(tank_scene(96, 72, 5), tank_scene(96, 72, 5));
        assert_ne!(tank_scene(96, 72, 5), tank_scene(96, 72, 6));
    }

    #[test]
    fn scene_has_no_color_of_the_fish() {
        let scene = tank_scene(160, 120, 1);
        for rgb in scene.pixels.chunks_exact(3) {
            assert!(i32::from(rgb[0]) - i32::from(rgb[2]) < 110, "{rgb:?}");
        }
    }
}
