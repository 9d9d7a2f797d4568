//! Sends every third file of the corpus of bad films to the service (docs/explanation/promises.md,
//! "Bad input"). Each is answered in time with an allowed code, never with a 5xx status, and leaves no data.
//! Damaged films that are accepted end as jobs, which do not crash their worker.

use std::time::{Duration, Instant};

use flockreel_core::code::Code;
use serde_json::{Value, json};

use crate::common::TestApp;
use crate::common::film::Films;
use crate::media::corpus::{Case, corpus};

/// Time limit of one response.
const LONGEST: Duration = Duration::from_secs(30);

#[tokio::test(flavor = "multi_thread")]
async fn every_bad_film_is_answered_with_its_code() {
    let films = Films::new();
    let cases = corpus(&films);
    let app = TestApp::working().await;
    let (mut faults, mut taken) = (Vec::new(), Vec::new());
    // `media::traced` reads the whole corpus; a third is enough to test the service.
    for case in cases.iter().step_by(3) {
        let start = Instant::now();
        let film = std::fs::read(&case.path).unwrap();
        let answer = app.post("/v1/footage").body(film).send().await.unwrap();
        let status = answer.status().as_u16();
        let said: Value = answer.json().await.unwrap();
        let tells_where = said.to_string().contains(app.folder().to_str().unwrap());
        if start.elapsed() > LONGEST || !is_expected(case, status, &said) || tells_where {
            faults.push(format!("{}: {status} {said}", case.path.display()));
        }
        if status == 201 {
            taken.push((case.path.clone(), said["id"].clone()));
        }
    }
    assert_eq!(faults, Vec::<String>::new());
    let mut jobs = Vec::new();
    for (film, footage) in taken {
        let accepted = app
            .accept("/v1/analyses", json!({"footage_id": footage}))
            .await;
        jobs.push((film, accepted["job_id"].clone()));
    }
    for (film, id) in jobs {
        println!("waiting for the job of {}", film.display());
        let job = app.ended_job(&id).await;
        let code = job["error"]["code"].as_str().unwrap_or("none");
        assert!(!["internal", "crashed_worker"].contains(&code), "{job}");
    }
    app.assert_sound().await;
}

/// Returns true if the response is allowed. A damaged film may be accepted, because its damage is found only
/// when it is decoded.
fn is_expected(case: &Case, status: u16, said: &Value) -> bool {
    let code = said["code"].as_str().and_then(Code::from_name);
    match status {
        200 | 201 => case.may_be_good || case.codes.contains(&Code::Truncated),
        422 => code.is_some_and(|code| case.codes.contains(&code)),
        _ => false,
    }
}
