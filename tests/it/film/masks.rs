//! Masks that come with a film: they define the animal, even before a background that moves.

use std::sync::Arc;

use flockreel_core::analysis::{Error, Params, analyze};
use flockreel_core::code::Code;
use flockreel_core::cpu::Level;
use flockreel_core::fish::Palette;
use flockreel_core::fish::film::Film;
use flockreel_core::fish::mesh::Mesh;
use flockreel_core::footage::Masked;
use flockreel_core::library::Library;
use flockreel_core::progress::Silent;
use flockreel_core::raster::RgbImage;
use flockreel_core::scratch::{InMemory, Scratch};

use super::staged::{HEIGHT, N_FRAMES, Staged, WIDTH, put};

/// Returns the renderer of the fish of the plain film, to draw it over other backgrounds.
fn fish() -> Film {
    let plain = Staged::plain();
    let motion = plain.motion().clone();
    let mesh = Mesh::goldfish(motion.size, Palette::Goldfish);
    Film::new(motion, mesh, plain.scene().clone())
}

/// Returns a film of the fish before moving waves, which no static background describes.
fn before_running_waves(fish: &Film) -> Staged {
    Staged::plain().with_drawing(|k, picture, _| {
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let phase = [
                    (x as usize + 7 * k) as f64 / 25.0,
                    (y as usize + 3 * k) as f64 / 30.0,
                ];
                let level = (120.0 + 80.0 * phase[0].sin() * phase[1].cos()) as u8;
                put(picture, [x, y], [level / 2, level, 255 - level]);
            }
        }
        fish.draw(k).over(picture);
    })
}

/// Returns a mask film: the alpha of the fish with its soft edge, or black if `is_empty`.
fn masks(fish: &Film, is_empty: bool) -> Staged {
    Staged::plain().with_drawing(|k, picture: &mut RgbImage, _| {
        let drawing = fish.draw(k);
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let rect = drawing.rect;
                let level = match rect.contains(x, y) && !is_empty {
                    true => (drawing.alpha(x - rect.x, y - rect.y) * 255.0).round() as u8,
                    false => 0,
                };
                put(picture, [x, y], [level; 3]);
            }
        }
    })
}

fn analyzed(film: &Staged, masks: &Staged, is_mixed: bool) -> Result<Library, Error> {
    let masked = Masked::new(film, masks, is_mixed)?;
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let params = Params::default();
    analyze(&masked, None, &params, Level::detect(), &scratch, &Silent)
}

#[test]
fn masks_select_the_animal_before_a_moving_scene() {
    let fish = fish();
    let film = before_running_waves(&fish);
    assert!(film.analyzed(&Params::default()).is_err(), "without masks");
    let library = analyzed(&film, &masks(&fish, false), true).expect("a library");
    film.check("masked", &library);
    assert_eq!(library.poses.other_movers, []);
    let off_px = (0..N_FRAMES).filter_map(|k| {
        let (found, truth) = (library.poses.frames[k].centroid_px?, film.centroid_px(k)?);
        Some((found[0] - truth[0]).hypot(found[1] - truth[1]))
    });
    let worst = off_px.fold(0.0, f64::max);
    assert!(worst < 1.0, "{worst} px off");
}

/// Converts a premultiplied color, 0..=1, to 8 bits and straight alpha.
fn straight([r, g, b, a]: [f32; 4]) -> [u8; 4] {
    let scale = if a > 0.0 { 1.0 / a } else { 0.0 };
    [r * scale, g * scale, b * scale, a].map(|value| (255.0 * value + 0.5) as u8)
}

/// Returns the mean color error of half-transparent pixels against the fish alone, levels of 255.
fn color_error(fish: &Film, library: &Library) -> f64 {
    let (mut off, mut n) = (0.0, 0.0);
    let mut rgba = Vec::new();
    for k in (0..N_FRAMES).step_by(10) {
        let drawing = fish.draw(k);
        let rect = drawing.rect;
        let matte = library.sprites.matte(k).expect("it is shown");
        library.sprites.read_matte(&matte, &mut rgba);
        let centroid = library.poses.frames[k].centroid_px.expect("it is shown");
        let [left, top] = [0, 1].map(|c| (centroid[c] - matte.center_px[c]).round() as u32);
        for (at, rgba) in rgba.chunks_exact(4).enumerate() {
            let [x, y] = [at as u32 % matte.size[0], at as u32 / matte.size[0]];
            let truth = if rect.contains(left + x, top + y) {
                let at = (top + y - rect.y) * rect.w + left + x - rect.x;
                straight(drawing.pixels[at as usize])
            } else {
                [0; 4]
            };
            assert!(rgba[3].abs_diff(truth[3]) < 8, "{rgba:?} {truth:?}");
            if (90..200).contains(&rgba[3]) {
                let levels = (0..3).map(|c| f64::from(rgba[c].abs_diff(truth[c])));
                off += levels.sum::<f64>() / 3.0;
                n += 1.0;
            }
        }
    }
    assert!(n > 200.0, "{n} pixels");
    off / n
}

#[test]
fn colors_at_the_edge_are_freed_of_the_scene() {
    let fish = fish();
    let film = before_running_waves(&fish);
    let error = |is_mixed| {
        let library = analyzed(&film, &masks(&fish, false), is_mixed).expect("a library");
        color_error(&fish, &library)
    };
    let (taken_out, as_filmed) = (error(true), error(false));
    assert!(
        taken_out < 0.7 * as_filmed,
        "{taken_out} of {as_filmed} levels"
    );
}

#[test]
fn masks_of_another_number_or_without_an_animal_are_refused() {
    let fish = fish();
    let (film, masks_of) = (Staged::plain(), masks(&fish, false));
    let code = |masks: &Staged| {
        analyzed(&film, masks, true)
            .expect_err("they differ")
            .code()
    };
    assert_eq!(
        code(&Staged::in_order((0..100).collect())),
        Code::MasksDiffer
    );
    let more = (0..N_FRAMES).chain(0..3).collect();
    assert_eq!(code(&Staged::in_order(more)), Code::MasksDiffer);
    assert_eq!(code(&masks(&fish, true)), Code::MasksEmpty);
    let part = flockreel_core::footage::Part::new(&masks_of, None, None);
    assert!(Masked::new(&film, &part, true).is_ok());
}
