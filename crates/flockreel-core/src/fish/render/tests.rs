//! Tests of the renderer: position, size, orientation, soft edges.

use glam::DVec3;

use super::*;
use crate::fish::motion::rotation_of;
use crate::fish::params::Palette;
use crate::library::Animal;

const SIZE: Animal = Animal {
    length_m: 0.1,
    height_m: 0.048,
};
const IMAGE_PX: [u32; 2] = [320, 240];

fn camera() -> Camera {
    Camera {
        z_min_m: 0.7,
        pane_px_per_m: 1000.0,
        center_px: [160.0, 120.0],
        medium_index: 1.0,
    }
}

fn draw(yaw_rad: f64, pitch_rad: f64) -> Drawing {
    let posture = Posture::at(
        DVec3::new(0.0, 0.0, 0.7),
        rotation_of(yaw_rad, pitch_rad, 0.0),
    );
    Renderer::new(Mesh::goldfish(SIZE, Palette::Goldfish)).draw(&camera(), IMAGE_PX, &posture)
}

/// Returns (left, top, right, bottom) and the centroid of the pixels with alpha above one half.
fn silhouette(drawing: &Drawing) -> ([f64; 4], [f64; 2]) {
    let mut edges = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    let (mut sum, mut n) = ([0.0, 0.0], 0.0);
    for y in 0..drawing.rect.h {
        for x in (0..drawing.rect.w).filter(|&x| drawing.alpha(x, y) > 0.5) {
            let at = [f64::from(drawing.rect.x + x), f64::from(drawing.rect.y + y)];
            edges = [
                edges[0].min(at[0]),
                edges[1].min(at[1]),
                edges[2].max(at[0] + 1.0),
                edges[3].max(at[1] + 1.0),
            ];
            sum = [sum[0] + at[0] + 0.5, sum[1] + at[1] + 0.5];
            n += 1.0;
        }
    }
    (edges, [sum[0] / n, sum[1] / n])
}

#[test]
fn size_at_the_pane_follows_from_the_camera() {
    let ([left, top, right, bottom], centroid) = silhouette(&draw(0.0, 0.0));
    assert!((right - left - 100.0).abs() < 3.5, "{}", right - left);
    assert!((bottom - top - 48.0).abs() < 2.0, "{}", bottom - top);
    assert!((centroid[0] - 160.0).abs() < 2.5, "{centroid:?}");
}

#[test]
fn box_contains_the_fish_and_drawing_is_repeatable() {
    let drawing = draw(0.7, 0.2);
    let ([left, top, right, bottom], _) = silhouette(&drawing);
    let rect = drawing.rect;
    assert!(f64::from(rect.x) <= left && f64::from(rect.y) <= top);
    assert!(f64::from(rect.right()) >= right && f64::from(rect.bottom()) >= bottom);
    assert_eq!(drawing, draw(0.7, 0.2));
}

#[test]
fn back_is_above_belly_in_both_directions() {
    for yaw in [0.0, std::f64::consts::PI] {
        let drawing = draw(yaw, 0.0);
        let column = drawing.rect.w / 2;
        let blue = |y: u32| drawing.pixels[(y * drawing.rect.w + column) as usize][2];
        let rows: Vec<u32> = (0..drawing.rect.h)
            .filter(|&y| drawing.alpha(column, y) > 0.99)
            .collect();
        let (upper, lower) = (rows[rows.len() / 4], rows[rows.len() * 7 / 8]);
        assert!(blue(upper) + 0.1 < blue(lower), "the pale belly is below");
    }
}

#[test]
fn edges_are_antialiased() {
    let drawing = draw(0.3, 0.1);
    let partly = drawing
        .pixels
        .iter()
        .filter(|p| (0.05..0.95).contains(&p[3]))
        .count();
    let fully = drawing.pixels.iter().filter(|p| p[3] > 0.999).count();
    assert!(partly > 100 && fully > 1000, "{partly} {fully}");
}

#[test]
fn invisible_and_out_of_view_fish_cover_nothing() {
    let renderer = Renderer::new(Mesh::goldfish(SIZE, Palette::Silver));
    let upright = rotation_of(0.0, 0.0, 0.0);
    let behind = Posture::at(DVec3::new(0.0, 0.0, -0.5), upright);
    let beside = Posture::at(DVec3::new(2.0, 0.0, 0.7), upright);
    let invisible = Posture {
        visible: false,
        ..Posture::at(DVec3::new(0.0, 0.0, 0.7), upright)
    };
    for posture in [behind, beside, invisible] {
        assert!(renderer.draw(&camera(), IMAGE_PX, &posture).rect.is_empty());
    }
}

#[test]
fn middle_seen_from_the_side_is_at_the_position() {
    for yaw in [0.0, std::f64::consts::PI] {
        let (_, [x, y]) = silhouette(&draw(yaw, 0.0));
        assert!((x - 160.0).hypot(y - 120.0) < 1.0, "{x} {y}");
    }
}
