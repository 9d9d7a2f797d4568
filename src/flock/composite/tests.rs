//! What the film shows: whole sprites as they are, no boxes, the same from any thread.

use super::*;
use crate::flock::synthetic;
use crate::flock::{Params, plan_flock};
use crate::library::View;
use crate::progress::Silent;

/// Nothing lies behind one frame alone.
fn unprepared<E>(_: usize, _: &mut Shot) -> Result<(), E> {
    Ok(())
}

fn flock(library: &Library, name: &str) -> Flock {
    let params = Params {
        count: 8,
        frames: 40,
        ..Params::preset(name).expect("a known preset")
    };
    plan_flock(library, &params, &Silent).expect("a good library")
}

#[test]
fn frames_in_any_order_are_those_of_the_film() {
    let library = synthetic::library(View::Side);
    let flock = flock(&library, "school");
    let film = Compositor::new(&library, &flock);
    let mut frames = Vec::new();
    film.render_all(unprepared, |idx, shot: &Shot| {
        assert_eq!(idx, frames.len());
        frames.push(shot.frame.clone());
        Ok::<(), ()>(())
    })
    .unwrap();
    assert_eq!(frames.len(), 40);
    let fresh = Compositor::new(&library, &flock);
    let mut shot = Shot::default();
    for idx in (0..40).rev().step_by(7) {
        fresh.render(idx, &mut shot);
        assert!(shot.frame == frames[idx], "frame {idx}");
    }
}

#[test]
fn the_error_of_whoever_takes_the_frames_comes_back() {
    let library = synthetic::library(View::Top);
    let flock = flock(&library, "school");
    let film = Compositor::new(&library, &flock);
    let taken = film.render_all(
        unprepared,
        |idx, _| if idx == 5 { Err("full") } else { Ok(()) },
    );
    assert_eq!(taken, Err("full"));
}

#[test]
fn nothing_changes_where_nobody_is() {
    let library = synthetic::library(View::Top);
    let flock = flock(&library, "swarm");
    let film = Compositor::new(&library, &flock);
    let (mut shot, mut empty) = (Shot::default(), Shot::default());
    film.render(17, &mut shot);
    film.backdrop.begin(&mut empty);
    let (frame, plate) = (shot.frame, empty.frame);
    let half = f64::from(library.sprites.width()) / 2.0 * std::f64::consts::SQRT_2 + 3.0;
    let width = frame.width as usize;
    for (k, (drawn, plate)) in frame.luma().iter().zip(plate.luma()).enumerate() {
        let (x, y) = ((k % width) as f64, (k / width) as f64);
        let near = flock.individuals.iter().any(|individual| {
            let [cx, cy] = individual.centroid_px[17];
            (x - cx).hypot(y - cy) < half
        });
        assert!(near || drawn == plate, "{x} {y}");
    }
}

#[test]
fn overlapping_boxes_are_merged_and_those_apart_kept() {
    let rect = |x, y| Rect { x, y, w: 10, h: 10 };
    let mut rects = vec![rect(0, 0), rect(40, 40), rect(2, 1)];
    merge_overlapping(&mut rects);
    assert_eq!(
        rects,
        [
            Rect {
                x: 0,
                y: 0,
                w: 12,
                h: 11
            },
            rect(40, 40)
        ]
    );
}

/// Every frame of a flock with its ground truth.
fn shots(library: &Library, flock: &Flock) -> Vec<Shot> {
    let film = Compositor::new(library, flock).with_truth();
    let mut shots = Vec::new();
    film.render_all(unprepared, |_, shot: &Shot| {
        shots.push(shot.clone());
        Ok::<(), ()>(())
    })
    .unwrap();
    shots
}

#[test]
fn labels_lie_on_what_is_drawn_and_what_is_drawn_opaque_has_one() {
    for view in [View::Side, View::Top] {
        let library = synthetic::library(view);
        let mut flock = flock(&library, "swarm");
        // The synthetic animal is far darker than white.
        flock.params.render.background = Background::Color([255; 3]);
        let mut n_labels = 0;
        for shot in shots(&library, &flock) {
            for (drawn, label) in shot.frame.luma().iter().zip(&shot.truth.labels) {
                n_labels += usize::from(*label > 0);
                assert!(*label == 0 || *drawn < 215, "{label} {drawn}");
                assert!(*label > 0 || *drawn > 65, "{drawn}");
            }
        }
        assert!(n_labels > 40 * 8 * 100, "{n_labels}");
    }
}

#[test]
fn the_truth_is_where_flock_json_says() {
    for view in [View::Side, View::Top] {
        let library = synthetic::library(view);
        let flock = flock(&library, "school");
        for (t, shot) in shots(&library, &flock).iter().enumerate() {
            assert_eq!(shot.truth.seen.len(), 8);
            for (individual, seen) in flock.individuals.iter().zip(&shot.truth.seen) {
                assert_eq!(seen.centroid_px, individual.centroid_px[t]);
                let [x, y, w, h] = seen
                    .amodal_box
                    .expect("everybody is drawn")
                    .map(|v| v as f64);
                let [cx, cy] = seen.centroid_px;
                assert!((x..x + w).contains(&cx) && (y..y + h).contains(&cy));
                // The long way of the box is that of the heading.
                let heading = individual.heading_rad[t];
                let across = libm::cos(heading).abs() > 0.9 && view == View::Top;
                assert!(!across || w > h, "{w} {h} at {heading}");
            }
        }
    }
}

#[test]
fn an_animal_half_out_of_the_picture_is_told_whole_and_half_visible() {
    let library = synthetic::library(View::Top);
    let mut flock = flock(&library, "school");
    flock.individuals.truncate(1);
    let free = &shots(&library, &flock)[20].truth.seen[0];
    let area = free.amodal_area;
    assert!(free.visibility > 0.999 && free.amodal_area == free.visible_area);
    for (axis, edge) in [(0, 0.0), (0, 320.0), (1, 0.0), (1, 240.0)] {
        flock.individuals[0].centroid_px[20][axis] = edge;
        let seen = &shots(&library, &flock)[20].truth.seen[0];
        assert!(
            (0.2..0.8).contains(&seen.visibility),
            "{edge}: {}",
            seen.visibility
        );
        let share = f64::from(seen.amodal_area) / f64::from(area);
        assert!((share - 1.0).abs() < 0.05, "{edge}: {share}");
        let [x, y, w, h] = seen.amodal_box.expect("it is drawn");
        let (least, most) = ([x, y][axis], [x + w, y + h][axis]);
        assert!(least < edge as i64 && most > edge as i64, "{least} {most}");
        flock.individuals[0].centroid_px[20] = [160.0, 120.0];
    }
}

#[test]
fn at_another_size_the_truth_is_the_same_but_larger() {
    let library = synthetic::library(View::Side);
    let mut flock = flock(&library, "school");
    let small = shots(&library, &flock);
    flock.params.render.size_px = Some([640, 480]);
    let large = shots(&library, &flock);
    for (small, large) in small.iter().zip(&large) {
        assert_eq!((large.frame.width, large.frame.height), (640, 480));
        for (a, b) in small.truth.seen.iter().zip(&large.truth.seen) {
            assert_eq!(a.centroid_px.map(|px| 2.0 * px), b.centroid_px);
            let ratio = f64::from(b.amodal_area) / f64::from(a.amodal_area);
            assert!((ratio - 4.0).abs() < 0.4, "{ratio}");
        }
    }
}
