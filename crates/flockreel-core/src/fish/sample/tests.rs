//! Tests of the sample film: the exact poses match the frames, and the frames are reproducible.

use super::*;

fn small(n_frames: usize) -> SampleFilm {
    let params = SampleParams {
        n_frames,
        width: 320,
        height: 240,
        ..SampleParams::default()
    };
    SampleFilm::new(params).expect("the parameters are in range")
}

fn read_all(film: &SampleFilm) -> Vec<(f64, Frame)> {
    let mut stream = film.open().expect("nothing to fail");
    let mut frame = Frame::default();
    let mut frames = Vec::new();
    while let Some(time_s) = stream.next_frame(&mut frame).expect("nothing to fail") {
        frames.push((time_s, frame.clone()));
    }
    frames
}

#[test]
fn film_has_the_requested_frames_and_rate() {
    let film = small(20);
    let frames = read_all(&film);
    assert_eq!(frames.len(), 20);
    for (k, (time_s, frame)) in frames.iter().enumerate() {
        assert!((time_s - k as f64 / 30.0).abs() < 1e-12);
        assert_eq!((frame.width, frame.height), (320, 240));
    }
    assert_eq!(film.truth().frames.len(), 20);
}

#[test]
fn equal_seeds_give_equal_bytes_and_other_seeds_differ() {
    let film = small(5);
    let first = read_all(&film);
    assert_eq!(first, read_all(&film));
    assert_eq!(first, read_all(&small(5)));
    let other = SampleParams {
        seed: 2,
        ..film.params
    };
    assert_ne!(first, read_all(&SampleFilm::new(other).expect("in range")));
}

#[test]
fn true_centroid_is_where_the_frame_differs_from_the_background() {
    let film = small(40);
    for k in [0, 13, 39] {
        let mut frame = Frame::default();
        film.render(k, &mut frame);
        let mut background = Frame::new(320, 240, frame.color);
        background.draw_all_rgb(film.background());
        let (image, background) = (frame.to_rgb(), background.to_rgb());
        let (mut n, mut sum) = (0.0, [0.0, 0.0]);
        for y in 0..240 {
            for x in 0..320 {
                let (a, b) = (image.pixel(x, y), background.pixel(x, y));
                if a.iter().zip(b).any(|(p, q)| p.abs_diff(q) > 24) {
                    sum = [sum[0] + f64::from(x) + 0.5, sum[1] + f64::from(y) + 0.5];
                    n += 1.0;
                }
            }
        }
        let truth = film.true_pose(k).centroid_px.expect("it is in sight");
        let gap = (sum[0] / n - truth[0]).hypot(sum[1] / n - truth[1]);
        // Chroma is stored per block of 2 x 2 pixels, so the visible outline is that coarse.
        assert!(gap < 1.5, "frame {k}: {gap} px");
    }
}

#[test]
fn true_heading_points_from_tail_to_head() {
    let film = small(300);
    let motion = film.motion();
    for k in (0..300).step_by(17) {
        let (pose, posture) = (film.true_pose(k), &motion.frames[k]);
        let ahead = posture.position_m + 1e-6 * posture.forward();
        let [from, to] =
            [posture.position_m, ahead].map(|p| motion.camera.image_from_camera(p.to_array()));
        let seen = libm::atan2(to[1] - from[1], to[0] - from[0]);
        let gap = crate::geometry::wrap_rad(seen - pose.heading_rad.expect("it is in sight"));
        assert!(gap.abs() < 1e-3, "frame {k}: {gap}");
    }
}

#[test]
fn film_from_above_shows_the_same_swimmer_over_the_floor() {
    let side = small(60);
    let top = SampleFilm::new(SampleParams {
        view: View::Top,
        ..side.params
    });
    let top = top.expect("the parameters are in range");
    for k in [0, 31, 59] {
        let (a, b) = (side.true_pose(k), top.true_pose(k));
        let [x, y, z] = a.position_m.expect("known");
        let [floor_x, floor_y, down] = b.position_m.expect("known");
        assert_eq!(floor_x, x);
        assert!((floor_y - (0.85 - z)).abs() < 1e-12);
        assert!((down - (y + 0.88)).abs() < 1e-12);
        // Turning left, away from the camera at the side, is turning up in the picture from above.
        let (forward, seen) = (a.forward.expect("known"), b.forward.expect("known"));
        assert!((seen[1] + forward[2]).abs() < 1e-9 && (seen[2] - forward[1]).abs() < 1e-9);
        assert_eq!(a.body, b.body);
        let [cx, cy] = b.centroid_px.expect("it is in sight");
        let midline = b.midline_px.expect("known");
        let off = midline.iter().map(|[px, py]| (px - cx).hypot(py - cy));
        let off = off.fold(f64::MAX, f64::min);
        assert!(off < 2.5, "frame {k}: {off} px");
    }
}

#[test]
fn tail_tip_lies_where_the_joints_say() {
    let film = small(40);
    for (k, posture) in film.motion().frames.iter().enumerate() {
        let body = film.true_pose(k).body.expect("a model");
        assert_eq!(body.joint_angles_rad, posture.joint_angles_rad);
        // The tip lies between the directions of the first and the last segment.
        let turned: f64 = body.joint_angles_rad.iter().sum();
        assert!(
            body.tail_tip_rad.abs() <= turned.abs().max(0.35),
            "{body:?}"
        );
        assert!((1.0..2.2).contains(&body.fin_spread_rad), "{body:?}");
    }
    let swings = (0..40).map(|k| film.true_pose(k).body.expect("a model").tail_tip_rad);
    let [low, high] = swings.fold([0.0f64; 2], |[lo, hi], a| [lo.min(a), hi.max(a)]);
    assert!(low < -0.05 && high > 0.05, "{low} {high}");
}

#[test]
fn noise_has_the_requested_standard_deviation() {
    let film = small(1);
    let (mut noisy, mut clean) = (Frame::default(), Frame::default());
    film.render(0, &mut noisy);
    film.film.render(0, &mut clean);
    let gaps = noisy
        .luma()
        .iter()
        .zip(clean.luma())
        .map(|(a, b)| f64::from(*a) - f64::from(*b));
    let (n, sum, square) = gaps.fold((0.0, 0.0, 0.0), |(n, s, q), g| (n + 1.0, s + g, q + g * g));
    let sigma = (square / n - (sum / n) * (sum / n)).sqrt();
    assert!((sigma - 1.7f64.hypot(0.29)).abs() < 0.1, "{sigma}");
}

#[test]
fn sizes_and_rates_out_of_range_are_refused() {
    let params = SampleParams {
        n_frames: 0,
        ..SampleParams::default()
    };
    assert!(matches!(
        SampleFilm::new(params),
        Err(Error::InvalidParams(_))
    ));
    let params = SampleParams {
        fps: f64::NAN,
        ..SampleParams::default()
    };
    assert!(SampleFilm::new(params).is_err());
}
