//! Behavior on a full disk (docs/explanation/promises.md, "Full disk"). Uploads and new jobs are refused with 507 and
//! leave no files, and running jobs fail with `storage_full`. Stored files can be read and deleted, and everything
//! works again as soon as there is space. FLOCKREEL_FULL_SECONDS sets how long the disk stays full in the test
//! under load, ten times instead of four.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};
use tokio_util::sync::CancellationToken;

use crate::common::app::{code_of, json_of};
use crate::common::clip::{SWIM, TINY};
use crate::common::process::{Server, numbered_film};
use crate::common::{Place, client};

/// Time within which the service works again after space was freed.
const RECOVERY: Duration = Duration::from_secs(2);

/// A small tmpfs mounted over a folder, unmounted on drop.
struct SmallDisk(PathBuf);

impl SmallDisk {
    /// Mounts the disk; `size` is a tmpfs size such as `64m`. Returns `None` if mounting is not permitted.
    fn over(folder: &Path, size: &str) -> Option<SmallDisk> {
        let options = format!("size={size}");
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &options, "none"])
            .arg(folder)
            .output();
        let mounted = mounted.is_ok_and(|done| done.status.success());
        mounted.then(|| SmallDisk(folder.to_owned()))
    }

    /// Fills the disk except for `n_left` bytes.
    fn fill_but(&self, n_left: u64) {
        let filler = vec![7; self.n_free_bytes().saturating_sub(n_left) as usize];
        std::fs::write(self.0.join("filler"), filler).unwrap();
    }

    /// Fills the disk completely.
    fn fill(&self) {
        let mut filler = File::options();
        let mut filler = filler
            .create(true)
            .append(true)
            .open(self.0.join("filler"))
            .unwrap();
        while filler.write_all(&[7; 4096]).is_ok() {}
        assert_eq!(self.n_free_bytes(), 0);
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
        // Unmount lazily, because files on the disk may still be open.
        Command::new("umount").arg("-l").arg(&self.0).output().ok();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn full_disk_refuses_new_data_and_keeps_stored_data() {
    let place = Place::local();
    let Some(disk) = SmallDisk::over(place.data(), "64m") else {
        println!("skipped: no small disk can be mounted here, that takes root");
        return;
    };
    let reserve = (8 << 20).to_string();
    let server = Server::start_with(place.data(), &["--disk-reserve-bytes", &reserve]);
    let swim: Value = server.upload(SWIM.clone()).await.json().await.unwrap();
    let tiny: Value = server.upload(TINY.clone()).await.json().await.unwrap();

    // A body without a declared length. Only the reserve keeps it from fitting.
    disk.fill_but(44 << 20);
    let pieces = (0..41).map(|_| Ok::<_, std::io::Error>(vec![7_u8; 1 << 20]));
    let endless = reqwest::Body::wrap_stream(futures_util::stream::iter(pieces));
    let post = client().post(format!("{}/v1/footage", server.base));
    let refused = post.body(endless).send().await.unwrap();
    assert_eq!(code_of(refused, 507).await, "storage_full");
    disk.free();
    assert!(disk.n_free_bytes() > 43 << 20, "it leaves nothing");

    // Fill up to the reserve: uploads are refused, and everything else works.
    disk.fill_but(8 << 20);
    let other = [TINY.as_slice(), b"\0\0\0\x08free"].concat();
    let refused = server.upload(other.clone()).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 507).await, "storage_full");
    assert_eq!(refused_work(&server).await, ["uploads"]);

    // Fill below the reserve, as another program may do: jobs are refused too.
    disk.free();
    disk.fill_but(1 << 19);
    assert_refused(&server, 1, swim["id"].as_str().unwrap()).await;
    assert_eq!(refused_work(&server).await, ["uploads", "jobs"]);
    let wish = json!({"footage_id": swim["id"]});
    let path_of = |footage: &Value| format!("/v1/footage/{}", footage["id"].as_str().unwrap());
    let film = server.get(&format!("{}/file", path_of(&swim))).await;
    assert!(film.bytes().await.unwrap() == SWIM.as_slice());
    assert_eq!(server.delete(&path_of(&tiny)).await.status(), 204);

    // Free the space: everything works without a restart.
    disk.free();
    assert_eq!(server.upload(other).await.status(), 201);
    let accepted = server.accept("/v1/analyses", wish).await;
    let done = server.ended(&accepted["job_id"]).await;
    assert_eq!(done["state"], "done", "{done}");
    assert_eq!(server.terminate(), Some(0));
    assert_eq!(place.n_drafts(), 0);
    drop(disk);
}

/// Starts a service without a disk reserve on its own small disk. Returns `None` if mounting is not
/// permitted.
fn careless() -> Option<(Place, SmallDisk, Server)> {
    let place = Place::local();
    let Some(disk) = SmallDisk::over(place.data(), "64m") else {
        println!("skipped: no small disk can be mounted here, that takes root");
        return None;
    };
    let server = Server::start_with(place.data(), &["--disk-reserve-bytes", "0"]);
    Some((place, disk, server))
}

/// Returns the work that `/readyz` names as refused. Asserts that the service is ready nevertheless.
async fn refused_work(server: &Server) -> Vec<String> {
    let ready = json_of(server.get("/readyz").await, StatusCode::OK).await;
    assert_eq!(ready["ready"], true, "{ready}");
    let refused = ready["refused"].as_array().unwrap().iter();
    let work = refused.map(|refused| refused["work"].as_str().unwrap());
    work.map(str::to_owned).collect()
}

async fn id_of(uploaded: Response) -> String {
    let footage = json_of(uploaded, StatusCode::CREATED).await;
    footage["id"].as_str().unwrap().to_owned()
}

/// Asserts that an upload, a resumable upload and a job are each refused with `storage_full`.
async fn assert_refused(server: &Server, number: usize, footage: &str) {
    let refused = server.upload(numbered_film(number)).await;
    assert!(refused.headers().contains_key("retry-after"));
    assert_eq!(code_of(refused, 507).await, "storage_full");
    let resumable = client().post(format!("{}/v1/uploads", server.base));
    let resumable = resumable.header("tus-resumable", "1.0.0");
    let refused = resumable.header("upload-length", "1000").send().await;
    assert_eq!(code_of(refused.unwrap(), 507).await, "storage_full");
    let job = client().post(format!("{}/v1/analyses", server.base));
    let refused = job.json(&json!({"footage_id": footage})).send().await;
    assert_eq!(code_of(refused.unwrap(), 507).await, "storage_full");
}

#[tokio::test(flavor = "multi_thread")]
async fn deletion_works_with_zero_free_bytes_and_service_recovers() {
    let Some((place, disk, server)) = careless() else {
        return;
    };
    let swim = id_of(server.upload(SWIM.clone()).await).await;
    let wish = json!({"footage_id": swim});
    for round in 0..3 {
        let mut films = Vec::new();
        for k in 0..4 {
            films.push(id_of(server.upload(numbered_film(10 * round + k)).await).await);
        }
        disk.fill();
        assert_refused(&server, 10 * round + 5, &swim).await;
        assert_eq!(refused_work(&server).await, ["uploads", "jobs"]);
        for film in films {
            // Fill the space that the last deletion freed.
            disk.fill();
            let gone = server.delete(&format!("/v1/footage/{film}")).await;
            assert_eq!(gone.status(), 204);
            let absent = server.get(&format!("/v1/footage/{film}")).await;
            assert_eq!(absent.status(), 404);
        }
        disk.fill();
        assert_refused(&server, 10 * round + 6, &swim).await;
        let film = server.get(&format!("/v1/footage/{swim}/file")).await;
        assert!(film.bytes().await.unwrap() == SWIM.as_slice());
        disk.free();
        let freed = Instant::now();
        id_of(server.upload(numbered_film(10 * round + 7)).await).await;
        let accepted = server.accept("/v1/analyses", wish.clone()).await;
        let is_claimed = |job: &Value| job["state"] != "queued";
        server.job_when(&accepted["job_id"], is_claimed).await;
        assert!(freed.elapsed() < RECOVERY, "{:?}", freed.elapsed());
        let done = server.ended(&accepted["job_id"]).await;
        assert_eq!(done["state"], "done", "{done}");
        // The only worker must be free when the next disk is.
        let library = server.json(done["links"]["result"].as_str().unwrap()).await;
        server.ended(&library["views"]["job_id"]).await;
    }
    assert_eq!(server.terminate(), Some(0));
    assert_sound(place.data());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_fills_the_disk_fails_while_the_disk_is_full() {
    let Some((place, disk, server)) = careless() else {
        return;
    };
    let footage = id_of(server.upload(SWIM.clone()).await).await;
    let wish = json!({"footage_id": footage});
    let accepted = server.accept("/v1/analyses", wish).await;
    let is_running = |job: &Value| job["state"] == "running";
    server.job_when(&accepted["job_id"], is_running).await;
    disk.fill();
    let failed = server.ended(&accepted["job_id"]).await;
    assert_eq!(failed["error"]["code"], "storage_full", "{failed}");
    assert_eq!(server.terminate(), Some(0));
    assert_sound(place.data());
}

#[tokio::test(flavor = "multi_thread")]
async fn every_request_is_answered_while_the_disk_fills_and_empties_under_load() {
    let Some((place, disk, server)) = careless() else {
        return;
    };
    let asked = std::env::var("FLOCKREEL_FULL_SECONDS").ok();
    let (n_times, full_s): (u32, u64) =
        asked.map_or((4, 1), |seconds| (10, seconds.parse().unwrap()));
    let (base, over) = (server.base.clone(), CancellationToken::new());
    let senders = (0..4).map(|sender| tokio::spawn(send_all(base.clone(), sender, over.clone())));
    let senders: Vec<_> = senders.collect();
    for _ in 0..n_times {
        disk.fill();
        for _ in 0..5 * full_s {
            tokio::time::sleep(Duration::from_millis(200)).await;
            disk.fill();
        }
        disk.free();
        works_again(&server).await;
        tokio::time::sleep(Duration::from_millis(500)).await;
    }
    over.cancel();
    let (mut n_taken, mut n_refused) = (0, 0);
    for sender in senders {
        let (taken, refused) = sender.await.unwrap();
        n_taken += taken;
        n_refused += refused;
    }
    assert!(n_taken > 0 && n_refused > 0, "{n_taken} {n_refused}");
    assert_eq!(server.terminate(), Some(0));
    assert_sound(place.data());
}

/// Asserts that an upload is accepted within the promised time.
async fn works_again(server: &Server) {
    let freed = Instant::now();
    while server.upload(numbered_film(999)).await.status().as_u16() / 100 != 2 {
        assert!(freed.elapsed() < RECOVERY, "uploads are still refused");
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// Uploads, reads and deletes films until the test is over. Returns the numbers of accepted and refused
/// uploads.
async fn send_all(base: String, sender: usize, over: CancellationToken) -> (usize, usize) {
    let client = client();
    let ask = async |method: Method, path: &str, film: Vec<u8>| {
        let request = client.request(method, format!("{base}{path}"));
        request.body(film).send().await.unwrap()
    };
    let (mut n_taken, mut n_refused) = (0, 0);
    while !over.is_cancelled() {
        let number = 1_000_000 * (sender + 1) + n_taken + n_refused;
        let answer = ask(Method::POST, "/v1/footage", numbered_film(number)).await;
        if answer.status() != StatusCode::CREATED {
            assert_eq!(code_of(answer, 507).await, "storage_full");
            n_refused += 1;
            continue;
        }
        n_taken += 1;
        let path = format!("/v1/footage/{}", id_of(answer).await);
        let read = ask(Method::GET, &path, Vec::new()).await;
        assert_eq!(read.status(), 200);
        let gone = ask(Method::DELETE, &path, Vec::new()).await;
        assert!([204, 507].contains(&gone.status().as_u16()), "{gone:?}");
    }
    (n_taken, n_refused)
}

/// Asserts that `flockreel check` accepts the data folder.
fn assert_sound(data: &Path) {
    let check = Command::new(env!("CARGO_BIN_EXE_flockreel"))
        .args(["check", "--data"])
        .arg(data)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&check.stderr);
    assert!(check.status.success(), "{said}");
}
