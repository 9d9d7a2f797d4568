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
