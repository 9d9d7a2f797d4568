//! Tests of the figure: it is found where it was drawn, and its mesh has the outline and colors of the frames.

use std::f64::consts::PI;

use super::*;
use crate::fish::mesh::Mesh;

const ORANGE: [u8; 3] = [200, 90, 20];

/// Returns the silhouette of a body: an ellipse with a tail fin, in a picture of 160 x 120.
/// The matte is the part from (30, 30) to (130, 90).
fn drawn(fit: &Fit) -> Pixels {
    let covers = |s: f64, t: f64| {
        let body = ((s - 0.35) / 0.35, t / 0.2);
        let in_tail = (0.65..1.0).contains(&s) && t.abs() < 0.25 * (s - 0.6);
        body.0 * body.0 + body.1 * body.1 < 1.0 || in_tail
    };
    let flat = fit.flat(0.5);
    let pixel = |k: usize| {
        let at = [(30 + k % 100) as f64 + 0.5, (30 + k / 100) as f64 + 0.5];
        let is_covered = flat.body_at(at).is_some_and(|[s, t]| covers(s, t));
        let [r, g, b] = ORANGE;
        [r, g, b, if is_covered { 255 } else { 0 }]
    };
    let rgba = (0..100 * 60).flat_map(pixel).collect();
    Pixels::of([30, 30], [100, 60], [160, 120], rgba)
}

fn fit(yaw_rad: f64, pitch_rad: f64, length_px: f64) -> Fit {
    Fit {
        center_px: [80.0, 60.0],
        yaw_rad,
        pitch_rad,
        length_px,
        bend: [0.0; 3],
    }
}

fn sheet_of(fit: Fit) -> (Sheet, Vec<Chart>, Vec<Pixels>) {
    let (charts, pixels) = (charts(&[fit], 0.5), vec![drawn(&fit)]);
    let wide = Grid::wide([-0.2, 1.2], [-0.4, 0.4], 80.0);
    let sheet = Sheet::mean(wide, &charts, &pixels);
    let sheet = Sheet::mean(sheet.visible(), &charts, &pixels);
    (sheet, charts, pixels)
}

#[test]
fn bent_body_is_mapped_there_and_back() {
    let bent = Fit {
        bend: [0.3, 0.2, -0.4],
        ..fit(-1.0, 0.2, 100.0)
    };
    let flat = bent.flat(0.5);
    for at in [[0.05, 0.1], [0.4, -0.1], [0.9, 0.05]] {
        let [s, t] = flat.body_at(flat.image(at[0], at[1])).expect("no fold");
        assert!(
            (s - at[0]).abs() < 1e-3 && (t - at[1]).abs() < 1e-3,
            "{at:?} {s} {t}"
        );
    }
}

#[test]
fn figure_is_found_where_it_was_drawn() {
    let (sheet, ..) = sheet_of(fit(0.0, 0.0, 100.0));
    for (yaw_rad, pitch_rad, length_px) in [(0.0, 0.3, 80.0), (-PI, -0.5, 70.0), (-0.8, 0.1, 90.0)]
    {
        let wanted = fit(yaw_rad, pitch_rad, length_px);
        let start = Fit {
            center_px: [77.0, 62.0],
            yaw_rad: if yaw_rad < -2.0 { -PI } else { 0.0 },
            pitch_rad: pitch_rad - 0.1,
            length_px: 85.0,
            bend: [0.0; 3],
        };
        let got = Outline::new(&drawn(&wanted)).search(&sheet, 0.5, &start);
        let off = (got.center_px[0] - 80.0).hypot(got.center_px[1] - 60.0);
        assert!(off < 3.0, "{got:?}");
        assert!(
            (libm::cos(got.yaw_rad) - libm::cos(yaw_rad)).abs() < 0.2,
            "{got:?}"
        );
        assert!((got.pitch_rad - pitch_rad).abs() < 0.1, "{got:?}");
        assert!((got.length_px / length_px - 1.0).abs() < 0.15, "{got:?}");
    }
}

fn mesh() -> Mesh {
    let (sheet, charts, pixels) = sheet_of(fit(0.0, 0.0, 100.0));
    let picture = sheet.grid.picture(&sheet, &charts, &pixels);
    let figure = Figure {
        view: View::Side,
        grid: sheet.grid,
        picture,
        sheet,
        center_s: 0.5,
        length_px: 100.0,
        fits: Vec::new(),
        beat_hz: 0.0,
        bends: Vec::new(),
    };
    figure.mesh(0.2, None)
}

#[test]
fn body_has_the_filmed_outline_and_its_surface_faces_outward() {
    let mesh = mesh();
    let at = |v: &u32| mesh.vertices[*v as usize].position_m;
    let volume = |t: &[u32; 3]| at(&t[0]).dot(at(&t[1]).cross(at(&t[2]))) / 6.0;
    assert!(
        mesh.body.iter().map(volume).sum::<f64>() > 0.0,
        "inside out"
    );
    let body = mesh.body.iter().flatten().map(at);
    let [low, high] = body.fold([f64::MAX, f64::MIN], |[lo, hi], p| {
        [lo.min(p.y), hi.max(p.y)]
    });
    assert!((high - low - 0.2 * 0.4).abs() < 0.008, "{}", high - low);
    let wide = mesh
        .body
        .iter()
        .flatten()
        .map(|v| at(v).z.abs())
        .fold(0.0, f64::max);
    assert!((0.015..0.025).contains(&wide), "half width {wide}");
}

#[test]
fn picture_has_the_colors_of_the_frames_and_is_clear_beyond_the_animal() {
    let picture = mesh().picture.expect("a figure has one");
    let (w, h) = (picture.width, picture.height);
    let middle = picture.pixel(w / 3, h / 2);
    assert_eq!(middle, [ORANGE[0], ORANGE[1], ORANGE[2], 255]);
    let corner = picture.pixel(0, 0);
    assert_eq!(corner[3], 0);
    assert_eq!(corner[..3], ORANGE, "the edge does not fade into black");
}

#[test]
fn midline_goes_on_straight_beyond_both_ends() {
    let points: Vec<[f64; 2]> = (0..11)
        .map(|k| [100.0 - 4.0 * f64::from(k), 50.0])
        .collect();
    let midline = Midline::new(&points).expect("it has a length");
    assert_eq!(midline.length_px(), 40.0);
    for (distance, x) in [(-5.0, 105.0), (10.0, 90.0), (50.0, 50.0)] {
        let (point, toward_tail) = midline.at(distance);
        assert!((point[0] - x).abs() < 1e-9 && (point[1] - 50.0).abs() < 1e-9);
        assert!((toward_tail[0] + 1.0).abs() < 1e-9);
    }
    assert!(Midline::new(&[[1.0, 1.0], [1.0, 1.0]]).is_none());
}
