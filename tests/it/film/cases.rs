//! Common faults of films: the analysis copes with them, or refuses the film for the right reason.

use flockreel_core::analysis::{Error, Params, stats};
use flockreel_core::library::{Disturbance, DisturbanceKind, MoverKind};

use super::staged::{FPS, HEIGHT, N_FRAMES, Staged, WIDTH, put};

/// Analyzes the film with default parameters, checks the poses against the truth and returns the library.
fn measured(name: &str, film: &Staged) -> flockreel_core::library::Library {
    let library = film.analyzed(&Params::default());
    let library = library.unwrap_or_else(|error| panic!("{name}: {error}"));
    film.check(name, &library);
    library
}

#[test]
fn dimmed_switched_and_flickering_light_is_corrected() {
    let dimmed = |k: usize, _| 1.0 - 0.5 * (k as f64 / 75.0 - 0.5).clamp(0.0, 1.0);
    let library = measured("dimmed", &Staged::plain().with_light(dimmed));
    let told = &library.stats.disturbances;
    let until = disturbance(DisturbanceKind::Light, 0, N_FRAMES - 1).to_s;
    assert!(
        told.iter()
            .any(|one| one.kind == DisturbanceKind::Light && one.to_s == until),
        "{told:?}"
    );
    let switched = |k: usize, _| if (50..110).contains(&k) { 0.4 } else { 1.0 };
    let library = measured("switched", &Staged::plain().with_light(switched));
    let other = disturbance(DisturbanceKind::Light, 50, 109);
    assert_eq!(library.stats.disturbances, [other]);
    let banded = |k: usize, y: usize| 1.0 + 0.08 * (y as f64 / 25.0 + k as f64 * 1.3).sin();
    measured("mains", &Staged::plain().with_light(banded));
}

/// Returns the disturbance from one frame to another.
fn disturbance(kind: DisturbanceKind, first: usize, last: usize) -> Disturbance {
    Disturbance {
        kind,
        from_s: first as f64 / FPS,
        to_s: last as f64 / FPS,
    }
}

#[test]
fn shaking_camera_is_told_with_its_times_and_is_no_mover() {
    let shake = |k: usize| match k {
        100..130 => [5 + 2 * (k as i64 % 3), 4 - 3 * (k as i64 % 2)],
        _ => [0, 0],
    };
    let library = Staged::plain()
        .shifted(shake)
        .analyzed(&Params::default())
        .unwrap();
    let shaken = disturbance(DisturbanceKind::Camera, 100, 129);
    assert_eq!(library.stats.disturbances, [shaken]);
    assert_eq!(library.poses.other_movers, []);
    let advice = stats::advice(&library, &Params::default());
    let sentence = advice
        .iter()
        .find(|advice| advice.code() == "camera_unsteady")
        .unwrap();
    assert!(
        sentence
            .to_string()
            .contains("from 3.3 to 4.3 s: fix the camera"),
        "{sentence}"
    );
}

#[test]
fn bumped_camera_is_followed() {
    measured(
        "bumped",
        &Staged::plain().shifted(|k| if k < 70 { [0, 0] } else { [4, 2] }),
    );
}

#[test]
fn animal_that_rests_for_most_of_the_film_is_found() {
    let rests = (0..N_FRAMES).map(|k| k.max(90)).collect();
    measured("rests first", &Staged::in_order(rests));
    let rests = (0..N_FRAMES).map(|k| (k + 90).min(N_FRAMES - 1)).collect();
    measured("rests last", &Staged::in_order(rests));
}

#[test]
fn foreign_frames_are_left_out_and_counted() {
    let film = Staged::plain().after(15, [0; 3]);
    let library = measured("black lead", &film);
    assert_eq!(library.stats.n_foreign_frames, 15);
    assert_eq!(library.stats.first_foreign_s, Some(0.0));
}

#[test]
fn cable_is_no_part_of_the_animal() {
    let film = Staged::plain();
    let scene = film.scene().clone();
    let film = film.with_drawing(|_, picture, [x, y]| {
        for row in 0..y as u32 {
            let middle = 160.0 + (x - 160.0) * f64::from(row) / y;
            for column in middle as u32 - 1..middle as u32 + 1 {
                // The cable is attached to the far side of the fish, so the fish covers it.
                let (shown, empty) = (picture.pixel(column, row), scene.pixel(column, row));
                let is_fish = (0..3).any(|c| shown[c].abs_diff(empty[c]) > 24);
                if !is_fish {
                    put(picture, [column, row], [35; 3]);
                }
            }
        }
    });
    let library = measured("cable", &film);
    let n_cut = library.poses.frames.iter().filter(|p| p.cut).count();
    assert!(n_cut < N_FRAMES / 10, "cut in {n_cut}");
}

#[test]
fn hand_at_the_start_is_reported_and_not_measured() {
    let film = Staged::plain().with_drawing(|k, picture, _| {
        let down = 150 - (k as i64 - 20).max(0) * 6;
        for y in 0..down.clamp(0, i64::from(HEIGHT)) as u32 {
            for x in 40..90 + y / 10 {
                put(picture, [x, y], [224, 172, 140]);
            }
        }
    });
    let library = film.analyzed(&Params::default()).expect("a library");
    // While the hand covers or touches the fish, the fish cannot be located.
    let poses = &library.poses.frames;
    let far = (0..N_FRAMES).filter(|&k| {
        let truth = film.centroid_px(k).expect("it is shown");
        let off = |found: [f64; 2]| (found[0] - truth[0]).hypot(found[1] - truth[1]);
        poses[k].centroid_px.is_some_and(|found| off(found) > 12.0)
    });
    let far: Vec<usize> = far.collect();
    assert!(far.len() <= 3, "far off in {far:?}");
    let others = &library.poses.other_movers;
    let hand = others.iter().find(|m| m.kind == MoverKind::FromBorder);
    let hand = hand.unwrap_or_else(|| panic!("the hand is not reported: {others:?}"));
    // The hand moves from 0.7 to 1.5 s. Until it has left the place where it rested, it may be part of the background.
    assert!(hand.from_s < 1.2 && hand.to_s < 2.0, "{hand:?}");
}

#[test]
fn mirror_image_in_the_surface_is_no_second_animal() {
    let surface = HEIGHT / 3;
    let film = Staged::plain().with_drawing(|_, picture, _| {
        for y in 0..surface {
            for x in 0..WIDTH {
                let below = picture.pixel(x, 2 * surface - 1 - y);
                put(picture, [x, y], below.map(|v| (f64::from(v) * 0.8) as u8));
            }
        }
    });
    let library = film.analyzed(&Params::default()).expect("a library");
    let off = |k: usize| {
        let (found, truth) = (library.poses.frames[k].centroid_px?, film.centroid_px(k)?);
        Some((found[0] - truth[0]).hypot(found[1] - truth[1]))
    };
    // The truth of the film holds only while the fish is below the surface.
    let below = (0..N_FRAMES).filter(|&k| {
        let y = film.centroid_px(k).map_or(0.0, |c| c[1]);
        y > f64::from(surface) + 25.0
    });
    let (n, n_far) = below.fold((0, 0), |(n, far), k| {
        (
            n + 1,
            far + usize::from(off(k).is_some_and(|off| off > 12.0)),
        )
    });
    assert!(n > N_FRAMES / 2 && n_far <= n / 50, "{n_far} of {n}");
}

/// Returns the code of a refusal and the time in the film that it names, seconds.
fn refused(name: &str, film: &Staged) -> (&'static str, f64) {
    match film.analyzed(&Params::default()) {
        Err(Error::BackgroundNotStatic { at_s, .. }) => ("background_not_static", at_s),
        Err(Error::CameraMoves { at_s }) => ("camera_moved", at_s),
        Err(Error::LightChanges { at_s }) => ("light_changes", at_s),
        Err(Error::SceneChanges { at_s }) => ("scene_changes", at_s),
        Err(error) => panic!("{name}: {error}"),
        Ok(_) => panic!("{name}: measured"),
    }
}

#[test]
fn hand_held_camera_is_refused_as_moving() {
    let sway = |k: usize, rate: f64| (14.0 * (k as f64 * rate).sin()) as i64;
    let film = Staged::plain().shifted(|k| [sway(k, 0.14), sway(k, 0.22)]);
    let (code, at_s) = refused("hand-held", &film);
    assert!(
        ["camera_moved", "background_not_static"].contains(&code),
        "{code}"
    );
    assert!(at_s < N_FRAMES as f64 / FPS / 2.0, "{at_s}");
}
