//! Hints of the user: the part of the film to analyze, a point on the animal, and boxes to ignore.

use flockreel_core::analysis::params::{AnimalAtParam, IgnoreParam};
use flockreel_core::analysis::{Error, Params};
use flockreel_core::footage::{FrameSource, Part};
use flockreel_core::raster::Frame;

use super::staged::{HEIGHT, N_FRAMES, Staged, WIDTH, put};

/// Vertical offset of the second fish, pixels.
const LOWER_PX: u32 = 70;

/// Returns a film of the fish with a second one below: the first, rotated by 180 degrees about the
/// picture's center and shifted down.
fn two_fish() -> Staged {
    let film = Staged::plain();
    let scene = film.scene().clone();
    film.with_drawing(|_, picture, _| {
        let shown = picture.clone();
        for y in LOWER_PX..HEIGHT {
            for x in 0..WIDTH {
                let (there_x, there_y) = (WIDTH - 1 - x, HEIGHT - 1 + LOWER_PX - y);
                if there_y >= HEIGHT {
                    continue;
                }
                let (fish, empty) = (shown.pixel(there_x, there_y), scene.pixel(there_x, there_y));
                if (0..3).any(|c| fish[c].abs_diff(empty[c]) > 24) {
                    put(picture, [x, y], fish);
                }
            }
        }
    })
}

#[test]
fn animal_at_selects_one_of_two_animals() {
    let film = two_fish();
    let turned = |[x, y]: [f64; 2]| [f64::from(WIDTH) - x, f64::from(HEIGHT + LOWER_PX) - y];
    match film.analyzed(&Params::default()) {
        Err(Error::SeveralAnimals { frame, boxes_px }) => {
            let fish = film.centroid_px(frame).expect("it is shown");
            for point in [fish, turned(fish)] {
                let [x, y] = point.map(|v| v as u32);
                let n_there = boxes_px.iter().filter(|b| b.contains(x, y)).count();
                assert_eq!(n_there, 1, "{point:?} in {boxes_px:?}");
            }
        }
        other => panic!(
            "the film is not refused for several animals: {:?}",
            other.err()
        ),
    }
    let point = film.centroid_px(60).expect("it is shown");
    let other = turned(point);
    let pointing_at = |point| {
        let animal_at = Some(AnimalAtParam {
            frame: 60,
            at_px: point,
        });
        let params = Params {
            animal_at,
            ..Params::default()
        };
        film.analyzed(&params).expect("a library")
    };
    film.check("the fish", &pointing_at(point));
    let library = pointing_at(other);
    let far = |k: usize| {
        let truth = film.centroid_px(k).expect("it is shown");
        let found = library.poses.frames[k].centroid_px?;
        let truth = turned(truth);
        Some((found[0] - truth[0]).hypot(found[1] - truth[1]) > 6.0)
    };
    let n_far = (0..N_FRAMES).filter(|&k| far(k) == Some(true)).count();
    assert!(n_far < N_FRAMES / 20, "the other: {n_far}");
}

#[test]
fn point_without_an_animal_is_refused() {
    let film = Staged::plain();
    let [x, y] = film.centroid_px(60).expect("it is shown");
    let (width, height) = (f64::from(WIDTH), f64::from(HEIGHT));
    let point = [
        if x > width / 2.0 { 5.0 } else { width - 5.0 },
        if y > height / 2.0 { 5.0 } else { height - 5.0 },
    ];
    for (frame, point) in [(60, point), (N_FRAMES as u32, [x, y])] {
        let animal_at = Some(AnimalAtParam {
            frame,
            at_px: point,
        });
        let params = Params {
            animal_at,
            ..Params::default()
        };
        let error = film.analyzed(&params).expect_err("nothing is there");
        assert!(matches!(error, Error::NothingAtPoint(_)), "{error}");
    }
}

#[test]
fn ignored_box_hides_a_blinking_object() {
    let film = Staged::plain().with_drawing(|k, picture, _| {
        for y in 5..35 {
            for x in 5..65 {
                put(
                    picture,
                    [x, y],
                    if k / 5 % 2 == 0 { [250; 3] } else { [5; 3] },
                );
            }
        }
    });
    let without = film.analyzed(&Params::default()).expect("a library");
    assert!(!without.poses.other_movers.is_empty());
    let ignoring = |from_s, to_s| Params {
        ignore: vec![IgnoreParam {
            box_px: [0, 0, 70, 40],
            from_s,
            to_s,
        }],
        ..Params::default()
    };
    let library = film.analyzed(&ignoring(None, None)).expect("a library");
    assert_eq!(library.poses.other_movers, []);
    film.check("ignored", &library);
    let half = film
        .analyzed(&ignoring(None, Some(2.5)))
        .expect("a library");
    let told = &half.poses.other_movers;
    assert!(
        !told.is_empty() && told.iter().all(|m| m.from_s > 2.4),
        "{told:?}"
    );
}

#[test]
fn part_has_the_frames_of_its_time_span() {
    let film = Staged::plain();
    let part = Part::new(&film, Some(1.0), Some(3.0));
    assert_eq!(part.format().n_frames_hint, 60);
    let (mut whole, mut of_part) = (film.open().unwrap(), part.open().unwrap());
    let (mut expected, mut found) = (Frame::default(), Frame::default());
    for _ in 0..30 {
        whole.next_frame(&mut expected).unwrap();
    }
    for k in 0..60 {
        whole.next_frame(&mut expected).unwrap();
        let time_s = of_part.next_frame(&mut found).unwrap().expect("a frame");
        assert!((time_s - f64::from(30 + k) / 30.0).abs() < 1e-9, "{time_s}");
        assert_eq!(found, expected, "frame {k}");
    }
    assert_eq!(of_part.next_frame(&mut found).unwrap(), None);
    let mut n_spread = 0;
    let mut visit = |_: &Frame| {
        n_spread += 1;
        std::ops::ControlFlow::Continue(())
    };
    part.spread(16, &mut visit).unwrap();
    assert_eq!(n_spread, 16);
    let beyond = Part::new(&film, Some(100.0), None);
    assert_eq!(beyond.format().n_frames_hint, 0);
    assert_eq!(beyond.open().unwrap().next_frame(&mut found).unwrap(), None);
}

#[test]
fn measured_part_keeps_the_frame_numbers_and_times_of_the_film() {
    let film = Staged::plain();
    let at_px = film.centroid_px(60).expect("it is shown");
    let params = Params {
        from_s: Some(1.0),
        to_s: Some(4.0),
        animal_at: Some(AnimalAtParam { frame: 60, at_px }),
        ..Params::default()
    };
    let library = film.analyzed(&params).expect("a library");
    let frames = &library.poses.frames;
    assert_eq!(
        (frames.len(), library.sprites.n_frames()),
        (N_FRAMES, N_FRAMES)
    );
    for (k, pose) in frames.iter().enumerate() {
        assert!((pose.time_s - k as f64 / 30.0).abs() < 1e-6, "frame {k}");
        if !(30..120).contains(&k) {
            assert!(
                !pose.detected() && !library.sprites.is_present(k),
                "frame {k}"
            );
        }
    }
    assert!(frames.iter().filter(|pose| pose.detected()).count() > 80);
    let found = frames[60].centroid_px.expect("the animal");
    assert!((found[0] - at_px[0]).hypot(found[1] - at_px[1]) < 6.0);
    assert!(
        library
            .playback
            .component
            .iter()
            .all(|frame| (30..120).contains(frame))
    );
    let nowhere = Params {
        animal_at: Some(AnimalAtParam {
            frame: 60,
            at_px: [1.0, 1.0],
        }),
        ..params
    };
    match film.analyzed(&nowhere).expect_err("nothing is there") {
        Error::NothingAtPoint(at) => assert_eq!(at.frame, 60),
        other => panic!("{other}"),
    }
}
