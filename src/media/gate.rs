//! The only module that starts a media tool (docs/explanation/promises.md, "Confined media tools"). Every
//! child gets arguments as a list, an empty environment, allow-lists, a sandbox, a time limit and a stall
//! limit. Dropping its handle kills and reaps the whole process group.
//!
//! The time limit counts only while we wait for the child. A slow caller does not use up its decoder's time.

use std::ffi::OsString;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::process::{self, ChildStdin, ChildStdout, Stdio};
use std::sync::{Mutex, OnceLock, PoisonError, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::process::{Pid, PidfdFlags, Signal};

use super::end::{self, End};
use super::error::Error;
use super::limits::Limits;
use super::sandbox::{self, Cage};
use super::tools::{self, Place, Tool};

/// Kept length of a child's stderr, bytes. Free choice.
const COMPLAINT_BYTES: usize = 8 << 10;
/// Requested size of each pipe, bytes.
const PIPE_BYTES: usize = 1 << 20;

/// Time for a decoder to exit once its output is closed. Free choice. An encoder may rewrite the whole file
/// to move the index to the front, so it gets all of its remaining time.
const END_TIME: Duration = Duration::from_secs(30);

/// A program to start, with its limits.
pub(super) struct Order {
    tool: Tool,
    args: Vec<OsString>,
    /// Whether the loader lists the program's libraries instead of running the program.
    lists_libraries: bool,
    cage: Cage,
    time: Duration,
    stall: Duration,
}

impl Order {
    /// Makes an order for work on `n_frames` frames (0 for reading headers). The child may open no file.
    pub(super) fn new(tool: Tool, args: Vec<OsString>, limits: &Limits, n_frames: usize) -> Order {
        let time = match n_frames {
            0 => limits.probe_time,
            n => limits.work_time(n),
        };
        Order {
            tool,
            args,
            lists_libraries: false,
            cage: Cage {
                layers: limits.layers,
                memory_bytes: limits.max_memory_bytes,
                cpu_s: (time.as_secs() + 1) * n_cores(),
                file_bytes: 0,
                input: None,
                output: None,
            },
            time,
            stall: limits.stall_time.min(time),
        }
    }

    /// Adds `more` to the time limit.
    pub(super) fn with_more_time(mut self, more: Duration) -> Order {
        self.time += more;
        self
    }

    /// Allows the child to read a file.
    pub(super) fn with_input(mut self, path: &Path) -> Order {
        self.cage.input = Some(path.to_owned());
        self
    }

    /// Allows the child to write an existing file, up to `bytes`.
    pub(super) fn with_output(mut self, path: &Path, bytes: u64) -> Order {
        self.cage.output = Some(path.to_owned());
        self.cage.file_bytes = bytes;
        self
    }

    /// Makes the loader list the program's libraries and exit.
    pub(super) fn listing_libraries(mut self) -> Order {
        self.lists_libraries = true;
        self
    }
}

fn n_cores() -> u64 {
    std::thread::available_parallelism().map_or(1, |n| n.get() as u64)
}

/// A running child. Dropping it kills and reaps its whole group.
pub(super) struct Child {
    process: process::Child,
    group: Pid,
    /// After reaping, the process id may belong to another process.
    reaped: bool,
    ended: OwnedFd,
    stdin: Option<ChildStdin>,
    stdout: Option<ChildStdout>,
    stderr: Option<JoinHandle<String>>,
    time_left: Duration,
    /// End of the time limit by the wall clock, for `read_some`.
    due: Instant,
    stall: Duration,
    /// Files given to the child. Their paths are removed from its messages, because users do not know them.
    files: Vec<PathBuf>,
}

impl Child {
    /// Starts a child that reads no input and writes to us.
    pub(super) fn reading(order: Order) -> Result<Child, Error> {
        Child::start(order, Stdio::null())
    }

    /// Starts a child that reads from us and writes a file.
    pub(super) fn writing(order: Order) -> Result<Child, Error> {
        let child = Child::start(order, Stdio::piped())?;
        if let Some(stdin) = &child.stdin {
            // A blocking write could not be abandoned at the time limit.
            let flags = rustix::fs::fcntl_getfl(stdin);
            flags
                .and_then(|flags| {
                    rustix::fs::fcntl_setfl(stdin, flags | rustix::fs::OFlags::NONBLOCK)
                })
                .map_err(|e| Error::io("preparing the encoder's pipe")(e.into()))?;
            grow(stdin);
        }
        Ok(child)
    }

    fn start(order: Order, stdin: Stdio) -> Result<Child, Error> {
        let place = tools::place(order.tool)?;
        Child::launch(order, place, stdin)
    }

    /// Starts a program in the layers that both the order and the tool allow.
    pub(super) fn launch(order: Order, place: &Place, stdin: Stdio) -> Result<Child, Error> {
        let failed = Error::io("starting the media tool");
        let cage = Cage {
            layers: order.cage.layers.and(place.layers),
            ..order.cage
        };
        let mut command = command(&order.args, place, order.lists_libraries);
        command.stdin(stdin);
        sandbox::enclose(&mut command, &cage, &place.reach).map_err(&failed)?;
        let mut process = spawn(command).map_err(failed)?;
        let group = Pid::from_child(&process);
        super::niceness::pass_on(group);
        let ended = match rustix::process::pidfd_open(group, PidfdFlags::empty()) {
            Ok(ended) => ended,
            Err(errno) => {
                kill_and_reap(&mut process, group);
                return Err(Error::io("watching the media tool")(errno.into()));
            }
        };
        let (stdin, stdout) = (process.stdin.take(), process.stdout.take());
        if let Some(stdout) = &stdout {
            grow(stdout);
        }
        let stderr = process
            .stderr
            .take()
            .map(|pipe| std::thread::spawn(|| last_words(pipe)));
        Ok(Child {
            process,
            group,
            reaped: false,
            ended,
            stdin,
            stdout,
            stderr,
            time_left: order.time,
            due: Instant::now() + order.time,
            stall: order.stall,
            files: [cage.input, cage.output].into_iter().flatten().collect(),
        })
    }

    /// Fills `buffer` from the child's output. Returns fewer bytes than its length only at the end of the
    /// output.
    pub(super) fn read_full(&mut self, buffer: &mut [u8]) -> Result<usize, Error> {
        let Some(mut stdout) = self.stdout.take() else {
            return Ok(0);
        };
        let deadline = Instant::now() + self.stall;
        let mut n_read = 0;
        while n_read < buffer.len() {
            self.wait_for(stdout.as_fd(), PollFlags::IN, deadline)?;
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
        if Instant::now() > self.due {
            return Err(Error::TimeLimit);
        }
        let Some(mut stdout) = self.stdout.take() else {
            return Ok(0);
        };
        self.wait_for(stdout.as_fd(), PollFlags::IN, Instant::now() + self.stall)?;
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
        let deadline = Instant::now() + self.stall;
        while !bytes.is_empty() {
            match stdin.write(bytes) {
                Ok(n) => bytes = &bytes[n..],
                Err(error) => match error.kind() {
                    io::ErrorKind::WouldBlock => {
                        self.wait_for(stdin.as_fd(), PollFlags::OUT, deadline)?;
                    }
                    io::ErrorKind::Interrupted => {}
                    io::ErrorKind::BrokenPipe => {
                        drop(stdin);
                        return Err(self.reason_of_death());
                    }
                    _ => return Err(Error::io("writing to the media tool")(error)),
                },
            }
        }
        self.stdin = Some(stdin);
        Ok(())
    }

    /// Closes the child's input, waits for its exit and returns it.
    pub(super) fn finish(mut self) -> Result<End, Error> {
        self.end()
    }

    fn reason_of_death(&mut self) -> Error {
        match self.end().and_then(End::check) {
            Err(error) => error,
            Ok(end) => Error::Crashed {
                status: "it closed its input early".into(),
                complaint: end.complaint,
            },
        }
    }

    fn end(&mut self) -> Result<End, Error> {
        let patience = match self.stdin.take() {
            Some(_) => self.time_left,
            None => END_TIME.max(self.stall),
        };
        self.stdout = None;
        let ended = self
            .ended
            .try_clone()
            .map_err(Error::io("watching the media tool"))?;
        self.wait_for(ended.as_fd(), PollFlags::IN, Instant::now() + patience)?;
        // The child has exited but is not reaped, so its process id is still valid. Kill any processes that
        // it started.
        rustix::process::kill_process_group(self.group, Signal::KILL).ok();
        let status = self
            .process
            .wait()
            .map_err(Error::io("reaping the media tool"))?;
        self.reaped = true;
        let complaint = self
            .stderr
            .take()
            .map(|thread| thread.join().unwrap_or_default());
        let complaint = end::without(&self.files, complaint.unwrap_or_default());
        Ok(End { status, complaint })
    }

    /// Waits until `fd` is ready, at most until `deadline` and within the remaining time.
    fn wait_for(
        &mut self,
        fd: BorrowedFd<'_>,
        flags: PollFlags,
        deadline: Instant,
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
                Ok(0) => return Err(Error::TimeLimit),
                Ok(_) => return Ok(()),
                Err(rustix::io::Errno::INTR) => {}
                Err(errno) => return Err(Error::io("waiting for the media tool")(errno.into())),
            }
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        if !self.reaped {
            kill_and_reap(&mut self.process, self.group);
        }
    }
}

fn command(args: &[OsString], place: &Place, lists_libraries: bool) -> process::Command {
    let mut command = process::Command::new(&place.path);
    command
        .args(["-v", "error"])
        .args(args)
        .env_clear()
        .env("LC_ALL", "C")
        // Each arena reserves address space, which the sandbox limits.
        .env("MALLOC_ARENA_MAX", "4")
        .current_dir("/")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    if lists_libraries {
        command.env("LD_TRACE_LOADED_OBJECTS", "1");
    }
    command
}

/// Kills the remaining group, then reaps the child, which may have exited before others of its group. The
/// order matters: until the child is reaped, no other process can get its id.
fn kill_and_reap(process: &mut process::Child, group: Pid) {
    rustix::process::kill_process_group(group, Signal::KILL).ok();
    process.wait().ok();
}

/// Starts a command on a thread that never ends. When the thread that started a child ends, the kernel treats
/// that as the parent's death and kills the child.
fn spawn(command: process::Command) -> io::Result<process::Child> {
    type Request = (process::Command, mpsc::Sender<io::Result<process::Child>>);
    static SPAWNER: OnceLock<Mutex<mpsc::Sender<Request>>> = OnceLock::new();
    let spawner = SPAWNER.get_or_init(|| {
        let (send, receive) = mpsc::channel::<Request>();
        std::thread::spawn(move || {
            for (mut command, reply) in receive {
                if let Err(mpsc::SendError(Ok(mut orphan))) = reply.send(command.spawn()) {
                    let group = Pid::from_child(&orphan);
                    kill_and_reap(&mut orphan, group);
                }
            }
        });
        Mutex::new(send)
    });
    let gone = || io::Error::other("the thread that starts children is gone");
    let (send, receive) = mpsc::channel();
    let spawner = spawner
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone();
    spawner.send((command, send)).map_err(|_closed| gone())?;
    receive.recv().map_err(|_closed| gone())?
}

/// Enlarges a pipe, which reduces context switches. Failure is ignored: it only costs speed.
fn grow(pipe: impl AsFd) {
    rustix::pipe::fcntl_setpipe_size(pipe, PIPE_BYTES).ok();
}

/// Reads to the end and returns the last [`COMPLAINT_BYTES`].
fn last_words(mut pipe: impl Read) -> String {
    let mut kept = Vec::new();
    let mut chunk = [0; 4096];
    while let Ok(n) = pipe.read(&mut chunk) {
        if n == 0 {
            break;
        }
        kept.extend_from_slice(&chunk[..n]);
        let surplus = kept.len().saturating_sub(COMPLAINT_BYTES);
        kept.drain(..surplus);
    }
    String::from_utf8_lossy(&kept).into_owned()
}
