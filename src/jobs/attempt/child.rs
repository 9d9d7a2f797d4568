//! The process of an attempt, of a check of received files, or of a preview: reads its order, computes, and reports the end. It stops
//! when its stdin ends, and its parent kills it if it does not.

use std::io::{self, BufRead, BufReader, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use rustix::process::{
    Resource, Rlimit, getpriority_process, getrlimit, setpriority_process, setrlimit,
};

use super::message::{End, Job, Message, Order, Task};
use super::{Attempt, Reporter};
use crate::jobs::analysis::preview;
use crate::jobs::{self, Error, admit, refusal};
use crate::media;
use crate::store::blobs::seal_folder;
use crate::store::jobs::Kind;

/// Increase of the nice value of an attempt, which its media tools inherit. At 10, a job gets about a tenth of the
/// processor time of a request under load.
const NICE_INCREMENT: i32 = 10;
/// Points that the kernel adds to the score of an attempt when it chooses a process to kill because the memory of
/// the machine has run out: half of the scale, so that it spares the service.
const OOM_SCORE: &str = "500";

/// Runs one attempt: reads the order from stdin, leaves files in `folder`, and writes messages to stdout. Fails if
/// there is no order or no thread.
pub fn run(folder: &Path) -> io::Result<()> {
    offer_to_be_killed();
    let mut stdin = BufReader::new(io::stdin());
    let mut line = String::new();
    stdin.read_line(&mut line)?;
    let order: Order = serde_json::from_str(&line)?;
    // A person waits for a preview, as for a request.
    if !matches!(order.task, Task::Preview(_)) {
        yield_to_requests();
    }
    limit_memory(order.memory_bytes)?;
    media::adopt_tools(order.tools.clone());
    let reporter = Arc::new(Reporter::default());
    stop_at_the_end_of(stdin, reporter.clone())?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(order.threads);
    let pool = pool.build().map_err(io::Error::other)?;
    let result = survive(|| {
        pool.install(|| match &order.task {
            Task::Attempt(job) => span_of(job).in_scope(|| {
                compute(&Attempt {
                    reporter: &reporter,
                    folder,
                    order: &order,
                    job,
                })
            }),
            Task::Inspection => admit::inspect(folder).map(End::Inspected),
            Task::Preview(params) => {
                preview::compute(order.subject(), params, &*reporter).map(End::Previewed)
            }
        })
    });
    reporter.send(&Message::End(result.unwrap_or_else(|error| {
        leave_picture(&error, folder);
        End::Failed((&error).into())
    })));
    Ok(())
}

fn span_of(job: &Job) -> tracing::Span {
    tracing::info_span!(
        "job",
        job.id = %job.id,
        job.kind = job.kind,
        attempt = job.attempt,
        trace_id = job.trace_id
    )
}

/// Returns what `work` returns, and an error if it panics.
fn survive<T>(work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or(Err(Error::Panicked))
}

fn compute(attempt: &Attempt) -> Result<End, Error> {
    let kind = Kind::try_from(attempt.job.kind.clone())?;
    let product = jobs::run(kind, &attempt.job.input, attempt)?;
    let files = seal_folder(attempt.folder)?;
    Ok(End::Done(
        product,
        files.into_iter().map(Into::into).collect(),
    ))
}

/// Leaves the picture of a failure for the worker. The failure counts even without it.
fn leave_picture(error: &Error, folder: &Path) {
    let Some(picture) = error.picture() else {
        return;
    };
    if let Err(error) = std::fs::write(folder.join(refusal::FILE_NAME), picture) {
        tracing::warn!(%error, "the picture of a refusal could not be written");
    }
}

/// Lowers the priority of this process, so that requests are answered first. Failure is ignored: the job then runs as
/// the service does.
fn yield_to_requests() {
    let usual = getpriority_process(None).unwrap_or(0);
    if let Err(error) = setpriority_process(None, usual + NICE_INCREMENT) {
        tracing::debug!(%error, "the priority of a job could not be lowered");
    }
}

/// Makes this process the first to be killed when memory runs out. Failure is ignored.
fn offer_to_be_killed() {
    if let Err(error) = std::fs::write("/proc/self/oom_score_adj", OOM_SCORE) {
        tracing::debug!(%error, "the job could not be marked for the kernel");
    }
}

/// Limits the memory that this process may write to. The limit is a soft one, so that media tools can have others.
fn limit_memory(bytes: u64) -> io::Result<()> {
    let maximum = getrlimit(Resource::Data).maximum;
    let limit = Rlimit {
        current: Some(maximum.map_or(bytes, |maximum| maximum.min(bytes))),
        maximum,
    };
    Ok(setrlimit(Resource::Data, limit)?)
}

/// Stops the computation when the worker closes the other end of stdin.
fn stop_at_the_end_of(
    mut stdin: impl Read + Send + 'static,
    reporter: Arc<Reporter>,
) -> io::Result<()> {
    let watch = move || {
        // An error is an end, too.
        io::copy(&mut stdin, &mut io::sink()).ok();
        reporter.stop();
    };
    std::thread::Builder::new().spawn(watch).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panic_of_a_computation_is_an_error() {
        let failed = survive::<()>(|| panic!("panic of a test"));
        assert!(matches!(failed, Err(Error::Panicked)));
    }
}
