//! A child process that leads its own process group (docs/explanation/promises.md, "No orphans"). It is started
//! on a thread that never ends, and dropping its handle kills and reaps the whole group.

use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::{Mutex, OnceLock, PoisonError, mpsc};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use rustix::process::{
    Pid, PidfdFlags, Signal, WaitId, WaitIdOptions, kill_process_group, pidfd_open, waitid,
};

use crate::media::sandbox;

/// A process that leads its own process group.
#[derive(Debug)]
pub struct ProcessGroup {
    leader: Child,
    id: Pid,
    /// After reaping, the process id may belong to another process.
    is_reaped: bool,
    /// Becomes readable when the leader exits.
    pidfd: OwnedFd,
}

impl ProcessGroup {
    /// Starts a process that leads its own group and dies with this process, without other confinement.
    pub fn start_leashed(mut command: Command) -> io::Result<ProcessGroup> {
        sandbox::leash(&mut command);
        ProcessGroup::start(command)
    }

    /// Starts a process that makes itself the leader of a group.
    pub(super) fn start(command: Command) -> io::Result<ProcessGroup> {
        let mut leader = spawn(command)?;
        let id = Pid::from_child(&leader);
        match pidfd_open(id, PidfdFlags::empty()) {
            Ok(pidfd) => Ok(ProcessGroup {
                leader,
                id,
                is_reaped: false,
                pidfd,
            }),
            Err(errno) => {
                kill_and_reap(&mut leader, id);
                Err(errno.into())
            }
        }
    }

    /// Returns the id of the leader and of the group.
    pub(super) fn id(&self) -> Pid {
        self.id
    }

    /// Returns the leader's ends of its pipes, as far as the command has pipes. A second call returns none.
    pub fn take_pipes(&mut self) -> (Option<ChildStdin>, Option<ChildStdout>, Option<ChildStderr>) {
        let leader = &mut self.leader;
        (
            leader.stdin.take(),
            leader.stdout.take(),
            leader.stderr.take(),
        )
    }

    /// Kills all processes of the group.
    pub fn kill(&self) {
        if !self.is_reaped {
            kill_process_group(self.id, Signal::KILL).ok();
        }
    }

    /// Waits at most `patience` for the exit of the leader, then kills the group. Returns how the leader ended.
    pub fn end_within(mut self, patience: Duration) -> io::Result<ExitStatus> {
        let deadline = Instant::now() + patience;
        loop {
            let wait = deadline.saturating_duration_since(Instant::now());
            let wait = Timespec {
                tv_sec: wait.as_secs() as i64,
                tv_nsec: i64::from(wait.subsec_nanos()),
            };
            match poll(&mut [PollFd::new(&self.pidfd, PollFlags::IN)], Some(&wait)) {
                Err(Errno::INTR) => continue,
                Ok(0) => self.kill(),
                _ => {}
            }
            return self.reap();
        }
    }

    /// Waits for the exit of the leader, and kills the processes that it leaves behind.
    pub(super) fn reap(&mut self) -> io::Result<ExitStatus> {
        // Until the leader is reaped, no other process can get its id.
        let exit = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT;
        waitid(WaitId::PidFd(self.pidfd.as_fd()), exit)?;
        self.kill();
        let status = self.leader.wait()?;
        self.is_reaped = true;
        Ok(status)
    }
}

/// Becomes readable when the leader exits.
impl AsFd for ProcessGroup {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.pidfd.as_fd()
    }
}

impl Drop for ProcessGroup {
    fn drop(&mut self) {
        if !self.is_reaped {
            kill_and_reap(&mut self.leader, self.id);
        }
    }
}

/// Kills the remaining group, then reaps the leader, which may have exited before others of its group. The
/// order matters: until the leader is reaped, no other process can get its id.
fn kill_and_reap(leader: &mut Child, group: Pid) {
    kill_process_group(group, Signal::KILL).ok();
    leader.wait().ok();
}

/// Starts a command on a thread that never ends. When the thread that started a child ends, the kernel treats
/// that as the parent's death and kills the child.
fn spawn(command: Command) -> io::Result<Child> {
    type Request = (Command, mpsc::Sender<io::Result<Child>>);
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
