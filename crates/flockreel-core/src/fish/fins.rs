//! Fins of the virtual fish: surfaces with rays, from a base on the trunk to a free edge.
//!
//! The fish has a forked tail fin, one dorsal and one anal fin, and pairs of pelvic and pectoral fins.

use super::body::{TRUNK_END_S, profile_bl};
use super::colors::Colors;
use super::mesh::{Layer, Material, MeshBuilder, SurfacePoint};

/// Adds all fins to the mesh.
pub(super) fn add_fins(builder: &mut MeshBuilder, colors: &Colors) {
    let mut add = |resolution, n_rays, point: &dyn Fn(f64, f64) -> [f64; 3]| {
        add_fin(builder, colors, resolution, n_rays, point);
    };
    add([33, 13], 20.0, &tail);
    add([25, 9], 17.0, &dorsal);
    add([13, 9], 8.0, &anal);
    for sign in [1.0, -1.0] {
        add([11, 9], 8.0, &|v, w| mirrored(pelvic(v, w), sign));
        add([11, 9], 8.0, &|v, w| mirrored(pectoral(v, w), sign));
    }
}

/// Adds one fin. `point(v, w)` is its surface: v in 0..=1 from the first ray to the last, w in 0..=1 from
/// base to edge.
///
/// The grid has `n_across` points across the rays and `n_out` points from base to edge.
fn add_fin(
    builder: &mut MeshBuilder,
    colors: &Colors,
    [n_across, n_out]: [usize; 2],
    n_rays: f64,
    point: &dyn Fn(f64, f64) -> [f64; 3],
) {
    builder.add_grid(Layer::Fins, n_across, n_out, |i, j| {
        let v = i as f64 / (n_across - 1) as f64;
        // Rows are denser toward the edge, where the opacity changes.
        let t = j as f64 / (n_out - 1) as f64;
        let w = t * (1.35 - 0.35 * t);
        let material = Material {
            color: colors.fin(w),
            shine: 0.25,
            grain: [(v * n_rays) as f32, w as f32],
            grain_depth: -0.20,
        };
        SurfacePoint {
            at: point(v, w),
            material,
        }
    });
}

/// Returns a point of the tail fin: two rounded lobes with a notch between them. v runs from the upper lobe
/// to the lower.
fn tail(v: f64, w: f64) -> [f64; 3] {
    let side = 2.0 * v - 1.0;
    let a = side.abs();
    let [above, below, _] = profile_bl(TRUNK_END_S);
    let base = [
        TRUNK_END_S - 0.022,
        side * if side < 0.0 { above } else { below } * 0.92,
    ];
    // The edge runs from the notch back to the tip of the lobe, and forward a little beyond the tip.
    let reach = 0.880 + 0.120 * smooth(a / 0.86) - 0.035 * smooth((a - 0.86) / 0.14);
    let spread = 0.192 * libm::pow(a, 0.80) * side.signum();
    // Rays start along the body and fan out.
    let fan = w * (0.85 + 0.15 * w);
    [
        base[0] + (reach - base[0]) * w,
        base[1] + (spread - base[1]) * fan,
        0.004 * libm::sin(9.0 * side) * w,
    ]
}

/// Returns a point of the dorsal fin: tall in front, lower behind, swept back.
fn dorsal(v: f64, w: f64) -> [f64; 3] {
    let s = 0.275 + 0.32 * v;
    let height = 0.128 * smooth(v / 0.16 + 0.22) * (1.0 - 0.52 * v);
    let [above, ..] = profile_bl(s);
    [
        s + w * (0.062 + 0.035 * v),
        -0.93 * above - height * w,
        0.004 * libm::sin(8.0 * v) * w,
    ]
}

/// Returns a point of the anal fin: short, below the tail root.
fn anal(v: f64, w: f64) -> [f64; 3] {
    let s = 0.575 + 0.075 * v;
    let height = 0.082 * smooth(v / 0.3 + 0.35) * (1.0 - 0.5 * v);
    let [_, below, _] = profile_bl(s);
    [s + w * (0.065 + 0.02 * v), 0.9 * below + height * w, 0.0]
}

/// Returns a point of the left pelvic fin, below the belly.
fn pelvic(v: f64, w: f64) -> [f64; 3] {
    let s = 0.365 + 0.035 * v;
    let [_, below, side] = profile_bl(s);
    let reach = 1.0 - 0.45 * v;
    [
        s + 0.098 * w * reach + 0.02 * w * v,
        0.86 * below + 0.075 * w * reach,
        0.40 * side + 0.035 * w * reach,
    ]
}

/// Returns a point of the left pectoral fin, behind the gills.
fn pectoral(v: f64, w: f64) -> [f64; 3] {
    let s = 0.215 + 0.008 * v;
    let [_, below, side] = profile_bl(s);
    let start = (0.42 + 0.28 * v) * below;
    let share = start / below;
    // Rays near v = 0.35 are the longest.
    let reach = 1.0 - 0.35 * (2.0 * v - 0.7) * (2.0 * v - 0.7);
    [
        s + 0.098 * w * reach,
        start + w * reach * (0.012 + 0.052 * v),
        0.94 * side * (1.0 - share * share).sqrt() + 0.052 * w * reach,
    ]
}

fn mirrored([s, down, left]: [f64; 3], sign: f64) -> [f64; 3] {
    [s, down, sign * left]
}

/// Smoothstep: 0 for x <= 0, 1 for x >= 1, smooth between.
fn smooth(x: f64) -> f64 {
    let t = x.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
