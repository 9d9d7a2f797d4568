//! Colors of the virtual fish, in encoded sRGB, 0..=1.
//!
//! The fish is countershaded like fish of open water: darker above and paler below.

use super::params::Palette;

/// Colors of one fish.
pub(super) struct Colors {
    back: Rgb,
    flank: Rgb,
    belly: Rgb,
    fin_base: Rgb,
    fin_edge: Rgb,
    iris: Rgb,
}

type Rgb = [f32; 3];

impl Colors {
    /// Returns the colors of a palette.
    pub(super) fn new(palette: Palette) -> Colors {
        match palette {
            Palette::Goldfish => Colors {
                back: [0.78, 0.24, 0.03],
                flank: [0.97, 0.46, 0.07],
                belly: [1.0, 0.86, 0.62],
                fin_base: [0.96, 0.44, 0.08],
                fin_edge: [1.0, 0.76, 0.42],
                iris: [0.88, 0.70, 0.30],
            },
            Palette::Silver => Colors {
                back: [0.30, 0.37, 0.40],
                flank: [0.66, 0.72, 0.73],
                belly: [0.94, 0.95, 0.93],
                fin_base: [0.52, 0.57, 0.56],
                fin_edge: [0.80, 0.83, 0.80],
                iris: [0.85, 0.84, 0.70],
            },
            Palette::Bronze => Colors {
                back: [0.10, 0.09, 0.10],
                flank: [0.24, 0.19, 0.16],
                belly: [0.62, 0.48, 0.32],
                fin_base: [0.16, 0.14, 0.14],
                fin_edge: [0.42, 0.36, 0.30],
                iris: [0.72, 0.55, 0.25],
            },
        }
    }

    /// Returns the RGBA color of the skin at `s` (0 = nose, 1 = tip of the tail) and `up` (1 = back, -1 =
    /// belly).
    pub(super) fn skin(&self, s: f64, up: f64) -> [f32; 4] {
        let up = up as f32;
        let above = mix(self.flank, self.back, smoothstep(0.15, 0.95, up));
        let mut color = mix(self.belly, above, smoothstep(-0.95, -0.15, up));
        // Cheeks are smooth and slightly paler. The edge of the gill cover is a dark crescent.
        let s = s as f32;
        let cheek = 1.0 - smoothstep(0.14, 0.19, s);
        let pale = mix(self.flank, self.belly, 0.35);
        color = mix(color, pale, 0.35 * cheek * (1.0 - up.abs()));
        let (along, across) = ((s - 0.125) / 0.085, (up + 0.12) / 0.92);
        let radius = (along * along + across * across).sqrt();
        let crescent = bump((radius - 1.0) / 0.075) * smoothstep(0.05, 0.5, along);
        color = mix(color, self.back.map(|c| 0.55 * c), 0.75 * crescent);
        // The mouth: a short dark line under the tip of the nose.
        let mouth = bump((up + 0.22) / 0.20) * (1.0 - smoothstep(0.018, 0.034, s));
        color = mix(color, self.back.map(|c| 0.4 * c), 0.7 * mouth);
        [color[0], color[1], color[2], 1.0]
    }

    /// Returns the RGBA color of a fin at `out` (0 = base, 1 = edge). Alpha stays above one half even at
    /// the edge, so that the silhouette ends where the mesh ends.
    pub(super) fn fin(&self, out: f64) -> [f32; 4] {
        let out = out as f32;
        let color = mix(self.fin_base, self.fin_edge, smoothstep(0.1, 1.0, out));
        let alpha = 0.97 - 0.25 * smoothstep(0.0, 0.9, out) - 0.20 * smoothstep(0.93, 1.0, out);
        [color[0], color[1], color[2], alpha]
    }

    /// Returns the RGBA color of the eye at `out` (1 = middle of the pupil, 0 = rim). `up` in -1..=1
    /// brightens the upper part of the iris.
    pub(super) fn eye(&self, out: f64, up: f64) -> [f32; 4] {
        let out = out as f32;
        let iris = self.iris.map(|c| c * (1.0 + 0.15 * up as f32));
        let rim = self.back.map(|c| 0.45 * c);
        let color = mix(rim, iris, smoothstep(0.18, 0.42, out));
        let color = mix(color, [0.03, 0.03, 0.04], smoothstep(0.72, 0.80, out));
        [color[0], color[1], color[2], 1.0]
    }
}

/// Returns 0 below `from`, 1 above `to`, and a smooth curve between.
fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Returns 1 at 0, falling smoothly to 0 at -1 and 1.
fn bump(x: f32) -> f32 {
    let t = (1.0 - x * x).max(0.0);
    t * t
}

fn mix(a: Rgb, b: Rgb, share: f32) -> Rgb {
    std::array::from_fn(|c| a[c] + share * (b[c] - a[c]))
}
