//! Tests of the second cut, with the frames around.

use super::*;

/// A body whose front has the shade of a shadow.
fn bitten(x: u32, y: u32) -> u8 {
    match steps_away([x, y], BODY) {
        0 if x >= 54 => PAPER / 5 * 4,
        0 => FUR,
        _ => PAPER,
    }
}

fn whole(x: u32, y: u32) -> u8 {
    if steps_away([x, y], BODY) == 0 {
        FUR
    } else {
        PAPER
    }
}

/// Returns the cut of a frame with a bitten body whose front is known to show the animal.
fn mended(scene: &Scene) -> Seen {
    let mut seen = scene.cut(bitten).seen.expect("no mask is given");
    let rect = seen.solid.rect;
    for (k, bit) in seen.solid.bits.iter_mut().enumerate() {
        let (x, y) = (rect.x + k as u32 % rect.w, rect.y + k as u32 / rect.w);
        *bit |= u8::from(steps_away([x, y], BODY) == 0);
    }
    seen
}

#[test]
fn frames_around_show_what_one_frame_does_not() {
    let scene = Scene::with(|_, _| PAPER, whole);
    let front = [54, 33];
    let Pulled { matte, seen } = scene.cut(bitten);
    let alone = pixel_of(&matte, front)[3];
    assert!(alone < 128, "the frame alone: {alone}");
    let at_rest = |seen: Seen| seen.shape([45.0, 33.0], None);
    let own = scene.cut(bitten).seen.map(at_rest);
    let own = own.expect("no mask is given");
    let other = at_rest(mended(&scene));
    let around = [(); 8].map(|()| other.from_frame_of(&own));
    let seen = seen.expect("no mask is given");
    let again = seen.pull(&scene.background, &scene.coat, &around);
    let again = again.expect("the second cut differs");
    assert_eq!(pixel_of(&again, front)[3], 255);
}
