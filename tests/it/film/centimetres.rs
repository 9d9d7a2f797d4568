//! Speeds in centimetres against the truth, and the commands that write them.

use std::sync::Arc;

use flockreel_core::analysis::{Params, analyze, params::ViewParam, stats};
use flockreel_core::cpu::Level;
use flockreel_core::library::motion::speeds_px_per_s;
use flockreel_core::library::{Poses, Scale};
use flockreel_core::progress::Silent;
use flockreel_core::raster::RgbImage;
use flockreel_core::scratch::{InMemory, Scratch};

use super::sample::{filmed, flockreel, library_on_disk, median};
use super::staged::{FPS, HEIGHT, Staged, WIDTH, put};

/// Returns the median relative error of the speeds. `truth` returns the true speed at a frame, centimetres per second;
/// frames for which it returns `None` do not count.
fn median_error(poses: &Poses, scale: Scale, truth: impl Fn(usize) -> Option<f64>) -> f64 {
    let speeds = speeds_px_per_s(poses);
    let error = |k: usize| {
        let (found, known) = (scale.cm(speeds[k]?), truth(k)?);
        Some((found - known).abs() / known)
    };
    let errors: Vec<f64> = (0..speeds.len()).filter_map(error).collect();
    assert!(errors.len() >= 30, "{} frames", errors.len());
    median(errors)
}

#[test]
fn speeds_from_the_side_follow_from_the_length_of_the_animal() {
    let (film, library, _) = filmed();
    let truth = film.truth();
    let length_px = stats::length_px(&library.poses);
    let length_cm = 100.0 * film.animal().length_m;
    let scale = Scale::from_length(length_cm, length_px).unwrap();
    // The truth has the middle of the drawn silhouette, which sways with the tail, like the measured one.
    let focal_px = film.motion().camera.focal_px();
    let speed = |k: usize| {
        let at = |k: usize| truth.frames.get(k)?.centroid_px;
        let ([x0, y0], [x1, y1]) = (at(k.checked_sub(2)?)?, at(k + 2)?);
        let px_per_cm = focal_px / (100.0 * truth.frames[k].position_m?[2]);
        let cm_per_s = (x1 - x0).hypot(y1 - y0) * truth.fps / 4.0 / px_per_cm;
        // The scale holds in the plane in which the fish appears as long as it was measured.
        let is_in_plane = (px_per_cm / scale.px_per_cm() - 1.0).abs() < 0.05;
        (is_in_plane && cm_per_s > 1.0).then_some(cm_per_s)
    };
    let error = median_error(&library.poses, scale, speed);
    assert!(error < 0.05, "{error}");
}

/// Pixels per centimetre of the drawn floor.
const PX_PER_CM: f64 = 8.0;

/// Returns the place of the drawn animal, pixels, and its direction: once around an ellipse in 5 s.
fn place(k: usize) -> ([f64; 2], [f64; 2]) {
    let phase = std::f64::consts::TAU * k as f64 / FPS / 5.0;
    let at = [160.0 + 105.0 * phase.cos(), 120.0 + 70.0 * phase.sin()];
    let to = [-105.0 * phase.sin(), 70.0 * phase.cos()];
    let length = to[0].hypot(to[1]);
    (at, to.map(|side| side / length))
}

/// Draws a spotted floor and a dark ellipse of 36 x 14 px, smooth at its edge.
fn draw_floor(k: usize, picture: &mut RgbImage, _: [f64; 2]) {
    let ([x0, y0], [cos, sin]) = place(k);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let floor = 170.0 + f64::from((7 * x + 13 * y) % 11);
            let (dx, dy) = (f64::from(x) + 0.5 - x0, f64::from(y) + 0.5 - y0);
            let (along, across) = (dx * cos + dy * sin, dy * cos - dx * sin);
            let outside = (along / 18.0).hypot(across / 7.0) - 1.0;
            let alpha = (0.5 - 7.0 * outside).clamp(0.0, 1.0);
            let gray = floor + alpha * (40.0 - floor);
            put(picture, [x, y], [gray.round() as u8; 3]);
        }
    }
}

#[test]
fn speeds_from_above_follow_from_the_scale_of_the_floor() {
    let film = Staged::plain().with_drawing(draw_floor);
    let params = Params {
        view: Some(ViewParam::Top),
        ..Params::default()
    };
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let library = analyze(&film, None, &params, Level::detect(), &scratch, &Silent).unwrap();
    let scale = Scale::new(PX_PER_CM).unwrap();
    let speed = |k: usize| {
        let ([x0, y0], [x1, y1]) = (place(k.checked_sub(1)?).0, place(k + 1).0);
        Some((x1 - x0).hypot(y1 - y0) * FPS / 2.0 / PX_PER_CM)
    };
    let error = median_error(&library.poses, scale, speed);
    assert!(error < 0.02, "{error}");
}

#[test]
fn commands_set_the_scale_and_write_centimetres() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    for name in ["one", "two"] {
        library_on_disk(&dir.path().join(name));
    }
    let (one, two, motion) = (at("one"), at("two"), at("motion.csv"));
    let run = |args: &[&str]| {
        let done = flockreel(args);
        assert!(done.status.success(), "{done:?}");
        String::from_utf8(done.stdout).unwrap()
    };
    let said = run(&["scale", &one, "--length-cm", "12.5", "--json"]);
    assert!(said.contains("\"length_cm\":12.5"), "{said}");
    run(&["motion", &one, "-o", &motion]);
    let text = std::fs::read_to_string(&motion).unwrap();
    assert!(text.starts_with("frame,time_s,x_cm,y_cm,speed_bl_per_s,speed_cm_per_s,"));

    let table = run(&["summary", &one, &two]);
    let rows: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split(',').collect())
        .collect();
    let in_cm = rows[0]
        .iter()
        .position(|name| *name == "distance_cm")
        .unwrap();
    assert_eq!((rows.len(), rows[1][0], rows[2][0]), (3, &*one, &*two));
    assert!(rows[1][in_cm].parse::<f64>().unwrap() > 1.0 && rows[2][in_cm].is_empty());

    run(&["scale", &one, "--none"]);
    let table = run(&["summary", &one, "--json"]);
    assert!(table.contains("\"distance_cm\":null"), "{table}");
    for wrong in [
        &["--px-per-cm", "0"][..],
        &["--length-cm", "0"],
        &[],
        &["--none", "--px-per-cm", "3"],
    ] {
        let refused = flockreel(&[&["scale", &one], wrong].concat());
        assert_eq!(refused.status.code(), Some(2), "{wrong:?}");
    }
}
