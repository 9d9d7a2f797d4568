//! The worker's side of an attempt: starts the child process, follows it, and judges how it ended
//! (docs/explanation/promises.md, "Poison jobs"). Only `media/gate` and this file start processes.

use std::ffi::OsString;
use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::pin::pin;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use tokio::io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader};
use tokio::net::unix::pipe::{Receiver, Sender};
use tokio::task::spawn_blocking;
use tokio::time::timeout;
use tokio_util::task::AbortOnDropHandle;
use tracing::Instrument;
use uuid::Uuid;

use super::keep::{self, PartStore};
use super::message::{End, Failure, File, Job, Message, Order, Task};
use super::{Film, Part, Product};
use crate::jobs::error::FailedAttempt;
use crate::jobs::sample::FILM_NAME;
use crate::jobs::{Context, Error, Listener, Subject, refusal, subjects};
use crate::store::blobs::hex;
use crate::store::footage::{BACKGROUND, Footage, MASKS, SampleFootage, VIDEO};
use crate::store::jobs::finish::{Outcome, Source};
use crate::store::jobs::{Kind, Lease};
use crate::store::owners::OwnerFilter;
use crate::store::resources::{Library, Resource};
use crate::store::{Draft, Fetched};
use crate::{logging, media};
use flockreel_core::code::Code;
use flockreel_core::formats::library_dir;
use flockreel_core::formats::library_json::FootageSummary;

/// Time for a child to end after it was asked to, or after it closed its output. Then its group is killed. Free
/// choice; a computation looks several times per second whether it is to stop.
const STOP_GRACE: Duration = Duration::from_secs(5);
/// Maximum length of a line of a child, bytes. Free choice; a summary has a few kilobytes.
const MAX_LINE_BYTES: u64 = 4 << 20;
/// What the standard library says before it aborts a process that has run out of memory.
const OUT_OF_MEMORY: &[u8] = b"memory allocation of ";

/// The files that an attempt works on. Copies are removed on drop.
#[derive(Default)]
pub(super) struct SubjectFiles {
    /// Ids of the footage or libraries; none for a sample, which is made of nothing.
    ids: Vec<Uuid>,
    files: Vec<Fetched>,
    /// Files of the footage from which the library of a views job was made.
    film: Option<Fetched>,
    footage: Option<FootageSummary>,
    /// Parts that earlier attempts have kept.
    parts: Vec<(u32, Fetched)>,
}

/// Computes a job in a child process and stores its files. If the future is dropped, the child is killed.
pub(in crate::jobs) async fn compute(
    context: &Context,
    lease: &Lease,
    listener: &Listener,
) -> Result<Outcome, Error> {
    let subject = tokio::select! {
        fetched = fetch_subject(context, lease) => fetched?,
        () = listener.stopped() => return Err(Error::Cancelled),
    };
    let blobs = context.store.blobs();
    let draft = blobs.draft(&format!("{}.{}", lease.job_id, lease.fence))?;
    let (product, files) = match compute_in(context, lease, listener, &subject, &draft).await {
        Ok(done) => done,
        Err(error) => {
            // A draft can have thousands of files.
            spawn_blocking(move || drop(draft)).await.ok();
            return Err(error);
        }
    };
    let source = match (product.film, subject.ids.first()) {
        (Some(film), _) => Source::Sample(film.into()),
        (None, Some(id)) => Source::Resource(*id),
        (None, None) => return Err(io::Error::other("a sample has no film").into()),
    };
    // The fence in the name prevents two attempts from sharing a folder.
    let (kind, result_id, fence) = (lease.kind.result_kind(), lease.result_id, lease.fence);
    let folder = format!("{}/{result_id}.{fence}", kind.plural());
    blobs.adopt(draft, &folder).await?;
    Ok(Outcome {
        source,
        folder,
        files: files.into_iter().map(Into::into).collect(),
        params: product.params,
        summary: product.summary,
    })
}

/// Finds what a job works on, and makes its files local.
async fn fetch_subject(context: &Context, lease: &Lease) -> Result<SubjectFiles, Error> {
    let mut found = SubjectFiles::default();
    for subject in subjects(lease.kind, &lease.input)? {
        found.add(context, lease, subject).await?;
    }
    found.parts = keep::fetch(context, lease).await?;
    Ok(found)
}

impl SubjectFiles {
    /// Returns files that belong to no job.
    pub(super) fn of(files: Fetched) -> SubjectFiles {
        SubjectFiles {
            files: vec![files],
            ..SubjectFiles::default()
        }
    }

    async fn add(
        &mut self,
        context: &Context,
        lease: &Lease,
        subject: Subject,
    ) -> Result<(), Error> {
        let store = &context.store;
        let files = match subject {
            Subject::Footage(id) => {
                let row = row::<Footage>(context, id.0).await?;
                self.footage = Some(FootageSummary {
                    sha256: hex(&row.sha256),
                    n_bytes: row.size_bytes.unsigned_abs(),
                });
                store
                    .fetch(&row.folder, &[VIDEO, BACKGROUND, MASKS])
                    .await?
            }
            Subject::Library(id) => {
                let row = row::<Library>(context, id.0).await?;
                let names = if lease.kind == Kind::Views {
                    let footage = self::row::<Footage>(context, row.footage_id).await?;
                    self.film = Some(store.fetch(&footage.folder, &[VIDEO]).await?);
                    &library_dir::MEASUREMENT[..]
                } else {
                    &library_dir::FILES[..]
                };
                store.fetch(&row.folder, names).await?
            }
        };
        self.ids.push(subject.id());
        self.files.push(files);
        Ok(())
    }
}

async fn row<R: Resource>(context: &Context, id: Uuid) -> Result<R::Row, Error> {
    let row = context.store.resource::<R>(id, &OwnerFilter::All).await?;
    row.ok_or(Error::InputAbsent(id))
}

/// Runs the child, which leaves its files in the draft.
async fn compute_in(
    context: &Context,
    lease: &Lease,
    listener: &Listener,
    subject: &SubjectFiles,
    draft: &Draft,
) -> Result<(Product, Vec<File>), Error> {
    let job = Job {
        id: lease.job_id,
        attempt: lease.attempt,
        trace_id: lease.trace_id(),
        kind: lease.kind.name().to_owned(),
        input: lease.input.clone(),
        footage: subject.footage.clone(),
    };
    let parts = Some(PartStore {
        context,
        lease,
        draft,
    });
    match run_child(context, Task::Attempt(job), subject, draft, listener, parts).await? {
        End::Done(product, files) => Ok((product, files)),
        _ => Err(io::Error::other("an attempt has no result").into()),
    }
}

/// Runs the child in the folder of the draft, and returns how it ended. Stores the parts that it makes. Fails with the
/// error that it reports.
pub(super) async fn run_child(
    context: &Context,
    task: Task,
    subject: &SubjectFiles,
    draft: &Draft,
    listener: &Listener,
    parts: Option<PartStore<'_>>,
) -> Result<End, Error> {
    let tools = spawn_blocking(media::found_tools).await;
    let order = Order {
        task,
        subjects: subject.files.iter().map(path).collect(),
        film: subject.film.as_ref().map(path).unwrap_or_default(),
        parts: (subject.parts.iter())
            .map(|(number, files)| Part {
                number: *number,
                folder: path(files),
            })
            .collect(),
        threads: context.threads,
        memory_bytes: context.memory_bytes,
        tools: tools.map_err(io::Error::other)??,
    };
    let command = command(&context.attempt_program, draft.path());
    let group = spawn_blocking(move || media::ProcessGroup::start_leashed(command)).await;
    let group = group.map_err(io::Error::other)??;
    let grace = STOP_GRACE.min(context.lease);
    match follow(group, &order, (listener, parts), grace).await? {
        End::Failed(failure) => Err(Error::Attempt(failed(failure, draft))),
        end => Ok(end),
    }
}

fn path(files: &Fetched) -> PathBuf {
    files.path().to_owned()
}

/// Returns the command of a child. It inherits no environment, which may hold secrets.
fn command((program, arguments): &(PathBuf, Vec<OsString>), folder: &Path) -> Command {
    let mut command = Command::new(program);
    command
        .arg0("flockreel")
        .args(arguments)
        .args(logging::arguments())
        .arg("attempt")
        .arg(folder)
        .env_clear()
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Gives the order, passes on progress, stores parts, and returns how the attempt ended. Kills the child if it does not
/// end within `grace` after it was asked to stop.
async fn follow(
    mut group: media::ProcessGroup,
    order: &Order,
    (listener, parts): (&Listener, Option<PartStore<'_>>),
    grace: Duration,
) -> Result<End, Error> {
    let (Some(stdin), Some(stdout), Some(stderr)) = group.take_pipes() else {
        return Err(io::Error::other("an attempt has no pipes").into());
    };
    let stdin = Sender::from_owned_fd(stdin.into())?;
    let order = serde_json::to_string(order).map_err(io::Error::other)?;
    let feeding = tokio::spawn(feed(stdin, order, listener.clone()));
    let feeding = AbortOnDropHandle::new(feeding);
    let log = tokio::spawn(relay_log(Receiver::from_owned_fd(stderr.into())?).in_current_span());
    let stdout = Receiver::from_owned_fd(stdout.into())?;
    let mut messages = pin!(read(stdout, listener, parts));
    let end = tokio::select! {
        end = &mut messages => Ok(end),
        () = listener.stopped() => timeout(grace, &mut messages).await,
    };
    drop(feeding);
    // A child that did not end in time has no more.
    let patience = end.as_ref().map_or(Duration::ZERO, |_| grace);
    let status = spawn_blocking(move || group.end_within(patience)).await;
    let status = status.map_err(io::Error::other)??;
    let is_out_of_memory = timeout(grace, log).await;
    match end.ok().transpose()?.flatten() {
        Some(end) => Ok(end),
        None if listener.is_cancelled() => Err(Error::Cancelled),
        None => Err(verdict(status, matches!(is_out_of_memory, Ok(Ok(true))))),
    }
}

/// Writes the order, then keeps stdin open until the child is to stop.
async fn feed(mut stdin: Sender, order: String, listener: Listener) {
    let line = order + "\n";
    // If the child is gone, its exit tells why.
    stdin.write_all(line.as_bytes()).await.ok();
    listener.stopped().await;
}

/// Passes on progress, stores parts, and returns the end of the attempt, or `None` if the child does not tell it. Fails if
/// a part could not be stored.
async fn read(
    stdout: Receiver,
    listener: &Listener,
    parts: Option<PartStore<'_>>,
) -> Result<Option<End>, Error> {
    let mut stdout = BufReader::new(stdout);
    while let Some(line) = next_line(&mut stdout).await {
        let message = serde_json::from_slice(&line).inspect_err(
            |error| tracing::warn!(%error, "the process of a job sent an unreadable line"),
        );
        let Ok(message) = message else {
            break;
        };
        match message {
            Message::Progress(stage, fraction) => listener.report(&stage, fraction),
            Message::Decoded(n_frames, took_s) => {
                let took = Duration::try_from_secs_f64(took_s).unwrap_or_default();
                listener.count_decoded(n_frames, took);
            }
            Message::Part(number, files) => {
                if let Some(parts) = &parts {
                    parts.keep(number, files, listener).await?;
                }
            }
            Message::End(end) => return Ok(Some(end)),
        }
    }
    Ok(None)
}

/// Passes the log of the child on. Returns whether the child ran out of memory.
async fn relay_log(stderr: Receiver) -> bool {
    let (mut stderr, mut is_out_of_memory) = (BufReader::new(stderr), false);
    while let Some(line) = next_line(&mut stderr).await {
        is_out_of_memory |= line.starts_with(OUT_OF_MEMORY);
        logging::relay(&String::from_utf8_lossy(&line));
    }
    is_out_of_memory
}

/// Returns the next line without its end, at most [`MAX_LINE_BYTES`] of it; `None` at the end.
async fn next_line(reader: &mut BufReader<Receiver>) -> Option<Vec<u8>> {
    let mut line = Vec::new();
    let mut part = reader.take(MAX_LINE_BYTES);
    let n_bytes = part.read_until(b'\n', &mut line).await.ok()?;
    line.pop_if(|byte| *byte == b'\n');
    (n_bytes > 0).then_some(line)
}

/// Returns why a child ended without a message.
fn verdict(status: ExitStatus, is_out_of_memory: bool) -> Error {
    if is_out_of_memory {
        Error::MemoryLimit
    } else {
        Error::Crashed(status)
    }
}

/// Returns the failure of a child with the picture that it left.
fn failed(failure: Failure, draft: &Draft) -> FailedAttempt {
    FailedAttempt {
        code: Code::from_name(&failure.code).unwrap_or(Code::Internal),
        sentence: failure.sentence,
        is_transient: failure.is_transient,
        mends: failure.mends,
        picture: std::fs::read(draft.path().join(refusal::FILE_NAME)).ok(),
    }
}

impl From<Film> for SampleFootage {
    fn from(film: Film) -> SampleFootage {
        SampleFootage {
            name: FILM_NAME,
            width: film.width,
            height: film.height,
            fps: film.fps,
            n_frames: film.n_frames,
        }
    }
}
