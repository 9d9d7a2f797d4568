//! The virtual fish from end to end (docs/explanation/algorithms.md, "Virtual fish"). The sample film is
//! analyzed with its true camera. The poses drive a virtual fish, which must follow the filmed one.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::{Arc, OnceLock};

use flockreel::media::{Limits, Video};
use flockreel_core::analysis::params::{AnimalParams, CameraParams};
use flockreel_core::analysis::{self, analyze};
use flockreel_core::cpu::Level;
use flockreel_core::fish::sample::{SampleFilm, SampleParams};
use flockreel_core::fish::{Film, Params, drive, likeness};
use flockreel_core::footage::FrameSource;
use flockreel_core::formats::library_dir;
use flockreel_core::formats::library_json::FootageSummary;
use flockreel_core::library::Library;
use flockreel_core::progress::Silent;
use flockreel_core::scratch::{InMemory, Scratch};

const N_FRAMES: usize = 180;

/// Returns the sample film, its library and the analysis parameters. They are made once for all tests.
pub(super) fn filmed() -> &'static (SampleFilm, Library, analysis::Params) {
    static FILMED: OnceLock<(SampleFilm, Library, analysis::Params)> = OnceLock::new();
    FILMED.get_or_init(|| filmed_with(SampleParams::default().noise))
}

/// Like [`filmed`], without noise, so that only the errors of the method remain.
pub(super) fn filmed_without_noise() -> &'static (SampleFilm, Library, analysis::Params) {
    static FILMED: OnceLock<(SampleFilm, Library, analysis::Params)> = OnceLock::new();
    FILMED.get_or_init(|| filmed_with(0.0))
}

fn filmed_with(noise: f64) -> (SampleFilm, Library, analysis::Params) {
    let params = SampleParams {
        n_frames: N_FRAMES,
        noise,
        ..SampleParams::default()
    };
    let film = SampleFilm::new(params).expect("in range");
    let (camera, animal) = (film.motion().camera, film.animal());
    let params = analysis::Params {
        camera: Some(CameraParams {
            z_min_m: camera.z_min_m,
            pane_px_per_m: camera.pane_px_per_m,
            center_px: None,
            medium_index: camera.medium_index,
        }),
        animal: Some(AnimalParams {
            length_m: animal.length_m,
            height_m: animal.height_m,
        }),
        ..analysis::Params::default()
    };
    let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
    let library = analyze(&film, None, &params, Level::detect(), &scratch, &Silent);
    let library = library.expect("it can be analysed");
    (film, library, params)
}

pub(super) fn library_on_disk(dir: &Path) {
    let (_, library, params) = filmed();
    let footage = FootageSummary {
        sha256: "0".repeat(64),
        n_bytes: 1,
    };
    library_dir::write(dir, library, params, &footage).expect("the folder can be written");
}

pub(super) fn flockreel(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(args)
        .output()
        .expect("the program starts")
}

pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn virtual_fish_follows_the_filmed_one() {
    let (film, library, _) = filmed();
    let motion = drive(&library.poses, &Params::default(), None).unwrap();
    let both = motion.frames.iter().zip(&film.motion().frames);
    let seen: Vec<_> = both.filter(|(got, _)| got.visible).collect();
    assert!(seen.len() > N_FRAMES * 9 / 10, "visible in {}", seen.len());
    let camera = &film.motion().camera;
    let gap_px = |(got, want): &(
        &flockreel_core::fish::Posture,
        &flockreel_core::fish::Posture,
    )| {
        let [a, b] = [got, want].map(|p| camera.image_from_camera(p.position_m.to_array()));
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    let gap_m = median(
        seen.iter()
            .map(|(a, b)| (a.position_m - b.position_m).length())
            .collect(),
    );
    let gap_px = median(seen.iter().map(gap_px).collect());
    let turn = median(
        seen.iter()
            .map(|(a, b)| a.forward().angle_between(b.forward()))
            .collect(),
    );
    assert!(
        gap_px < 4.0 && gap_m < 0.05 && turn < 0.5,
        "{gap_px} px, {gap_m} m, {turn} rad"
    );
}

#[test]
fn fish_command_writes_a_film_of_both_fish_and_a_model() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    library_on_disk(&dir.path().join("library"));
    let (library, film, model) = (at("library"), at("fish.mp4"), at("fish.glb"));
    let made = flockreel(&["fish", &library, "-o", &film, "--side-by-side"]);
    assert!(made.status.success(), "{made:?}");
    let format = Video::open(Path::new(&film), &Limits::default())
        .unwrap()
        .format();
    assert_eq!(
        (format.width, format.height, format.n_frames_hint),
        (1280, 480, N_FRAMES)
    );
    let made = flockreel(&["fish", &library, "-o", &model, "--json"]);
    assert!(made.status.success(), "{made:?}");
    assert!(String::from_utf8_lossy(&made.stdout).contains("\"visible_frames\":1"));
    assert_eq!(&std::fs::read(&model).unwrap()[..4], b"glTF");
    let refused = flockreel(&["fish", &library, "-o", &at("fish.avi")]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn changed_plan_is_refused_with_its_fault() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    library_on_disk(&dir.path().join("library"));
    let (library, picture, plan) = (at("library"), at("flock.png"), at("flock.json"));
    let size = ["--count", "2", "--frames", "50", "--plan", &plan];
    let made = flockreel(&[&["flock", &library, "-o", &picture], &size[..]].concat());
    assert!(made.status.success(), "{made:?}");
    let check = || flockreel(&["check-plan", &library, &plan, "--json"]);
    let said = String::from_utf8(check().stdout).unwrap();
    assert!(
        said.contains("\"individuals\":2") && said.contains("\"frames\":100"),
        "{said}"
    );

    let text = std::fs::read_to_string(&plan).unwrap();
    let total = text.rfind("\"total\":").expect("a cost") + 8;
    let end = total + text[total..].find(',').expect("more costs");
    std::fs::write(&plan, format!("{}0.0{}", &text[..total], &text[end..])).unwrap();
    let refused = check();
    assert_eq!(refused.status.code(), Some(2));
    let sentence = String::from_utf8(refused.stderr).unwrap();
    assert!(
        sentence.contains("individual 1: cost.total or its parts are not ")
            && sentence.contains(" (wrong_cost)"),
        "{sentence}"
    );

    std::fs::write(&plan, "{}").unwrap();
    let refused = check();
    assert_eq!(refused.status.code(), Some(2));
    let sentence = String::from_utf8(refused.stderr).unwrap();
    assert!(sentence.contains("not a flock.json: "), "{sentence}");
}

#[test]
fn sample_command_writes_footage_with_a_true_pose_for_every_frame() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let (film, truth) = (at("sample.mp4"), at("truth.json"));
    let made = flockreel(&[
        "sample", "-o", &film, "--truth", &truth, "--frames", "12", "--size", "320x240",
    ]);
    assert!(made.status.success(), "{made:?}");
    let format = Video::open(Path::new(&film), &Limits::default())
        .unwrap()
        .format();
    assert_eq!(
        (format.width, format.height, format.n_frames_hint),
        (320, 240, 12)
    );
    let poses = flockreel_core::formats::poses_json::read(&std::fs::read(&truth).unwrap()).unwrap();
    assert_eq!(poses.frames.len(), 12);
    assert!(poses.frames.iter().all(|pose| pose.position_m.is_some()));
}

#[test]
fn virtual_animal_looks_like_the_filmed_one() {
    let (_, library, _) = filmed();
    let film = Film::of(library, &Params::default()).expect("it shows the whole animal");
    let alike = likeness(library, &film).expect("it shows the whole animal");
    assert!(alike.n_frames > N_FRAMES / 2, "{alike:?}");
    assert!(alike.overlap > 0.7, "{alike:?}");
    assert!(alike.color_levels < 20.0, "{alike:?}");
}
