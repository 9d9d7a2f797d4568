//! A full disk is a clean no (RELIABILITY.md, R7): uploads are refused with 507 and leave nothing, a job fails
//! with `storage_full`, what is there can be read and deleted, and all works again once there is room.

use std::path::{Path, PathBuf};
use std::process::Command;

use reqwest::StatusCode;
use serde_json::{Value, json};

use crate::common::app::{code_of, json_of};
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

#[tokio::test(flavor = "multi_thread")]
async fn a_full_disk_refuses_what_is_new_and_harms_nothing_that_is_there() {
    let place = Place::local();
    let Some(disk) = SmallDisk::over(place.data(), "48m") else {
        println!("skipped: no small disk can be mounted here, that takes root");
        return;
    };
    let reserve = (8 << 20).to_string();
    let server = Server::start_with(place.data(), &["--disk-reserve-bytes", &reserve]);
    let swim: Value = server.upload(SWIM.clone()).await.json().await.unwrap();
    let tiny: Value = server.upload(TINY.clone()).await.json().await.unwrap();

    // A body that does not say how long it is, and would fit but for the reserve.
    disk.fill_but(44 << 20);
    let pieces = (0..41).map(|_| Ok::<_, std::io::Error>(vec![7_u8; 1 << 20]));
    let endless = reqwest::Body::wrap_stream(futures_util::stream::iter(pieces));
    let post = client().post(format!("{}/v1/footage", server.base));
    let refused = post.body(endless).send().await.unwrap();
    assert_eq!(code_of(refused, 507).await, "storage_full");
    disk.free();
    assert!(disk.n_free_bytes() > 43 << 20, "it leaves nothing");

    // Down to the reserve: nothing new comes in, all else works.
    disk.fill_but(8 << 20);
    let other = [TINY.as_slice(), b"\0\0\0\x08free"].concat();
    let refused = server.upload(other.clone()).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 507).await, "storage_full");
    let ready = json_of(server.get("/readyz").await, StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(ready["disk"]["ok"], false, "{ready}");

    // Below it, as somebody else may fill the disk: a job fails cleanly.
    disk.free();
    disk.fill_but(1 << 20);
    let wish = json!({"footage_id": swim["id"]});
    let accepted = server.accept("/v1/analyses", wish.clone()).await;
    let failed = server.ended(&accepted["job_id"]).await;
    assert_eq!(failed["error"]["code"], "storage_full", "{failed}");
    let path_of = |footage: &Value| format!("/v1/footage/{}", footage["id"].as_str().unwrap());
    let film = server.get(&format!("{}/file", path_of(&swim))).await;
    assert!(film.bytes().await.unwrap() == SWIM.as_slice());
    assert_eq!(server.delete(&path_of(&tiny)).await.status(), 204);

    // With room again everything works, without a restart.
    disk.free();
    assert_eq!(server.upload(other).await.status(), 201);
    let accepted = server.accept("/v1/analyses", wish).await;
    let done = server.ended(&accepted["job_id"]).await;
    assert_eq!(done["state"], "done", "{done}");
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
    drop(disk);
}
