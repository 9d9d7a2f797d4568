//! Tests the reasons to refuse footage on films drawn here, and films that come close to one but are accepted
//! (docs/explanation/algorithms.md, "Refused footage").

use std::sync::Arc;

mod still_parts;

use crate::analysis::params::{AnimalAtParam, CutSprites, Follow};
use crate::analysis::{Error, Params, analyze, preview};
use crate::code::Code;
use crate::cpu::Level;
use crate::footage::{FootageFormat, FrameSource, FrameStream, SourceError};
use crate::geometry::Rect;
use crate::library::Library;
use crate::progress::Silent;
use crate::random;
use crate::raster::{ColorSpec, Frame};
use crate::scratch::{InMemory, Scratch};

const WIDTH: u32 = 192;
const HEIGHT: u32 = 144;

/// A dark disc in front of the scene: an animal or another object.
#[derive(Clone, Copy)]
struct Disc {
    center_px: [f64; 2],
    radius_px: f64,
}

/// The content of one frame.
struct Picture {
    /// Displacement of the camera, pixels.
    camera_px: [f64; 2],
    /// Brightness of the light as a factor; 1 is normal.
    light: f64,
    /// Blue in the light, levels of U above gray.
    blue: u8,
    discs: Vec<Disc>,
    /// From the discs to the hard shadows that they cast on the wall, pixels.
    shadows_px: Option<[f64; 2]>,
}

impl Picture {
    fn with_discs(discs: Vec<Disc>) -> Picture {
        Picture {
            camera_px: [0.0; 2],
            light: 1.0,
            blue: 0,
            discs,
            shadows_px: None,
        }
    }
}

/// A film drawn frame by frame, with a little noise.
struct Film<F> {
    n_frames: usize,
    picture: F,
}

impl<F: Fn(usize) -> Picture + Send + Sync> FrameSource for Film<F> {
    fn format(&self) -> FootageFormat {
        FootageFormat {
            width: WIDTH,
            height: HEIGHT,
            fps: 30.0,
            n_frames_hint: self.n_frames,
            color: ColorSpec::default(),
        }
    }

    fn open(&self) -> Result<Box<dyn FrameStream + '_>, SourceError> {
        Ok(Box::new(Reel {
            film: self,
            frame_idx: 0,
        }))
    }
}

struct Reel<'a, F> {
    film: &'a Film<F>,
    frame_idx: usize,
}

impl<F: Fn(usize) -> Picture> FrameStream for Reel<'_, F> {
    fn next_frame(&mut self, frame: &mut Frame) -> Result<Option<f64>, SourceError> {
        if self.frame_idx == self.film.n_frames {
            return Ok(None);
        }
        *frame = drawn(&(self.film.picture)(self.frame_idx), self.frame_idx as u64);
        self.frame_idx += 1;
        Ok(Some((self.frame_idx - 1) as f64 / 30.0))
    }
}

/// Draws a wall of gray stones, six pixels wide with soft edges, and the discs in front of it.
fn drawn(picture: &Picture, noise_key: u64) -> Frame {
    let mut frame = Frame::new(WIDTH, HEIGHT, ColorSpec::default());
    frame.planes.fill(128);
    let u = (WIDTH * HEIGHT) as usize..(WIDTH * HEIGHT * 5 / 4) as usize;
    frame.planes[u].fill(128 + picture.blue);
    let stone = |x: i64, y: i64| 130.0 + 60.0 * random::uniform(6, &[x as u64, y as u64]);
    let wall = |x: f64, y: f64| {
        let (x, y) = (x / 6.0 + 1000.0, y / 6.0 + 1000.0);
        let (fx, fy) = (x.fract(), y.fract());
        let (x, y) = (x as i64, y as i64);
        let row = |y: i64| stone(x, y) * (1.0 - fx) + stone(x + 1, y) * fx;
        row(y) * (1.0 - fy) + row(y + 1) * fy
    };
    for at in 0..(WIDTH * HEIGHT) as usize {
        let (x, y) = (
            (at as u32 % WIDTH) as f64 + 0.5,
            (at as u32 / WIDTH) as f64 + 0.5,
        );
        let is_disc = |x: f64, y: f64| {
            let inside =
                |d: &Disc| libm::hypot(x - d.center_px[0], y - d.center_px[1]) < d.radius_px;
            picture.discs.iter().any(inside)
        };
        let [dx, dy] = picture.camera_px;
        let in_shadow = picture
            .shadows_px
            .is_some_and(|[dx, dy]| is_disc(x - dx, y - dy));
        let level = match (is_disc(x, y), in_shadow) {
            (true, _) => 40.0,
            (false, true) => 0.5 * wall(x + dx, y + dy),
            (false, false) => wall(x + dx, y + dy),
        };
        let noise = random::normal(8, &[noise_key, at as u64]);
        frame.planes[at] = (level * picture.light + noise).clamp(16.0, 235.0) as u8;
    }
    frame
}

fn analyzed(
    n_frames: usize,
    params: &Params,
    picture: impl Fn(usize) -> Picture + Send + Sync,
) -> Result<Library, Error> {
    let film = Film { n_frames, picture };
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    analyze(&film, None, params, Level::detect(), &scratch, &Silent)
}

/// Returns the reason for which the film is refused. Panics if it is accepted.
fn refusal(n_frames: usize, picture: impl Fn(usize) -> Picture + Send + Sync) -> (Code, String) {
    match analyzed(n_frames, &Params::default(), picture) {
        Ok(_) => panic!("the film was accepted"),
        Err(error) => (error.code(), error.to_string()),
    }
}

/// Returns a disc that circles the middle of the picture.
fn swimmer(frame_idx: usize, turn: f64, radius_px: f64) -> Disc {
    let angle = frame_idx as f64 * 0.13 + turn;
    Disc {
        center_px: [
            96.0 + 60.0 * libm::cos(angle),
            72.0 + 45.0 * libm::sin(angle),
        ],
        radius_px,
    }
}

#[test]
fn still_footage_is_refused() {
    let (code, sentence) = refusal(40, |_| Picture::with_discs(vec![]));
    assert_eq!(code, Code::NothingMoves, "{sentence}");
}

#[test]
fn trembling_camera_is_refused() {
    let (code, sentence) = refusal(40, |k| Picture {
        camera_px: [
            random::uniform(1, &[k as u64]) * 6.0,
            random::uniform(2, &[k as u64]) * 6.0,
        ],
        ..Picture::with_discs(vec![swimmer(k, 0.0, 9.0)])
    });
    assert_eq!(code, Code::BackgroundNotStatic, "{sentence}");
}

#[test]
fn slowly_panning_camera_is_refused() {
    let (code, sentence) = refusal(40, |k| Picture {
        camera_px: [0.2 * k as f64, 0.0],
        ..Picture::with_discs(vec![swimmer(k, 0.0, 9.0)])
    });
    assert_eq!(code, Code::BackgroundNotStatic, "{sentence}");
}

#[test]
fn changing_light_is_accepted() {
    let library = analyzed(60, &Params::default(), |k| Picture {
        light: 1.0 + 0.15 * libm::sin(k as f64 * 0.3),
        ..Picture::with_discs(vec![swimmer(k, 0.0, 9.0)])
    });
    assert_eq!(
        library.expect("the camera stands still").stats.n_detected,
        60
    );
}

#[test]
fn light_that_turns_blue_again_and_again_is_named() {
    let (code, sentence) = refusal(90, |k| Picture {
        blue: if k / 20 % 2 == 1 { 13 } else { 0 },
        ..Picture::with_discs(vec![swimmer(k, 0.0, 9.0)])
    });
    assert_eq!(code, Code::LightChanges, "{sentence}");
    assert!(sentence.contains("from 0.7 s on"), "{sentence}");
}

#[test]
fn object_that_blinks_at_one_place_is_no_second_animal() {
    let blinking = Disc {
        center_px: [160.0, 20.0],
        radius_px: 7.0,
    };
    let library = analyzed(60, &Params::default(), |k| {
        let mut discs = vec![swimmer(k, 0.0, 9.0)];
        discs.extend((k % 5 < 2).then_some(blinking));
        Picture::with_discs(discs)
    });
    let library = library.expect("one animal swims");
    for (k, pose) in library.poses.frames.iter().enumerate() {
        let (found, animal) = (pose.centroid_px.unwrap(), swimmer(k, 0.0, 9.0).center_px);
        assert!((found[0] - animal[0]).hypot(found[1] - animal[1]) < 2.0);
    }
}

#[test]
fn two_animals_are_refused_unless_the_largest_is_followed() {
    let two = |k: usize| Picture::with_discs(vec![swimmer(k, 0.0, 10.0), swimmer(k, 3.1, 8.0)]);
    let (code, sentence) = refusal(60, two);
    assert_eq!(code, Code::SeveralAnimals, "{sentence}");
    let params = Params {
        follow: Follow::Largest,
        ..Params::default()
    };
    let library = analyzed(60, &params, two).expect("the largest is followed");
    assert!(library.stats.several_animals);
    for (k, pose) in library.poses.frames.iter().enumerate() {
        let (found, largest) = (pose.centroid_px.unwrap(), swimmer(k, 0.0, 10.0).center_px);
        assert!((found[0] - largest[0]).hypot(found[1] - largest[1]) < 2.0);
    }
}

#[test]
fn tiny_animal_has_sprites_only_on_request() {
    let tiny = |k: usize| Picture::with_discs(vec![swimmer(k, 0.0, 2.4)]);
    let library = analyzed(60, &Params::default(), tiny).expect("it can be tracked");
    assert!(library.stats.animal_too_small && library.stats.n_detected > 50);
    assert!((0..60).all(|k| !library.sprites.is_present(k)));
    assert!(library.playback.component.is_empty());
    let params = Params {
        sprites: CutSprites::Always,
        ..Params::default()
    };
    let library = analyzed(60, &params, tiny).expect("sprites were asked for");
    assert!(!library.stats.animal_too_small);
    assert!((20..60).any(|k| library.sprites.is_present(k)));
}

#[test]
fn object_far_larger_than_the_animal_is_not_followed() {
    let shadow = Disc {
        center_px: [90.0, 70.0],
        radius_px: 55.0,
    };
    let picture = |k: usize| {
        let shown = if k < 3 { shadow } else { swimmer(k, 0.0, 8.0) };
        Picture::with_discs(vec![shown])
    };
    let library = analyzed(60, &Params::default(), picture).expect("it can be tracked");
    let found = |k: usize| library.poses.frames[k].detected();
    assert!((0..3).all(|k| !found(k)) && (10..60).all(found));
}

#[test]
fn film_of_a_few_frames_is_refused() {
    let (code, sentence) = refusal(12, |k| Picture::with_discs(vec![swimmer(k, 0.0, 9.0)]));
    assert_eq!(code, Code::TooFewFrames);
    assert_eq!(
        sentence,
        "the footage has 12 frames to measure, but at least 16 are needed"
    );
}

#[test]
fn hard_shadow_on_the_wall_is_no_part_of_the_animal() {
    let library = analyzed(60, &Params::default(), |k| Picture {
        shadows_px: Some([13.0, 5.0]),
        ..Picture::with_discs(vec![swimmer(k, 0.0, 10.0)])
    });
    let library = library.expect("one animal swims");
    for (k, pose) in library.poses.frames.iter().enumerate() {
        let (found, animal) = (pose.centroid_px.unwrap(), swimmer(k, 0.0, 10.0).center_px);
        let off_px = libm::hypot(found[0] - animal[0], found[1] - animal[1]);
        assert!(off_px < 1.5, "frame {k}: {off_px} px");
    }
}

#[test]
fn preview_is_in_frames_and_pixels_of_the_film() {
    // The film has twice the size of the frames that are read.
    let picture = |k: usize| Picture::with_discs(vec![swimmer(k, 0.0, 10.0), swimmer(k, 3.1, 8.0)]);
    let film = Film {
        n_frames: 90,
        picture,
    };
    let mut params = Params {
        from_s: Some(1.0),
        ..Params::default()
    };
    let refused = preview(&film, 0.5, None, &params, &Silent).unwrap().refused;
    let Some(Error::SeveralAnimals { frame, boxes_px }) = refused else {
        panic!("{refused:?}");
    };
    for (turn, radius_px) in [(0.0, 10.0), (3.1, 8.0)] {
        let center = swimmer(frame, turn, radius_px).center_px;
        let (center, radius_px) = (center.map(|v| 2.0 * v), 2.0 * radius_px);
        let is_around = |rect: &Rect| {
            let off = |from: u32, to: u32, v: f64| (f64::from(from + to) / 2.0 - v).abs();
            off(rect.x, rect.right(), center[0]) < 4.0
                && off(rect.y, rect.bottom(), center[1]) < 4.0
                && (f64::from(rect.w) - 2.0 * radius_px).abs() < 8.0
        };
        assert!(boxes_px.iter().any(is_around), "{center:?} {boxes_px:?}");
    }
    let at_px = swimmer(40, 3.1, 8.0).center_px.map(|v| 2.0 * v);
    params.animal_at = Some(AnimalAtParam { frame: 40, at_px });
    let found = preview(&film, 0.5, None, &params, &Silent).unwrap();
    assert!(found.refused.is_none(), "{:?}", found.refused);
    assert_eq!(found.frames[0].frame, 30);
    for seen in &found.frames {
        let [x, y] = swimmer(seen.frame, 3.1, 8.0).center_px.map(|v| 2.0 * v);
        let outline = seen.animal_px.as_ref().expect("the animal is found");
        for [px, py] in outline {
            let radius_px = libm::hypot(px - x, py - y);
            assert!((radius_px - 16.0).abs() < 3.0, "{radius_px} in {seen:?}");
        }
        assert_eq!(seen.others_px.len(), 1, "the other disc");
    }
}
