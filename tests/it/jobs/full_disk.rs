//! A full disk is a clean no (RELIABILITY.md, R7): uploads are refused with 507 and leave nothing, a job fails
//! with `storage_full`, what is there can be read and deleted, and all works again once there is room.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use reqwest::{Client, Response};
use serde_json::{Value, json};

use crate::common::app::code_of;
use crate::common::clip::{SWIM, TINY};
use crate::common::process::Server;
use crate::common::{Place, client};

/// A small disk of memory over a folder, until dropped.
struct SmallDisk(PathBuf);

impl SmallDisk {
    /// None where mounting is not allowed.
    fn over(folder: &Path, size: &str) -> Option<SmallDisk> {
        let options = format!("size={size}");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &options, "none"])
            .arg(folder)
            .output();
        let mounted = mounted.is_ok_and(|done| done.status.success());
        mounted.then(|| SmallDisk(folder.to_owned()))
    }

    /// Fills it but for so many bytes.
    fn fill_but(&self, n_left: u64) {
        let filler = vec![7; self.n_free_bytes().saturating_sub(n_left) as usize];
        std::fs::write(self.0.join("filler"), filler).unwrap();
    }

    fn n_free_bytes(&self) -> u64 {
        let disk = rustix::fs::statvfs(&self.0).unwrap();
        disk.f_bavail * disk.f_frsize
    }

    fn free(&self) {
        std::fs::remove_file(self.0.join("filler")).unwrap();
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        // Lazily, for something of it may still be open.
        Command::new("umount").arg("-l").arg(&self.0).output().ok();
    }
}

struct Service {
    server: Server,
    client: Client,
}

impl Service {
    async fn upload(&self, film: &[u8]) -> Response {
        let post = self.client.post(format!("{}/v1/footage", self.server.base));
        post.body(film.to_vec()).send().await.unwrap()
    }

    async fn ended(&self, job: &Value) -> Value {
        let path = format!("{}/v1/jobs/{}", self.server.base, job.as_str().unwrap());
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
            assert!(start.elapsed() < Duration::from_secs(240), "{job}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    async fn analyze(&self, footage: &Value) -> Value {
        let post = self
            .client
            .post(format!("{}/v1/analyses", self.server.base));
        let accepted = post
            .json(&json!({"footage_id": footage["id"]}))
            .send()
            .await
            .unwrap();
        let accepted: Value = accepted.json().await.unwrap();
        self.ended(&accepted["job_id"]).await
    }

    async fn delete(&self, footage: &Value) -> u16 {
        let path = format!(
            "{}/v1/footage/{}",
            self.server.base,
            footage["id"].as_str().unwrap()
        );
        self.client
            .delete(path)
            .send()
            .await
            .unwrap()
            .status()
            .as_u16()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_refuses_what_is_new_and_harms_nothing_that_is_there() {
    let place = Place::local();
    let Some(disk) = SmallDisk::over(place.data(), "48m") else {
        println!("skipped: no small disk can be mounted here, that takes root");
        return;
    };
    let reserve = (8 << 20).to_string();
    let server = Server::start_with(place.data(), &["--disk-reserve-bytes", &reserve]);
    let client = client();
    let service = Service { server, client };
    let swim: Value = service.upload(&SWIM).await.json().await.unwrap();
    let tiny: Value = service.upload(&TINY).await.json().await.unwrap();

    // A body that does not say how long it is, and would fit but for the reserve.
    disk.fill_but(44 << 20);
    let pieces = (0..41).map(|_| Ok::<_, std::io::Error>(vec![7_u8; 1 << 20]));
    let endless = reqwest::Body::wrap_stream(futures_util::stream::iter(pieces));
    let post = service
        .client
        .post(format!("{}/v1/footage", service.server.base));
    let refused = post.body(endless).send().await.unwrap();
    assert_eq!(code_of(refused, 507).await, "storage_full");
    disk.free();
    assert!(disk.n_free_bytes() > 43 << 20, "it leaves nothing");

    // Down to the reserve: nothing new comes in, all else works.
    disk.fill_but(8 << 20);
    let other = [TINY.as_slice(), b"\0\0\0\x08free"].concat();
    let refused = service.upload(&other).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 507).await, "storage_full");
    let ready = service
        .client
        .get(format!("{}/readyz", service.server.base))
        .send()
        .await
        .unwrap();
    assert_eq!(ready.status(), 503);
    let ready: Value = ready.json().await.unwrap();
    assert_eq!(ready["disk"]["ok"], false, "{ready}");

    // Below it, as somebody else may fill the disk: a job fails cleanly.
    disk.free();
    disk.fill_but(1 << 20);
    let failed = service.analyze(&swim).await;
    assert_eq!(failed["error"]["code"], "storage_full", "{failed}");
    let path = format!(
        "{}/v1/footage/{}/file",
        service.server.base,
        swim["id"].as_str().unwrap()
    );
    let film = service
        .client
        .get(path)
        .send()
        .await
        .unwrap()
        .bytes()
        .await
        .unwrap();
    assert!(film == SWIM.as_slice());
    assert_eq!(service.delete(&tiny).await, 204);

    // With room again everything works, without a restart.
    disk.free();
    assert_eq!(service.upload(&other).await.status(), 201);
    let done = service.analyze(&swim).await;
    assert_eq!(done["state"], "done", "{done}");
    assert_eq!(service.server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
    drop(disk);
}
