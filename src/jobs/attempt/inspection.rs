//! The service's side of two short tasks of a child process: the check of received files, and the preview of an analysis
//! (docs/explanation/promises.md, "Bad input").

use std::os::unix::process::ExitStatusExt;
use std::time::Duration;

use rustix::process::Signal;
use tokio::time::timeout;
use uuid::Uuid;

use super::Film;
use super::message::{End, Task};
use super::process::{SubjectFiles, run_child};
use crate::jobs::analysis::preview::Preview;
use crate::jobs::{Context, Error, Listener};
use crate::media;
use crate::store::{Draft, Fetched};
use flockreel_core::analysis::Params;

/// Usual time limit of a check. Each media tool in it has a shorter one of its own. Free choice.
pub(in crate::jobs) const CHECK_TIME: Duration = Duration::from_secs(30);

/// Checks the files in a draft, and leaves their poster beside them. Returns the format of the film. If the future is
/// dropped, the child is killed.
pub(in crate::jobs) async fn inspect(context: &Context, draft: &Draft) -> Result<Film, Error> {
    let subject = SubjectFiles::default();
    match run(context, Task::Inspection, &subject, draft).await? {
        End::Inspected(film) => Ok(film),
        _ => Err(std::io::Error::other("a check of received files has no result").into()),
    }
}

/// Previews an analysis of the footage in `files`. If the future is dropped, the child is killed.
pub(in crate::jobs) async fn preview(
    context: &Context,
    files: Fetched,
    params: Params,
) -> Result<Preview, Error> {
    let draft = (context.store.blobs()).draft(&format!("preview.{}", Uuid::now_v7()))?;
    let (task, subject) = (Task::Preview(Box::new(params)), SubjectFiles::of(files));
    match run(context, task, &subject, &draft).await? {
        End::Previewed(preview) => Ok(preview),
        _ => Err(std::io::Error::other("a preview has no result").into()),
    }
}

/// Runs a child for at most the time of a check.
async fn run(
    context: &Context,
    task: Task,
    subject: &SubjectFiles,
    draft: &Draft,
) -> Result<End, Error> {
    let listener = Listener::new(&[]);
    let running = run_child(context, task, subject, draft, &listener, None);
    match timeout(context.check_time, running).await {
        // Files that crash their reader are refused. A signal from outside says nothing about them.
        Ok(Err(Error::Crashed(status))) if status.signal() != Some(Signal::KILL.as_raw()) => {
            Err(media::Error::Crashed {
                status: status.to_string(),
                stderr_tail: String::new(),
            }
            .into())
        }
        Ok(Err(Error::Crashed(_))) => Err(media::Error::Killed.into()),
        Ok(ended) => ended,
        Err(_) => Err(Error::TimeLimit),
    }
}
