//! Pictures of footage: the poster, made when footage is taken in.

use crate::common::TestApp;
use crate::common::app::code_of;
use crate::common::clip::{SWIM, TINY};
use crate::common::pictures::zip_of_grays;
use crate::common::results::store_film;

#[tokio::test]
async fn every_kind_of_footage_has_a_poster() {
    let app = TestApp::idle().await;
    for (film, width) in [
        (&TINY[..], 64),
        (&SWIM[..], 320),
        (&zip_of_grays(12)[..], 64),
    ] {
        let path = format!("/v1/footage/{}/poster.jpg", app.upload(film).await);
        let answer = app.get(&path).send().await.unwrap();
        assert_eq!(answer.status(), 200);
        assert_eq!(answer.headers()["content-type"], "image/jpeg");
        assert!(answer.headers().contains_key("etag"));
        let picture = image::load_from_memory(&answer.bytes().await.unwrap());
        assert_eq!(picture.unwrap().width(), width);
    }
    app.assert_sound().await;
}

#[tokio::test]
async fn footage_without_a_poster_answers_not_found() {
    let app = TestApp::idle().await;
    let id = store_film(&app, &TINY, false).await;
    let answer = app.get(&format!("/v1/footage/{id}/poster.jpg"));
    assert_eq!(
        code_of(answer.send().await.unwrap(), 404).await,
        "not_found"
    );
    app.assert_sound().await;
}
