//! Tests of the compositor: sprites appear without boxes around them, and frames depend neither on threads
//! nor on their order.

use super::params::Cut;
use super::*;
use crate::flock::Fade;
use crate::flock::synthetic;
use crate::flock::{Params, plan_flock};
use crate::library::View;
use crate::parameters::Parameters;
use crate::progress::Silent;
use crate::raster::RgbaImage;

/// Prepares nothing: no frame has a background of its own.
fn unprepared<E>(_: usize, _: &mut Shot) -> Result<(), E> {
    Ok(())
}

fn flock(library: &Library, name: &str) -> Flock {
    let params = Params {
        count: Some(8),
        frames: 40,
        ..Params::preset(name).expect("a known preset")
    };
    plan_flock(library, &params, &Silent).expect("a good library")
}

#[test]
fn frames_are_equal_in_any_order_of_drawing() {
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
fn error_of_the_sink_is_returned() {
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
fn skipping_hidden_parts_changes_no_pixel() {
    for (view, haze_per_bl, size_px) in
        [(View::Side, 0.0, None), (View::Top, 0.2, Some([900, 700]))]
    {
        let library = synthetic::library(view);
        let mut flock = flock(&library, "swarm");
        flock.params.render.size_px = size_px;
        flock.params.render.haze_per_bl = haze_per_bl;
        let film = Compositor::new(&library, &flock);
        let mut shot = Shot::default();
        for (idx, whole) in shots(&library, &flock).iter().enumerate() {
            film.render(idx, &mut shot);
            assert!(shot.frame == whole.frame, "frame {idx}");
        }
    }
}

#[test]
fn pixels_without_animals_equal_the_background() {
    let library = synthetic::library(View::Top);
    let flock = flock(&library, "swarm");
    let film = Compositor::new(&library, &flock);
    let (mut shot, mut empty) = (Shot::default(), Shot::default());
    film.render(17, &mut shot);
    film.backdrop.reset(&mut empty);
    let (frame, background) = (shot.frame, empty.frame);
    let half = f64::from(library.sprites.width()) / 2.0 * std::f64::consts::SQRT_2 + 3.0;
    let width = frame.width as usize;
    for (k, (drawn, behind)) in frame.luma().iter().zip(background.luma()).enumerate() {
        let (x, y) = ((k % width) as f64, (k / width) as f64);
        let near = flock.individuals.iter().any(|individual| {
            let [cx, cy] = individual.centroid_px[17];
            (x - cx).hypot(y - cy) < half
        });
        assert!(near || drawn == behind, "{x} {y}");
    }
}

/// Returns the synthetic library with a red wire in front of the animals. The wire is three rows high, and
/// its middle row is opaque.
fn behind_a_wire(row: u32) -> Library {
    let mut library = synthetic::library(View::Top);
    let [width, height] = library.poses.image_size_px;
    let mut wire = RgbaImage::new(width, height);
    for x in 0..width {
        for (y, alpha) in [(row - 1, 128), (row, 255), (row + 1, 128)] {
            wire.set_pixel(x, y, [200, 30, 30, alpha]);
            let behind = library.background.pixel(x, y);
            let share = f64::from(alpha) / 255.0;
            let mixed = |own, behind| share * f64::from(own) + (1.0 - share) * f64::from(behind);
            let shown = [0, 1, 2].map(|c| mixed([200, 30, 30][c], behind[c]) as u8);
            library.background.set_pixel(x, y, shown);
        }
    }
    library.occluders = Some(wire);
    library
}

#[test]
fn occluders_are_drawn_only_with_the_filmed_background() {
    const ROW: usize = 160;
    let library = behind_a_wire(ROW as u32);
    // The flock is made from the library without the wire, so that animals swim behind the wire.
    let mut flock = flock(&synthetic::library(View::Top), "swarm");
    let width = library.background.width as usize;
    let row = ROW * width..(ROW + 1) * width;
    let passes = |truth: &FrameTruth| {
        let of = |row: usize| &truth.labels[row * width..][..width];
        let (above, below) = (of(ROW - 2), of(ROW + 2));
        (above.iter().zip(below)).any(|(a, b)| *a > 0 && a == b)
    };
    let mut n_passing = 0;
    for shot in shots(&library, &flock) {
        assert!(
            shot.truth.labels[row.clone()]
                .iter()
                .all(|&label| label == 0)
        );
        n_passing += usize::from(passes(&shot.truth));
        for rgb in shot.frame.to_rgb().pixels[3 * row.start..3 * row.end].chunks(3) {
            // Chroma is subsampled, so neighboring rows change the color of the wire.
            assert!(rgb[0] > rgb[1].saturating_add(60), "{rgb:?}");
        }
    }
    assert!(n_passing > 5, "{n_passing}");
    flock.params.render.background = Background::Color([0, 0, 255]);
    let has_label = |shot: &Shot| {
        shot.truth.labels[row.clone()]
            .iter()
            .any(|&label| label > 0)
    };
    assert!(
        shots(&library, &flock)
            .iter()
            .filter(|shot| has_label(shot))
            .count()
            >= n_passing
    );
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

/// Returns every frame of a flock with its ground truth.
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
fn labels_match_the_drawn_pixels() {
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
fn ground_truth_positions_equal_those_of_the_flock() {
    for view in [View::Side, View::Top] {
        let library = synthetic::library(view);
        let flock = flock(&library, "school");
        for (t, shot) in shots(&library, &flock).iter().enumerate() {
            assert_eq!(shot.truth.seen.len(), 8);
            for (individual, seen) in flock.individuals.iter().zip(&shot.truth.seen) {
                assert_eq!(seen.centroid_px, individual.centroid_px[t]);
                let [x, y, w, h] = seen
                    .amodal_box
                    .expect("all individuals are drawn")
                    .map(|v| v as f64);
                let [cx, cy] = seen.centroid_px;
                assert!((x..x + w).contains(&cx) && (y..y + h).contains(&cy));
                // The long side of the box lies along the heading.
                let heading = individual.heading_rad[t];
                let across = libm::cos(heading).abs() > 0.9 && view == View::Top;
                assert!(!across || w > h, "{w} {h} at {heading}");
            }
        }
    }
}

#[test]
fn animal_half_outside_of_the_picture_has_its_full_extent() {
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
fn ground_truth_scales_with_the_film() {
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

#[test]
fn shadow_and_haze_change_the_picture_but_not_the_ground_truth() {
    for view in [View::Side, View::Top] {
        let library = synthetic::library(view);
        let mut flock = flock(&library, "school");
        let plain = shots(&library, &flock);
        flock.params.render.shadow = Some(0.6);
        flock.params.render.haze_per_bl = 0.3;
        for individual in &mut flock.individuals {
            for place in &mut individual.boid.position_px {
                place[2] += 40.0;
            }
        }
        let other = shots(&library, &flock);
        let darker = |a: &Shot, b: &Shot| {
            let pairs = a.frame.luma().iter().zip(b.frame.luma());
            pairs.filter(|(a, b)| **b + 10 < **a).count()
        };
        for (plain, other) in plain.iter().zip(&other) {
            assert!(
                plain.truth.labels == other.truth.labels && plain.truth.seen == other.truth.seen
            );
            assert!(
                plain.truth.shadow.is_empty() && other.truth.shadow.iter().any(|&share| share > 80)
            );
            assert!(darker(plain, other) > 300);
        }
    }
}

#[test]
fn transparent_film_over_the_background_equals_the_film() {
    let library = synthetic::library(View::Side);
    let mut flock = flock(&library, "swarm");
    flock.params.render.background = Background::Transparent;
    let (mut opaque, mut clear) = (Shot::default(), Shot::default());
    Compositor::new(&library, &flock).render(11, &mut opaque);
    Compositor::new(&library, &flock)
        .straight()
        .render(11, &mut clear);
    let film = opaque.frame.to_rgb();
    let (mut error, mut n_clear) = (0u64, 0);
    for (k, rgba) in clear.rgba.chunks_exact(4).enumerate() {
        n_clear += usize::from(rgba[3] == 0);
        for channel in 0..3 {
            let behind = u32::from(library.background.pixels[3 * k + channel]);
            let alpha = u32::from(rgba[3]);
            let shown = (u32::from(rgba[channel]) * alpha + behind * (255 - alpha)) / 255;
            error += u64::from((shown as u8).abs_diff(film.pixels[3 * k + channel]));
        }
    }
    assert!(n_clear > 320 * 240 / 2, "{n_clear}");
    // The only difference is the subsampled chroma of the planes.
    let mean = error as f64 / (3.0 * 320.0 * 240.0);
    assert!(mean < 2.0, "{mean}");
}

#[test]
fn background_of_a_frame_is_drawn_behind_the_animals() {
    let library = synthetic::library(View::Top);
    let flock = flock(&library, "school");
    let mut behind = Frame::new(64, 48, ColorSpec::default());
    behind.planes.fill(128);
    let mut shot = Shot {
        behind,
        ..Shot::default()
    };
    let film = Compositor::new(&library, &flock).with_truth();
    film.render(9, &mut shot);
    let n_gray = (shot.frame.luma().iter().zip(&shot.truth.labels))
        .filter(|(luma, label)| **label == 0 && luma.abs_diff(128) <= 1)
        .count();
    assert!(n_gray > 320 * 240 / 2, "{n_gray}");
    // Without its own background, a frame shows the background of the film.
    let mut plain = Shot::default();
    film.render(9, &mut plain);
    let mut fresh = Shot::default();
    Compositor::new(&library, &flock).render(9, &mut fresh);
    assert!(plain.frame == fresh.frame);
}

#[test]
fn morph_changes_only_pixels_of_a_fade() {
    let library = synthetic::library(View::Side);
    let mut flock = flock(&library, "swarm");
    let faded = shots(&library, &flock);
    flock.params.render.cut = Cut::Morph;
    let warped = shots(&library, &flock);
    let mut n_other = 0;
    for (t, (a, b)) in faded.iter().zip(&warped).enumerate() {
        let at = t as u32;
        let during =
            |fade: &Fade| (fade.start..fade.start + fade.weight.len() as u32).contains(&at);
        let is_fading = (flock.individuals.iter()).any(|one| one.fades.iter().any(during));
        assert!(is_fading || a.frame == b.frame, "frame {t}");
        n_other += usize::from(a.frame != b.frame);
        for (a, b) in a.truth.seen.iter().zip(&b.truth.seen) {
            assert!(a.amodal_area.abs_diff(b.amodal_area) < a.amodal_area / 4 + 8);
        }
    }
    assert!(n_other > 0, "no jump was bridged");
}
