//! Compares the files of a ground truth with the labels from which they were made.

use serde_json::Value;

use super::*;
use crate::flock::{Compositor, Params, Shot, plan_flock, synthetic};
use crate::formats::picture;
use crate::geometry::Rect;
use crate::library::View;
use crate::parameters::Parameters;
use crate::progress::Silent;

const N_FRAMES: usize = 30;

struct Written {
    flock: Flock,
    truths: Vec<FrameTruth>,
    coco: Value,
    mot: String,
    tracks: String,
}

fn written() -> Written {
    let library = synthetic::library(View::Side);
    let params = Params {
        count: Some(10),
        frames: N_FRAMES as u32,
        ..Params::preset("swarm").expect("a known preset")
    };
    let flock = plan_flock(&library, &params, &Silent).expect("a good library");
    let film = FilmShape {
        size_px: [320, 240],
        n_frames: N_FRAMES,
        fps: 30.0,
    };
    let (mut json, mut mot, mut tracks) = (Vec::new(), Vec::new(), Vec::new());
    let mut coco = coco::Coco::begin(&mut json, &film).unwrap();
    let mut truths = Vec::new();
    let compositor = Compositor::new(&library, &flock).with_truth();
    let mut shot = Shot::default();
    for frame in 0..N_FRAMES {
        compositor.render(frame, &mut shot);
        coco.add(&flock, frame, &shot.truth).unwrap();
        mot::write_frame(&mut mot, &flock, frame, &shot.truth).unwrap();
        tracks::write_frame(&mut tracks, &flock, &film, frame, &shot.truth).unwrap();
        truths.push(shot.truth.clone());
    }
    coco.end().unwrap();
    Written {
        flock,
        truths,
        coco: serde_json::from_slice(&json).unwrap(),
        mot: String::from_utf8(mot).unwrap(),
        tracks: String::from_utf8(tracks).unwrap(),
    }
}

#[test]
fn annotations_match_the_labels() {
    let written = written();
    assert_eq!(written.coco["images"].as_array().unwrap().len(), N_FRAMES);
    let annotations = written.coco["annotations"].as_array().unwrap();
    assert!(annotations.len() > 9 * N_FRAMES, "{}", annotations.len());
    for (k, annotation) in annotations.iter().enumerate() {
        assert_eq!(annotation["id"], k as u64 + 1);
        let frame = annotation["image_id"].as_u64().unwrap() as usize - 1;
        let track = annotation["track_id"].as_u64().unwrap() as usize;
        let text = annotation["segmentation"]["counts"].as_str().unwrap();
        let labels = &written.truths[frame].labels;
        let is_set = |x: u32, y: u32| usize::from(labels[(y * 320 + x) as usize]) == track;
        let counts = rle::counts([320, 240], Rect::of_size(320, 240), is_set);
        assert_eq!(text, rle::text(&counts));
        let individual = &written.flock.individuals[track - 1];
        assert_eq!(annotation["heading_rad"], individual.heading_rad[frame]);
        assert_eq!(
            annotation["centroid_px"][0],
            individual.centroid_px[frame][0]
        );
        assert_eq!(
            annotation["centroid_px"][1],
            individual.centroid_px[frame][1]
        );
        let n_set = labels.iter().filter(|&&label| usize::from(label) == track);
        assert_eq!(annotation["area"], n_set.count());
    }
}

#[test]
fn tracks_have_a_row_for_each_individual_and_frame() {
    let written = written();
    let n_cells = tracks::header().split(',').count();
    let rows: Vec<Vec<&str>> = written
        .tracks
        .lines()
        .map(|l| l.split(',').collect())
        .collect();
    assert_eq!(rows.len(), 10 * N_FRAMES);
    for (k, row) in rows.iter().enumerate() {
        assert_eq!(row.len(), n_cells);
        assert_eq!(row[0], (k / 10).to_string());
        assert_eq!(row[2], (k % 10).to_string());
        let individual = &written.flock.individuals[k % 10];
        let [x, y] = individual.centroid_px[k / 10];
        assert_eq!([row[3], row[4]], [x.to_string(), y.to_string()]);
    }
}

#[test]
fn mot_lines_count_from_one_and_have_amodal_boxes() {
    let written = written();
    let mut n_lines = 0;
    for line in written.mot.lines() {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let (frame, id) = (cells[0] as usize - 1, cells[1] as usize - 1);
        let seen = &written.truths[frame].seen[id];
        let [x, y, w, h] = seen.amodal_box.unwrap().map(|edge| edge as f64);
        assert_eq!(cells[2..6], [x + 1.0, y + 1.0, w, h]);
        assert_eq!(cells[6..8], [1.0, 1.0]);
        assert!((cells[8] - seen.visibility).abs() <= 5e-5);
        n_lines += 1;
    }
    assert_eq!(n_lines, 10 * N_FRAMES);
}

#[test]
fn label_picture_keeps_ids_above_255() {
    let labels: Vec<u16> = vec![0, 1, 255, 256, 2000, 65535];
    let bytes = picture::write_labels(3, 2, &labels);
    let decoder = png::Decoder::new(std::io::Cursor::new(&bytes));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; 12];
    reader.next_frame(&mut pixels).unwrap();
    let back: Vec<u16> = (pixels
        .chunks_exact(2)
        .map(|b| u16::from_be_bytes([b[0], b[1]])))
    .collect();
    assert_eq!(back, labels);
}
