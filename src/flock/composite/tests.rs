//! What the film shows: whole sprites as they are, no boxes, the same from any thread.

use super::*;
use crate::flock::synthetic;
use crate::flock::{Params, plan_flock};
use crate::library::View;
use crate::progress::Silent;

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
    film.render_all(|idx, frame: &Frame| {
        assert_eq!(idx, frames.len());
        frames.push(frame.clone());
        Ok::<(), ()>(())
    })
    .unwrap();
    assert_eq!(frames.len(), 40);
    let fresh = Compositor::new(&library, &flock);
    let mut frame = Frame::default();
    for idx in (0..40).rev().step_by(7) {
        fresh.render(idx, &mut frame);
        assert!(frame == frames[idx], "frame {idx}");
    }
}

#[test]
fn the_error_of_whoever_takes_the_frames_comes_back() {
    let library = synthetic::library(View::Top);
    let flock = flock(&library, "school");
    let film = Compositor::new(&library, &flock);
    let taken = film.render_all(|idx, _| if idx == 5 { Err("full") } else { Ok(()) });
    assert_eq!(taken, Err("full"));
}

#[test]
fn nothing_changes_where_nobody_is() {
    let library = synthetic::library(View::Top);
    let flock = flock(&library, "swarm");
    let film = Compositor::new(&library, &flock);
    let mut frame = Frame::default();
    film.render(17, &mut frame);
    let half = f64::from(library.sprites.width()) / 2.0 * std::f64::consts::SQRT_2 + 3.0;
    let width = frame.width as usize;
    for (k, (drawn, plate)) in frame.luma().iter().zip(film.plate.luma()).enumerate() {
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
