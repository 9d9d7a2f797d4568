//! The only module that starts a media tool (docs/explanation/promises.md, "Confined media tools"). Every
//! child gets arguments as a list, an empty environment, allow-lists, a sandbox, a time limit and a stall
//! limit. Dropping its handle kills and reaps the whole process group.
//!
//! The time limit counts only while we wait for the child and the child has a processor or waits for
//! something else. A slow caller and a busy machine do not use up a decoder's time. The limit on processor time
//! stops a child that computes forever.

mod group; // a process group
mod processor; // processor time of a process

use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::path::PathBuf;
use std::process::{self, ChildStdin, ChildStdout, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::process::{Pid, getpriority_process, setpriority_process};

pub use group::ProcessGroup;

use super::error::Error;
use super::exit::{Exit, hide_paths};
use super::invocation::Invocation;
use super::sandbox::{self, Policy};
use processor::{processor_time, processor_wait};

/// Length of the kept end of a child's stderr, bytes. Free choice.
const STDERR_TAIL_BYTES: usize = 8 << 10;
/// Requested size of each pipe, bytes.
const PIPE_BYTES: usize = 1 << 20;

/// Time for a decoder to exit once its output is closed. Free choice. An encoder may rewrite the whole file
/// to move the index to the front, so it gets all of its remaining time.
const EXIT_TIME: Duration = Duration::from_secs(30);

/// A running child. Dropping it kills and reaps its whole group.
pub(super) struct Child {
    group: ProcessGroup,
    stdin: Option<ChildStdin>,
    stdout: Option<ChildStdout>,
    /// Thread that returns the end of stderr.
    stderr: Option<JoinHandle<String>>,
    time_left: Duration,
    /// End of the time limit by the wall clock, for `read_some`.
    deadline: Instant,
    stall_limit: Duration,
    /// Time in which the child waited for a processor, as far as it was added to the limits.
    credited: Duration,
    /// Limit of the processor time of all threads.
    processor_limit: Duration,
    /// Files given to the child. Their paths are removed from its messages, because users do not know them.
    files: Vec<PathBuf>,
}

impl Child {
    /// Starts a child that reads no input and writes to us.
    pub(super) fn reading(invocation: Invocation<'_>) -> Result<Child, Error> {
        Child::start(invocation, Stdio::null())
    }

    /// Starts a child that reads from us and writes a file.
    pub(super) fn writing(invocation: Invocation<'_>) -> Result<Child, Error> {
        let child = Child::start(invocation, Stdio::piped())?;
        if let Some(stdin) = &child.stdin {
            // A blocking write could not be abandoned at the time limit.
            let flags = rustix::fs::fcntl_getfl(stdin);
            flags
                .and_then(|flags| {
                    rustix::fs::fcntl_setfl(stdin, flags | rustix::fs::OFlags::NONBLOCK)
                })
                .map_err(|e| Error::io("preparing the encoder's pipe")(e.into()))?;
            enlarge_pipe(stdin);
        }
        Ok(child)
    }

    /// Starts a program in the layers that both the invocation and the tool allow.
    fn start(invocation: Invocation<'_>, stdin: Stdio) -> Result<Child, Error> {
        let failed = Error::io("starting the media tool");
        let tool = invocation.tool;
        let policy = Policy {
            layers: invocation.policy.layers.and(tool.layers),
            ..invocation.policy.clone()
        };
        let mut command = command(&invocation);
        command.stdin(stdin);
        sandbox::apply(&mut command, &policy, &tool.program_files).map_err(&failed)?;
        let mut group = ProcessGroup::start(command).map_err(failed)?;
        inherit_niceness(group.id());
        let (stdin, stdout, stderr) = group.take_pipes();
        if let Some(stdout) = &stdout {
            enlarge_pipe(stdout);
        }
        Ok(Child {
            group,
            stdin,
            stdout,
            stderr: stderr.map(|pipe| std::thread::spawn(|| read_tail(pipe))),
            time_left: invocation.time_limit,
            deadline: Instant::now() + invocation.time_limit,
            stall_limit: invocation.stall_limit,
            credited: Duration::ZERO,
            processor_limit: Duration::from_secs(policy.cpu_s),
            files: [policy.input, policy.output]
                .into_iter()
                .flatten()
                .collect(),
        })
    }

    /// Fills `buffer` from the child's output. Returns fewer bytes than its length only at the end of the
    /// output.
    pub(super) fn read_full(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        let Some(mut stdout) = self.stdout.take() else {
            return Ok(0);
        };
        let mut deadline = Instant::now() + self.stall_limit;
        let mut n_read = 0;
        while n_read < buffer.len() {
            self.wait_for(stdout.as_fd(), PollFlags::IN, &mut deadline)?;
            match stdout.read(&mut buffer[n_read..]) {
                Ok(0) => break,
                Ok(n) => n_read += n,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(Error::io("reading from the media tool")(error)),
            }
        }
        self.stdout = Some(stdout);
        Ok(n_read)
    }

    /// Reads the available output of the child; 0 at its end. Here the time limit counts all the time,
    /// because a child with endless output never makes us wait.
    pub(super) fn read_some(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        while Instant::now() > self.deadline {
            self.extend_limits()?;
        }
        let Some(mut stdout) = self.stdout.take() else {
            return Ok(0);
        };
        self.wait_for(
            stdout.as_fd(),
            PollFlags::IN,
            &mut (Instant::now() + self.stall_limit),
        )?;
        let n_read = stdout
            .read(buffer)
            .map_err(Error::io("reading from the media tool"))?;
        self.stdout = Some(stdout);
        Ok(n_read)
    }

    /// Writes `bytes` to the child. If the child has died, returns the reason.
    pub(super) fn write_all(&mut self, mut bytes: &[u8]) -> Result<(), Error> {
        let Some(mut stdin) = self.stdin.take() else {
            return Err(Error::BadOutput("a frame after the last"));
        };
        let mut deadline = Instant::now() + self.stall_limit;
        while !bytes.is_empty() {
            match stdin.write(bytes) {
                Ok(n) => bytes = &bytes[n..],
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock => {
                        self.wait_for(stdin.as_fd(), PollFlags::OUT, &mut deadline)?;
                    }
                    io::ErrorKind::Interrupted => {}
                    io::ErrorKind::BrokenPipe => {
                        drop(stdin);
                        return Err(self.exit_error());
                    }
                    _ => return Err(Error::io("writing to the media tool")(error)),
                },
            }
        }
        self.stdin = Some(stdin);
        Ok(())
    }

    /// Closes the child's input, waits for its exit and returns it.
    pub(super) fn finish(mut self) -> Result<Exit, Error> {
        self.wait_for_exit()
    }

    /// Returns why a child closed its input early.
    fn exit_error(&mut self) -> Error {
        match self.wait_for_exit().and_then(Exit::check) {
            Err(error) => error,
            Ok(exit) => Error::Crashed {
                status: "it closed its input early".into(),
                stderr_tail: exit.stderr_tail,
            },
        }
    }

    fn wait_for_exit(&mut self) -> Result<Exit, Error> {
        let time_limit = match self.stdin.take() {
            Some(_) => self.time_left,
            None => EXIT_TIME.max(self.stall_limit),
        };
        self.stdout = None;
        let watching = Error::io("watching the media tool");
        let pidfd = self.group.as_fd().try_clone_to_owned().map_err(watching)?;
        let mut deadline = Instant::now() + time_limit;
        self.wait_for(pidfd.as_fd(), PollFlags::IN, &mut deadline)?;
        let used = processor_time(self.group.id());
        let status = self
            .group
            .reap()
            .map_err(Error::io("reaping the media tool"))?;
        let stderr_tail = self.stderr.take().map(|thread| thread.join());
        let stderr_tail = stderr_tail.and_then(Result::ok).unwrap_or_default();
        Ok(Exit {
            status,
            used_up_processor_time: used >= self.processor_limit,
            stderr_tail: hide_paths(&self.files, stderr_tail),
        })
    }

    /// Waits until `fd` is ready, at most until `deadline` and within the remaining time. Both move by the time
    /// in which the child waited for a processor.
    fn wait_for(
        &mut self,
        fd: BorrowedFd<'_>,
        flags: PollFlags,
        deadline: &mut Instant,
    ) -> Result<(), Error> {
        loop {
            let start = Instant::now();
            let wait = self
                .time_left
                .min(deadline.saturating_duration_since(start));
            let timeout = Timespec {
                tv_sec: wait.as_secs() as i64,
                tv_nsec: i64::from(wait.subsec_nanos()),
            };
            let n_ready =
                rustix::event::poll(&mut [PollFd::from_borrowed_fd(fd, flags)], Some(&timeout));
            self.time_left = self.time_left.saturating_sub(start.elapsed());
            match n_ready {
                Ok(0) => *deadline += self.extend_limits()?,
                Ok(_) => return Ok(()),
                Err(rustix::io::Errno::INTR) => {}
                Err(errno) => return Err(Error::io("waiting for the media tool")(errno.into())),
            }
        }
    }

    /// Extends the limits by the time in which the child waited for a processor, at most by the stall limit.
    /// Time that was counted before is not counted again. Returns the extension. Fails with
    /// [`Error::TimeLimit`] if the child waited less than a tenth of the stall limit: it was slow by itself.
    fn extend_limits(&mut self) -> Result<Duration, Error> {
        let waited = processor_wait(self.group.id()).saturating_sub(self.credited);
        let extension = waited.min(self.stall_limit);
        if extension.is_zero() || extension < self.stall_limit / 10 {
            return Err(Error::TimeLimit);
        }
        self.credited += extension;
        self.time_left += extension;
        self.deadline += extension;
        Ok(extension)
    }
}

fn command(invocation: &Invocation<'_>) -> process::Command {
    let mut command = process::Command::new(&invocation.tool.path);
    command
        .args(["-v", "error"])
        .args(&invocation.args)
        .env_clear()
        .env("LC_ALL", "C")
        // Each arena reserves address space, which the sandbox limits.
        .env("MALLOC_ARENA_MAX", "4")
        .current_dir("/")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    if invocation.lists_libraries {
        command.env("LD_TRACE_LOADED_OBJECTS", "1");
    }
    command
}

/// Gives the child the niceness of the calling thread; another thread starts the child. A decoder works for
/// minutes, so it runs at the low priority of the job that needs it and yields to requests
/// (docs/explanation/promises.md, "Overload"). A tool that a request waits for, such as the check of an
/// upload, is started by a thread of normal priority.
///
/// Sets the niceness of its autogroup, too. The child has its own session, and Linux gives each session its
/// own share of the processor, regardless of the niceness within. Failure is ignored: the child then runs at
/// normal priority.
fn inherit_niceness(child: Pid) {
    if let Ok(niceness @ 1..) = getpriority_process(None) {
        setpriority_process(Some(child), niceness).ok();
        let group = format!("/proc/{}/autogroup", child.as_raw_nonzero());
        std::fs::write(group, niceness.to_string()).ok();
    }
}

/// Enlarges a pipe, which reduces context switches. Failure is ignored: it only costs speed.
fn enlarge_pipe(pipe: impl AsFd) {
    rustix::pipe::fcntl_setpipe_size(pipe, PIPE_BYTES).ok();
}

/// Reads to the end and returns the last [`STDERR_TAIL_BYTES`].
fn read_tail(mut pipe: impl Read) -> String {
    let mut kept = Vec::new();
    let mut chunk = [0; 4096];
    while let Ok(n) = pipe.read(&mut chunk) {
        if n == 0 {
            break;
        }
        kept.extend_from_slice(&chunk[..n]);
        let surplus = kept.len().saturating_sub(STDERR_TAIL_BYTES);
        kept.drain(..surplus);
    }
    String::from_utf8_lossy(&kept).into_owned()
}
