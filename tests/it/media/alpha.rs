//! Footage with an alpha channel: the alpha is the mask, in every container that supports it.

use std::path::{Path, PathBuf};

use flockreel::jobs::masks::Masks;
use flockreel::media::{Limits, ReadOptions, Video};
use image::{ImageFormat, Rgba, RgbaImage};

use super::read_all;
use crate::common::film::Films;
use crate::common::pictures::{encoded_rgba, zip_of};

const N_FRAMES: usize = 20;

/// Returns the alpha of a disk with a soft edge that moves right by one pixel per frame, 0 to 255.
fn alpha(k: usize, x: u32, y: u32) -> u8 {
    let (dx, dy) = (f64::from(x) - 20.0 - k as f64, f64::from(y) - 24.0);
    (255.0 * ((14.0 - dx.hypot(dy)) / 8.0).clamp(0.0, 1.0)) as u8
}

fn pictures(films: &Films, is_opaque: bool) -> Vec<(String, Vec<u8>)> {
    let picture = |k| {
        RgbaImage::from_fn(64, 48, |x, y| {
            let level = if is_opaque { 255 } else { alpha(k, x, y) };
            Rgba([200, 120, 40, level])
        })
    };
    let bytes = |k| encoded_rgba(&picture(k), ImageFormat::Png);
    let all = (0..N_FRAMES).map(|k| (format!("{k:03}.png"), bytes(k)));
    all.inspect(|(name, bytes)| drop(films.write(name, bytes)))
        .collect()
}

fn masks_of(path: &Path) -> Option<(Video, Masks)> {
    let (limits, options) = (Limits::default(), ReadOptions::default());
    let video = Video::open(path, &limits).unwrap_or_else(|error| panic!("{path:?}: {error}"));
    let masks = Masks::open(&video, path, None, &limits, &options);
    Some((video, masks.expect("they can be read")?))
}

#[test]
fn alpha_of_films_and_pictures_is_the_mask() {
    let films = Films::new();
    let zip = zip_of(&pictures(&films, false));
    let from = "-framerate 25 -i %03d.png";
    let paths: [PathBuf; 5] = [
        films.write("a.zip", zip),
        films.run(&format!(
            "{from} -c:v prores_ks -profile:v 4444 -pix_fmt yuva444p10le a.mov"
        )),
        films.run(&format!(
            "{from} -c:v libvpx-vp9 -pix_fmt yuva420p -b:v 1M a.webm"
        )),
        films.run(&format!("{from} -c:v png -pix_fmt rgba a.avi")),
        films.run(&format!("{from} -c:v ffv1 -pix_fmt yuva420p a.mkv")),
    ];
    for path in paths {
        let (video, masks) = masks_of(&path).unwrap_or_else(|| panic!("{path:?} has none"));
        let masked = masks.over(&video).expect("of one size");
        let frames = read_all(&masked).expect("frames");
        assert_eq!(frames.len(), N_FRAMES, "{path:?}");
        for (k, (_, frame)) in frames.iter().enumerate() {
            let mask = frame.mask.as_ref().expect("a mask");
            assert!(!mask.is_mixed);
            let off = (0..48 * 64).map(|at| {
                let truth = alpha(k, at % 64, at / 64);
                u32::from(mask.alpha[at as usize].abs_diff(truth))
            });
            let mean = f64::from(off.sum::<u32>()) / (48.0 * 64.0);
            assert!(mean < 4.0, "{path:?}, frame {k}: {mean} levels off");
        }
    }
}

#[test]
fn opaque_alpha_is_no_mask() {
    let films = Films::new();
    let zip = films.write("a.zip", zip_of(&pictures(&films, true)));
    assert!(Video::open(&zip, &Limits::default()).unwrap().has_alpha());
    assert!(masks_of(&zip).is_none());
    let plain = films.test_picture("64x48", 20, "-c:v mpeg4 plain.mp4");
    assert!(!Video::open(&plain, &Limits::default()).unwrap().has_alpha());
    assert!(masks_of(&plain).is_none());
}
