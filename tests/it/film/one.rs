//! A flock of one that repeats the path of the filmed animal without a jump must reproduce the footage
//! (docs/explanation/algorithms.md, "Compositing"). The mean absolute error in the animal's box is below 0.8
//! of 255 levels over the film, and below 1.5 in every frame. It includes the errors of chroma subsampling,
//! matte and background; the film has no noise. One interpolation too many gives an error of 1.6.

use flockreel_core::flock::lens::Lens;
use flockreel_core::flock::{
    BoidTrack, Compositor, Flock, Individual, Params, PlanCost, Shot, Space, Stats,
};
use flockreel_core::footage::FrameSource;
use flockreel_core::library::Library;
use flockreel_core::raster::{Frame, RgbImage};

use super::sample::filmed_without_noise;

#[test]
fn flock_of_one_along_the_filmed_path_is_the_footage() {
    let (film, library, _) = filmed_without_noise();
    let (first, n_frames) = longest_run(library);
    assert!(n_frames > 100, "{n_frames}");
    let flock = along_its_own_path(library, first, n_frames);
    let compositor = Compositor::new(library, &flock).with_truth();
    let (mut stream, mut frame) = (film.open().unwrap(), Frame::default());
    let (mut shot, mut errors) = (Shot::default(), Vec::new());
    for frame_idx in 0..first + n_frames {
        stream.next_frame(&mut frame).unwrap().expect("a frame");
        let Some(t) = frame_idx.checked_sub(first) else {
            continue;
        };
        compositor.render(t, &mut shot);
        let error = error_in_box(library, frame_idx, &shot.frame.to_rgb(), &frame.to_rgb());
        assert!(error < 1.5, "frame {frame_idx}: {error}");
        errors.push(error);
        let seen = &shot.truth.seen[0];
        let [x, y, w, h] = seen.amodal_box.unwrap();
        let known = library.poses.frames[frame_idx].box_px.unwrap();
        // The box of the silhouette includes faint pixels, so the amodal box lies inside it, within 2 px.
        let known = [known.x, known.y, known.right(), known.bottom()].map(i64::from);
        let inside = x >= known[0] - 2 && y >= known[1] - 2;
        let inside = inside && x + w <= known[2] + 2 && y + h <= known[3] + 2;
        assert!(inside, "frame {frame_idx}: {:?} {known:?}", seen.amodal_box);
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(mean < 0.8, "{mean}");
}

/// Returns the longest run of whole sprites: its first frame and its number of frames.
fn longest_run(library: &Library) -> (usize, usize) {
    let mut best = (0, 0);
    let mut first = 0;
    for (idx, pose) in library.poses.frames.iter().enumerate() {
        if !library.sprites.is_present(idx) || pose.cut {
            first = idx + 1;
        } else if idx + 1 - first > best.1 {
            best = (first, idx + 1 - first);
        }
    }
    best
}

fn along_its_own_path(library: &Library, first: usize, n_frames: usize) -> Flock {
    let poses = &library.poses.frames[first..first + n_frames];
    let individual = Individual {
        size: 1.0,
        state: Vec::new(),
        carried: Vec::new(),
        forward: None,
        id: 0,
        source_frame: (first as u32..(first + n_frames) as u32).collect(),
        mirrored: vec![false; n_frames],
        rotation_rad: vec![0.0; n_frames],
        continues_as: None,
        fades: Vec::new(),
        centroid_px: poses.iter().map(|pose| pose.centroid_px.unwrap()).collect(),
        heading_rad: poses
            .iter()
            .map(|pose| pose.heading_rad.unwrap_or(0.0))
            .collect(),
        scale: vec![1.0; n_frames],
        depth_m: None,
        boid: BoidTrack {
            forward: None,
            position_px: vec![[0.0; 3]; n_frames],
            heading_rad: vec![0.0; n_frames],
            speed_bl_per_s: vec![0.0; n_frames],
        },
        cost: PlanCost::default(),
    };
    Flock {
        predator_px: Vec::new(),
        fps: library.poses.fps,
        image_size_px: library.poses.image_size_px,
        length_px: 50.0,
        space: Space {
            lens: Lens::flat(50.0),
            front_bl: 0.0,
            up: [0.0, 0.0, 1.0],
            walls: Vec::new(),
        },
        params: Params {
            count: Some(1),
            frames: n_frames as u32,
            ..Params::default()
        },
        individuals: vec![individual],
        orders: Vec::new(),
        stats: Stats::default(),
    }
}

/// Returns the mean absolute difference over the animal's box and the channels, levels of 255.
fn error_in_box(library: &Library, frame_idx: usize, drawn: &RgbImage, seen: &RgbImage) -> f64 {
    let rect = library.poses.frames[frame_idx].box_px.unwrap();
    let (mut sum, mut n) = (0u32, 0u32);
    for y in rect.y..rect.bottom() {
        for x in rect.x..rect.right() {
            for (a, b) in drawn.pixel(x, y).iter().zip(seen.pixel(x, y)) {
                sum += u32::from(a.abs_diff(b));
                n += 1;
            }
        }
    }
    f64::from(sum) / f64::from(n)
}
