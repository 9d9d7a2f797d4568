//! Resumable uploads that go on at another service than the one that began them (docs/explanation/promises.md, "No
//! upload is lost" and "Bad networks").

use std::time::{Duration, Instant, SystemTime};

use flockreel::jobs::clock::now_ms;
use flockreel::store::owners::Owner;
use flockreel::store::uploads::Upload;
use flockreel::store::{Error, Store};
use reqwest::{Response, StatusCode};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use uuid::Uuid;

use super::watched::Wire;
use crate::common::clip::{SWIM, TINY};
use crate::common::process::{Server, numbered_film};
use crate::common::{Place, tus};

/// Size at which the service stores a part although more bytes follow.
const PART_BYTES: usize = 64 << 20;

async fn wait_until(event: &str, mut has_happened: impl AsyncFnMut() -> bool) {
    let begun = Instant::now();
    while !has_happened().await {
        assert!(begun.elapsed() < Duration::from_secs(120), "never: {event}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// Returns a film that takes more than one part. Players ignore the box at its end.
fn long_film() -> Vec<u8> {
    let n_bytes = PART_BYTES + (8 << 20);
    let size = u32::try_from(n_bytes + 8).unwrap().to_be_bytes();
    let padding = (0..n_bytes).map(|k| (k >> 9) as u8).collect::<Vec<_>>();
    [&TINY[..], &size, b"free", &padding].concat()
}

/// Asserts that the answer names the only footage, and that it has these bytes.
async fn assert_became(server: &Server, answer: &Response, film: &[u8]) {
    let footage = tus::footage(answer);
    let file = server.get(&format!("{footage}/file")).await;
    assert!(file.bytes().await.unwrap() == *film, "other bytes came out");
    let all = server.json("/v1/footage").await;
    assert_eq!(all["items"].as_array().unwrap().len(), 1, "{all}");
}

/// Stops the services, and asserts that only `n_folders` stored folders are left, and no drafts.
async fn assert_sound<const N: usize>(
    servers: Vec<Server>,
    machines: [&Place; N],
    n_folders: usize,
) {
    for server in servers {
        assert_eq!(server.terminate(), Some(0));
    }
    for machine in machines {
        let store = Store::open(machine.storage()).await.unwrap();
        let in_two_hours = SystemTime::now() + Duration::from_secs(7200);
        store.sweep(in_two_hours).await.unwrap();
        assert_eq!(machine.n_drafts() + machine.n_uploads(), 0);
        assert_eq!(store.check(now_ms()).await.unwrap(), Vec::<String>::new());
        let folders = store.blobs().folders().await.unwrap();
        assert_eq!(folders.len(), n_folders, "{folders:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn upload_goes_on_at_other_services_after_a_kill_and_a_cut() {
    let place = Place::shared();
    let machines = [place.second_machine(), place.second_machine()];
    let first = Server::start_at(&place);
    let [second, third] = machines.each_ref().map(Server::start_at);
    let film = long_film();
    let size = film.len();
    let path = tus::begin(&first.base, size).await;
    let sent = PART_BYTES + (4 << 20);
    let open = tus::send_some(&first.base, &path, 0, size, &film[..sent]).await;
    wait_until("a part is confirmed during the request", async || {
        tus::offset(&second.base, &path).await > 0
    })
    .await;
    first.kill();
    drop(open);

    let at = tus::offset(&second.base, &path).await;
    assert!((PART_BYTES..sent).contains(&at), "{at}");
    let cut = at + (size - at) / 2;
    drop(tus::send_some(&second.base, &path, at, size, &film[at..cut]).await);
    wait_until("the bytes before the cut are confirmed", async || {
        tus::offset(&third.base, &path).await == cut
    })
    .await;
    let last = tus::piece(&third.base, &path, cut, &film[cut..]);
    let last = last.send().await.unwrap();
    assert_eq!(last.status(), StatusCode::NO_CONTENT);
    assert_became(&second, &last, &film).await;
    assert_eq!(tus::offset(&second.base, &path).await, size);
    let [at_second, at_third] = &machines;
    assert_sound(vec![second, third], [&place, at_second, at_third], 1).await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn of_two_requests_for_the_same_bytes_the_faster_wins() {
    let place = Place::shared();
    let machine = place.second_machine();
    let (fast, slow) = (Server::start_at(&place), Server::start_at(&machine));
    let (film, half) = (&*SWIM, SWIM.len() / 2);
    let path = tus::begin(&fast.base, film.len()).await;
    let other = vec![7; half];
    let mut open = tus::send_some(&slow.base, &path, 0, half, &other[1..]).await;
    wait_until("the slow request has begun", async || {
        machine.n_drafts() == 1
    })
    .await;
    let quick = tus::piece(&fast.base, &path, 0, &film[..half]);
    assert_eq!(quick.send().await.unwrap().status(), StatusCode::NO_CONTENT);
    open.write_all(&other[..1]).await.unwrap();
    let mut status = [0; 12];
    open.read_exact(&mut status).await.unwrap();
    assert_eq!(String::from_utf8_lossy(&status), "HTTP/1.1 409");

    let beside = place.second_machine();
    let store = Store::open(beside.storage()).await.unwrap();
    let folders = store.blobs().folders().await.unwrap();
    let n_bytes = folders.iter().map(|folder| folder.n_bytes).sum::<u64>();
    assert_eq!(n_bytes, half as u64, "the slow request left its bytes");
    assert_eq!(tus::offset(&slow.base, &path).await, half);
    let rest = tus::piece(&slow.base, &path, half, &film[half..]);
    let rest = rest.send().await.unwrap();
    assert_eq!(rest.status(), StatusCode::NO_CONTENT);
    assert_became(&fast, &rest, film).await;
    assert_sound(vec![fast, slow], [&place, &machine], 1).await;
}

/// Creates an upload of a film, and stores the first bytes of it in three parts.
async fn begun(store: &Store, film: &[u8], n_bytes: usize) -> Upload {
    let mut upload = Upload {
        id: Uuid::now_v7(),
        owner: Owner::local(),
        name: "film".to_owned(),
        size_bytes: film.len() as i64,
        offset_bytes: 0,
        footage_id: None,
        expires_ms: now_ms() + 60_000,
    };
    store.create_upload(&upload).await.unwrap();
    let mut writer = store.open_upload(&upload).await.unwrap();
    for piece in film[..n_bytes].chunks(n_bytes.div_ceil(3).max(1)) {
        let piece = bytes::Bytes::copy_from_slice(piece);
        writer.append(&upload, piece).await.unwrap();
        writer.confirm(&mut upload, now_ms()).await.unwrap();
    }
    upload
}

/// Stores all bytes of an upload, as a service does that dies before it makes footage of them. Returns its path.
async fn left_complete(place: &Place, film: &[u8]) -> String {
    let machine = place.second_machine();
    let store = Store::open(machine.storage()).await.unwrap();
    let upload = begun(&store, film, film.len()).await;
    format!("/v1/uploads/{}", upload.id)
}

/// Starts a service that reaches the bucket through the wire.
fn start_behind(wire: &Wire, machine: &Place) -> Server {
    let flags = machine.server_flags();
    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
    let bucket = [("AWS_ENDPOINT_URL", wire.url.as_str())];
    Server::start_in(machine.data(), &flags, &bucket)
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn upload_finished_at_two_services_is_one_footage() {
    let place = Place::shared();
    let machine = place.second_machine();
    let wire = Wire::to(&std::env::var("AWS_ENDPOINT_URL").unwrap()).await;
    let first = Server::start_at(&place);
    let second = start_behind(&wire, &machine);
    let head = async |server: &Server, path: &str| {
        let answer = tus::request(&server.base, "HEAD", path).send().await;
        let answer = answer.unwrap();
        assert_eq!(answer.status(), StatusCode::OK);
        answer
    };

    // Both read the parts at the same time.
    let (film, other) = (numbered_film(1), numbered_film(2));
    let path = left_complete(&place, &film).await;
    let (one, two) = tokio::join!(head(&first, &path), head(&second, &path));
    assert_eq!(tus::footage(&one), tus::footage(&two));
    assert_became(&first, &two, &film).await;

    // The first finishes the upload and removes the parts while the second reads them.
    let path = left_complete(&place, &other).await;
    wire.open.send_replace(false);
    let (one, two) = tokio::join!(
        async {
            wait_until("the second has begun", async || machine.n_drafts() == 1).await;
            let one = head(&first, &path).await;
            wire.open.send_replace(true);
            one
        },
        head(&second, &path)
    );
    assert_eq!(tus::footage(&one), tus::footage(&two));
    assert_sound(vec![first, second], [&place, &machine], 2).await;
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn bytes_of_a_sender_that_is_gone_are_confirmed() {
    let place = Place::shared();
    let machine = place.second_machine();
    let wire = Wire::to(&std::env::var("AWS_ENDPOINT_URL").unwrap()).await;
    let first = Server::start_at(&place);
    let second = start_behind(&wire, &machine);
    let (film, half) = (&*SWIM, SWIM.len() / 2);
    let path = tus::begin(&first.base, film.len()).await;
    wire.open.send_replace(false);
    let all = tus::send_some(&second.base, &path, 0, half, &film[..half]).await;
    wait_until("the second has begun", async || machine.n_drafts() == 1).await;
    drop(all);
    // Time in which the service notices it, while the bucket is silent.
    tokio::time::sleep(Duration::from_secs(1)).await;
    wire.open.send_replace(true);
    wait_until("the bytes are confirmed", async || {
        tus::offset(&first.base, &path).await == half
    })
    .await;
    let ended = tus::request(&first.base, "DELETE", &path).send().await;
    assert_eq!(ended.unwrap().status(), StatusCode::NO_CONTENT);
    assert_sound(vec![first, second], [&place, &machine], 0).await;
}

#[tokio::test]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn folder_of_an_open_upload_is_not_swept() {
    let place = Place::shared();
    let store = Store::open(place.storage()).await.unwrap();
    let upload = begun(&store, &TINY, 0).await;
    // A service died between a part and its row.
    let draft = store.blobs().draft("part").unwrap();
    std::fs::write(draft.path().join("part"), b"12").unwrap();
    let folder = format!("uploads/{}", upload.id.simple());
    store.blobs().adopt(draft, &folder).await.unwrap();
    let folders = async || store.blobs().folders().await.unwrap().len();
    let in_two_hours = SystemTime::now() + Duration::from_secs(7200);
    store.sweep(in_two_hours).await.unwrap();
    assert_eq!(folders().await, 1);
    store.delete_upload(upload.id).await.unwrap();
    assert_eq!(folders().await, 0);
}

#[tokio::test]
#[ignore = "needs PostgreSQL and a bucket: make scale-test"]
async fn upload_that_lacks_a_part_is_not_taken_for_complete() {
    let place = Place::shared();
    let store = Store::open(place.storage()).await.unwrap();
    let upload = begun(&store, &TINY, TINY.len() - 1).await;
    let refused = store.draft_of_upload(&upload).await.err();
    assert!(
        matches!(refused, Some(Error::CorruptFile(_))),
        "{refused:?}"
    );
}
