//! Films that crash or stall their decoder affect no other job (docs/explanation/promises.md,
//! "Poison jobs"). Each of their jobs fails with its code within its limit, and the jobs after them finish.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use serde_json::json;

use crate::common::Place;
use crate::common::clip::SWIM;
use crate::common::process::Server;

/// Last bytes of a film, with the error code that they lead to. [`poisoned_ffmpeg`] acts on them.
const POISONS: [(&str, &str); 4] = [
    ("ABORT", "decoder_crashed"),
    ("KILLED", "memory_limit"),
    // Floods stderr, then writes endless frames.
    ("FLOOD", "too_many_frames"),
    // Floods stderr, then stays silent until the time limit for a frame.
    ("SILENT", "time_limit"),
];

/// Writes a shell script that replaces ffmpeg. It acts on the last bytes of a poisoned film and runs the
/// real ffmpeg for any other.
fn poisoned_ffmpeg(folder: &Path) -> PathBuf {
    let path = std::env::var_os("PATH").expect("a PATH");
    let mut places = std::env::split_paths(&path).map(|place| place.join("ffmpeg"));
    let real = places
        .find(|place| place.is_file())
        .expect("ffmpeg is installed");
    let script = format!(
        "#!/bin/sh\n\
         for word in \"$@\"; do case \"$word\" in file:*) film=${{word#file:}} ;; esac; done\n\
         case \"$(/usr/bin/tail -c 6 \"$film\" 2>/dev/null | /usr/bin/tr -d '\\0')\" in\n\
         *ABORT) kill -ABRT $$ ;;\n\
         *KILLED) kill -KILL $$ ;;\n\
         *FLOOD) /usr/bin/head -c 50000000 /dev/zero >&2; exec /usr/bin/yes ;;\n\
         *SILENT) /usr/bin/head -c 50000000 /dev/zero >&2; exec /bin/sleep 300 ;;\n\
         esac\n\
         exec {} \"$@\"\n",
        real.display()
    );
    let wrapper = folder.join("poisoned-ffmpeg");
    std::fs::write(&wrapper, script).unwrap();
    std::fs::set_permissions(&wrapper, std::fs::Permissions::from_mode(0o755)).unwrap();
    wrapper
}

#[tokio::test(flavor = "multi_thread")]
async fn poisoned_films_fail_and_the_next_twenty_jobs_finish() {
    let place = Place::local();
    let wrapper = poisoned_ffmpeg(place.data());
    // The script starts other programs, which the sandbox would forbid.
    let flags = [
        "--sandbox",
        "off",
        "--workers",
        "2",
        "--ffmpeg",
        wrapper.to_str().unwrap(),
    ];
    let server = Server::start_with(place.data(), &flags);
    let mut poisoned = Vec::new();
    for (poison, code) in POISONS {
        let tail = format!("\0\0\0\x0efree{poison:\0>6}");
        let film = [SWIM.as_slice(), tail.as_bytes()].concat();
        let accepted = server.analyze(film).await;
        poisoned.push((accepted["job_id"].clone(), poison, code));
    }
    let swim = server.analyze(SWIM.clone()).await;
    let library = server.ended(&swim["job_id"]).await;
    assert_eq!(library["state"], "done", "{library}");
    let mut flocks = Vec::new();
    for seed in 0..20 {
        let wish = json!({
            "library_id": swim["library_id"], "count": 2, "frames": 8, "seed": seed,
        });
        flocks.push(server.accept("/v1/flocks", wish).await["job_id"].clone());
    }
    for flock in &flocks {
        let job = server.ended(flock).await;
        assert_eq!(job["state"], "done", "{job}");
    }
    for (id, poison, code) in poisoned {
        let job = server.ended(&id).await;
        assert_eq!(job["state"], "failed", "{poison}: {job}");
        assert_eq!(job["error"]["code"], code, "{poison}: {job}");
    }
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
}
