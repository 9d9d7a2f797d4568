//! Films that break the program that decodes them are contained (RELIABILITY.md, R8): each of their jobs
//! fails with its code within its limit, and the jobs after them finish as if nothing had been.

use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use reqwest::Client;
use serde_json::{Value, json};

use crate::common::clip::SWIM;
use crate::common::process::Server;
use crate::common::{Place, client};

/// What the last bytes of a film do to its decoder, and the code that comes of it.
const POISONS: [(&str, &str); 4] = [
    ("ABORT", "decoder_crashed"),
    ("KILLED", "memory_limit"),
    ("FLOOD", "too_many_frames"),
    // It floods its complaints, then says nothing for ever: until the longest wait for a frame.
    ("SILENT", "time_limit"),
];

/// A shell script in ffmpeg's place that obeys the film's last bytes, and decodes other films.
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
         *FLOOD) exec /usr/bin/yes ;;\n\
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

struct Queue {
    server: Server,
    client: Client,
}

impl Queue {
    async fn post(&self, path: &str, body: reqwest::Body) -> Value {
        let request = self
            .client
            .post(format!("{}{path}", self.server.base))
            .body(body);
        let request = request.header(
            "content-type",
            match path {
                "/v1/footage" => "application/octet-stream",
                _ => "application/json",
            },
        );
        request.send().await.unwrap().json().await.unwrap()
    }

    async fn analyze(&self, film: Vec<u8>) -> Value {
        let footage = self.post("/v1/footage", film.into()).await;
        assert!(footage["id"].is_string(), "{footage}");
        let wish = json!({"footage_id": footage["id"]}).to_string();
        self.post("/v1/analyses", wish.into()).await
    }

    /// The job in its final state.
    async fn ended(&self, id: &Value, limit: Duration) -> Value {
        let path = format!("{}/v1/jobs/{}", self.server.base, id.as_str().unwrap());
        let start = Instant::now();
        loop {
            let job: Value = self
                .client
                .get(&path)
                .send()
                .await
                .unwrap()
                .json()
                .await
                .unwrap();
            if !job["finished_at"].is_null() {
                return job;
            }
            assert!(start.elapsed() < limit, "{job}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn poisoned_films_fail_alone_and_the_next_twenty_jobs_finish() {
    let place = Place::local();
    let wrapper = poisoned_ffmpeg(place.data());
    // The script starts other programs, which the sandbox would not let it.
    let flags = [
        "--sandbox",
        "off",
        "--workers",
        "2",
        "--ffmpeg",
        wrapper.to_str().unwrap(),
    ];
    let server = Server::start_with(place.data(), &flags);
    let client = client();
    let queue = Queue { server, client };
    let mut poisoned = Vec::new();
    for (poison, code) in POISONS {
        let tail = format!("\0\0\0\x0efree{poison:\0>6}");
        let film = [SWIM.as_slice(), tail.as_bytes()].concat();
        poisoned.push((queue.analyze(film).await["job_id"].clone(), poison, code));
    }
    let swim = queue.analyze(SWIM.clone()).await;
    let limit = Duration::from_secs(240);
    let library = queue.ended(&swim["job_id"], limit).await;
    assert_eq!(library["state"], "done", "{library}");
    let mut flocks = Vec::new();
    for seed in 0..20 {
        let wish = json!({
            "library_id": swim["library_id"], "count": 2, "frames": 8, "seed": seed,
        });
        flocks.push(queue.post("/v1/flocks", wish.to_string().into()).await["job_id"].clone());
    }
    for flock in &flocks {
        let job = queue.ended(flock, limit).await;
        assert_eq!(job["state"], "done", "{job}");
    }
    for (id, poison, code) in poisoned {
        let job = queue.ended(&id, limit).await;
        assert_eq!(job["state"], "failed", "{poison}: {job}");
        assert_eq!(job["error"]["code"], code, "{poison}: {job}");
    }
    assert_eq!(queue.server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
}
