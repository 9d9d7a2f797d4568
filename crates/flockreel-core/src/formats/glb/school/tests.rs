//! The animals of a school are where the flock draws them, and look from its camera as their sprites do.

use super::*;
use crate::fish::{Body, Params as FishParams};
use crate::flock::{Params, plan_flock, synthetic};
use crate::library::Library;
use crate::progress::Silent;

fn film(library: &Library) -> Film {
    let params = FishParams {
        body: Body::Goldfish,
        ..FishParams::default()
    };
    Film::of(library, &params).expect("the library has poses")
}

fn flock(library: &Library) -> Flock {
    let params = Params {
        count: Some(4),
        frames: 60,
        variation: 0.3,
        ..Params::default()
    };
    plan_flock(library, &params, &Silent).expect("the library plays")
}

fn school<'a>(flock: &'a Flock, view: View, film: &'a Film) -> School<'a> {
    School {
        space: &flock.space,
        length_px: flock.length_px,
        view,
        motion: film.motion(),
    }
}

/// Returns the heading in the picture of a direction at a place in the tank.
fn heading_rad(space: &Space, place_bl: [f64; 3], forward: DVec3) -> f64 {
    let [x, y] = space.lens.picture_velocity(place_bl, forward.to_array());
    libm::atan2(y, x)
}

#[test]
fn animals_are_where_their_sprites_are_drawn() {
    for view in [View::Side, View::Top] {
        let library = synthetic::library(view);
        let (film, flock) = (film(&library), flock(&library));
        let school = school(&flock, view, &film);
        let length_m = film.motion().size.length_m;
        for one in &flock.individuals {
            for (posture, drawn) in school.swim(one).iter().zip(&one.centroid_px) {
                let ahead = posture.forward() * one.size * film.motion().origin_ahead_m();
                let center_bl = (posture.position_m - ahead) / length_m;
                let seen = flock.space.lens.picture_px(center_bl.to_array());
                assert!((0..2).all(|c| (seen[c] - drawn[c]).abs() < 1e-6));
            }
        }
    }
}

#[test]
fn animals_point_where_their_sprites_point() {
    let library = synthetic::library(View::Side);
    let (film, flock) = (film(&library), flock(&library));
    let school = school(&flock, View::Side, &film);
    let camera = &film.motion().camera;
    let mut n_mirrored = 0;
    for one in &flock.individuals {
        for k in 0..one.source_frame.len() {
            let shown = Shown {
                source_frame: one.source_frame[k],
                mirrored: one.mirrored[k],
                rotation_rad: one.rotation_rad[k],
            };
            let filmed = &film.motion().frames[shown.source_frame as usize];
            let at = camera.image_from_camera(filmed.position_m.to_array());
            let ahead = filmed.position_m + 1e-6 * filmed.forward();
            let ahead = camera.image_from_camera(ahead.to_array());
            let sign = if shown.mirrored { -1.0 } else { 1.0 };
            let filmed_rad = libm::atan2(ahead[1] - at[1], sign * (ahead[0] - at[0]));
            let place_bl = school.place_bl(one, k);
            let forward = school.look(&shown, place_bl).rotation * DVec3::X;
            let shown_rad = heading_rad(&flock.space, place_bl, forward);
            let gap = crate::geometry::wrap_rad(shown_rad - filmed_rad - shown.rotation_rad);
            // Away from the optical axis the picture plane is oblique to the line of sight, which turns headings a little.
            assert!(gap.abs() < 0.05, "{gap}");
            n_mirrored += usize::from(shown.mirrored);
        }
    }
    assert!(n_mirrored > 0);
}

#[test]
fn mirrored_animal_bends_to_the_other_side_and_stays_upright() {
    let library = synthetic::library(View::Side);
    let (film, flock) = (film(&library), flock(&library));
    let school = school(&flock, View::Side, &film);
    let look = |mirrored| {
        let shown = Shown {
            source_frame: 7,
            mirrored,
            rotation_rad: 0.0,
        };
        school.look(&shown, [0.0, 0.0, 10.0])
    };
    let (plain, mirrored) = (look(false), look(true));
    assert!(plain.joint_angles_rad[3] != 0.0);
    for j in 0..N_JOINTS {
        assert_eq!(mirrored.joint_angles_rad[j], -plain.joint_angles_rad[j]);
    }
    assert!((mirrored.rotation * DVec3::Y).y > 0.8, "the belly is below");
}

#[test]
fn school_shares_one_mesh_and_has_one_animation_of_all() {
    let library = synthetic::library(View::Side);
    let (film, flock) = (film(&library), flock(&library));
    let file = write_school(&flock, View::Side, &film);
    let json_len = u32::from_le_bytes(file[12..16].try_into().expect("four bytes")) as usize;
    let root = gltf_json::Root::from_slice(&file[20..20 + json_len]).expect("it is JSON");
    assert_eq!((root.meshes.len(), root.animations.len()), (1, 1));
    assert_eq!(root.skins.len(), flock.individuals.len());
    let binds: Vec<_> = root.skins.iter().map(|s| s.inverse_bind_matrices).collect();
    assert!(binds.iter().all(|bind| *bind == binds[0]));
    for (one, skin) in flock.individuals.iter().zip(&root.skins) {
        let node = &root.nodes[skin.skeleton.expect("written").value()];
        let size = node.scale.map_or(1.0, |[x, ..]| f64::from(x));
        assert!((size - one.size).abs() < 1e-6);
    }
}
