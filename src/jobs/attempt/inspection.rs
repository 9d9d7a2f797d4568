//! The service's side of a check of received files, which a child process parses
//! (docs/explanation/promises.md, "Bad input").

use std::os::unix::process::ExitStatusExt;
use std::time::Duration;

use rustix::process::Signal;
use tokio::time::timeout;

use super::Film;
use super::message::End;
use super::process::{SubjectFiles, run_child};
use crate::jobs::{Context, Error, Listener};
use crate::media;
use crate::store::Draft;

/// Usual time limit of a check. Each media tool in it has a shorter one of its own. Free choice.
pub(in crate::jobs) const CHECK_TIME: Duration = Duration::from_secs(30);

/// Checks the files in a draft, and leaves their poster beside them. Returns the format of the film. If the future is
/// dropped, the child is killed.
pub(in crate::jobs) async fn inspect(context: &Context, draft: &Draft) -> Result<Film, Error> {
    let (listener, subject) = (Listener::new(&[]), SubjectFiles::default());
    let running = run_child(context, None, &subject, draft, &listener, None);
    match timeout(context.check_time, running).await {
        Ok(Ok(End::Inspected(film))) => Ok(film),
        Ok(Ok(_)) => Err(std::io::Error::other("a check of received files has no result").into()),
        // Files that crash their reader are refused. A signal from outside says nothing about them.
        Ok(Err(Error::Crashed(status))) if status.signal() != Some(Signal::KILL.as_raw()) => {
            Err(media::Error::Crashed {
                status: status.to_string(),
                stderr_tail: String::new(),
            }
            .into())
        }
        Ok(Err(Error::Crashed(_))) => Err(media::Error::Killed.into()),
        Ok(Err(error)) => Err(error),
        Err(_) => Err(Error::TimeLimit),
    }
}
