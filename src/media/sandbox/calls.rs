//! Seccomp filter that refuses system calls no film needs (`refused`; docs/explanation/promises.md,
//! "Sandbox"). The BPF program is written out here instruction by instruction, because it is short and must
//! be reviewable.
//!
//! A refused call fails with EPERM and does not kill the process. Libraries probe for features and handle a
//! refusal; a kill could make films fail after a library update. The call has no effect either way. Only a
//! program for another processor architecture is killed.

#![expect(
    unsafe_code,
    reason = "a filter is entered by a system call after the fork"
)]

use std::io;

use libc::{c_long, sock_filter};

use super::refused::REFUSED;

/// Placeholder in the filter for the child's process id, which is known only after the fork.
const PID_PLACEHOLDER: u32 = u32::MAX;

/// Highest known system call number. Calls with higher numbers fail with ENOSYS, as on an older kernel, which
/// libraries handle. On x86-64 this range includes the 32-bit (x32) numbers.
const MAX_NUMBER: u32 = libc::SYS_mseal as u32;

#[cfg(target_arch = "x86_64")]
const ARCH: Option<u32> = Some(0xc000_003e);
#[cfg(target_arch = "aarch64")]
const ARCH: Option<u32> = Some(0xc000_00b7);
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const ARCH: Option<u32> = None;

// Offsets of a call's number, architecture and the low and high halves of its arguments. Both architectures
// above are little-endian.
const NUMBER: u32 = 0;
const ARCHITECTURE: u32 = 4;
const fn low(argument: u32) -> u32 {
    16 + 8 * argument
}
const fn high(argument: u32) -> u32 {
    low(argument) + 4
}

/// Returns why this machine does not support the filter; `None` if it does.
pub(super) fn unsupported_reason() -> Option<String> {
    if ARCH.is_none() {
        return Some("the system call filter does not support this processor".to_owned());
    }
    const GET_ACTION_AVAIL: libc::c_ulong = 2;
    let action = libc::SECCOMP_RET_ERRNO;
    // SAFETY: the kernel reads one number, which lives until the call returns.
    let result =
        unsafe { libc::syscall(libc::SYS_seccomp, GET_ACTION_AVAIL, 0, &raw const action) };
    match result {
        0 => None,
        _ => Some(format!(
            "this kernel has no seccomp filters: {}",
            io::Error::last_os_error()
        )),
    }
}

/// Returns the filter, which the kernel runs for every system call of the child.
pub(super) fn program() -> Vec<sock_filter> {
    let mut program = Program(Vec::new());
    program.load(ARCHITECTURE);
    program.return_if_not(ARCH.unwrap_or_default(), libc::SECCOMP_RET_KILL_PROCESS);
    program.load(NUMBER);
    program.return_if_above(MAX_NUMBER, refusal(libc::ENOSYS));
    // The flags of clone3 are in memory, which a filter cannot read. Libraries fall back to `clone`.
    program.return_if(libc::SYS_clone3, refusal(libc::ENOSYS));
    for call in REFUSED {
        program.return_if(*call, refusal(libc::EPERM));
    }
    // Threads are also created by `clone`.
    program.when_equal_then(libc::SYS_clone, |then| {
        then.load(low(0));
        then.return_unless_bit(libc::CLONE_THREAD as u32, refusal(libc::EPERM));
    });
    // A program aborts by sending itself a signal.
    program.when_equal_then(libc::SYS_tgkill, |then| {
        then.load(low(0));
        then.return_if_not(PID_PLACEHOLDER, refusal(libc::EPERM));
    });
    // The parent death signal must stay set.
    program.when_equal_then(libc::SYS_prctl, |then| {
        then.load(low(0));
        then.return_if(libc::PR_SET_PDEATHSIG.into(), refusal(libc::EPERM));
    });
    // Limits may be read but not set.
    program.when_equal_then(libc::SYS_prlimit64, |then| {
        for half in [low(2), high(2)] {
            then.load(half);
            then.return_if_not(0, refusal(libc::EPERM));
        }
    });
    program.return_with(libc::SECCOMP_RET_ALLOW);
    program.0
}

fn refusal(errno: i32) -> u32 {
    libc::SECCOMP_RET_ERRNO | errno as u32
}

/// Writes the id of the calling process into its filter. Async-signal-safe.
fn insert_own_pid(program: &mut [sock_filter]) {
    // SAFETY: the call has no arguments and cannot fail.
    let process = unsafe { libc::getpid() };
    for step in program.iter_mut().filter(|step| step.k == PID_PLACEHOLDER) {
        step.k = process as u32;
    }
}

/// Enters the filter in the child. This cannot be undone. Async-signal-safe.
pub(super) fn enter(program: &mut [sock_filter]) -> io::Result<()> {
    insert_own_pid(program);
    let filter = libc::sock_fprog {
        len: program.len() as u16,
        filter: program.as_ptr().cast_mut(),
    };
    // SAFETY: the kernel reads the program, which outlives the call, and does not write to it.
    let entered = unsafe {
        libc::syscall(
            libc::SYS_seccomp,
            libc::c_ulong::from(libc::SECCOMP_SET_MODE_FILTER),
            0,
            &raw const filter,
        )
    };
    match entered {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

/// A filter under construction. Each result follows its test directly, so that jumps are short.
struct Program(Vec<sock_filter>);

impl Program {
    fn push(&mut self, code: u32, value: u32, if_true: u8, if_false: u8) {
        self.0.push(sock_filter {
            code: code as u16,
            jt: if_true,
            jf: if_false,
            k: value,
        });
    }

    fn load(&mut self, at: u32) {
        self.push(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, at, 0, 0);
    }

    fn return_with(&mut self, action: u32) {
        self.push(libc::BPF_RET | libc::BPF_K, action, 0, 0);
    }

    fn return_if(&mut self, value: c_long, action: u32) {
        let equal = libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K;
        self.push(equal, value as u32, 0, 1);
        self.return_with(action);
    }

    fn return_if_not(&mut self, value: u32, action: u32) {
        let equal = libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K;
        self.push(equal, value, 1, 0);
        self.return_with(action);
    }

    fn return_if_above(&mut self, value: u32, action: u32) {
        let greater = libc::BPF_JMP | libc::BPF_JGT | libc::BPF_K;
        self.push(greater, value, 0, 1);
        self.return_with(action);
    }

    fn return_unless_bit(&mut self, bit: u32, action: u32) {
        let any_bit = libc::BPF_JMP | libc::BPF_JSET | libc::BPF_K;
        self.push(any_bit, bit, 1, 0);
        self.return_with(action);
    }

    /// Adds tests for one call. If none of them refuses it, the call is allowed.
    fn when_equal_then(&mut self, call: c_long, tests: impl FnOnce(&mut Program)) {
        let mut then = Program(Vec::new());
        tests(&mut then);
        then.return_with(libc::SECCOMP_RET_ALLOW);
        let equal = libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K;
        self.push(equal, call as u32, 0, then.0.len() as u8);
        self.0.append(&mut then.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs the filter as the kernel would.
    fn action_for(number: c_long, arguments: [u64; 3]) -> u32 {
        let mut call = vec![number as u32, ARCH.unwrap_or_default(), 0, 0];
        call.extend(
            arguments
                .iter()
                .flat_map(|a| [*a as u32, (*a >> 32) as u32]),
        );
        run(&call)
    }

    fn run(call: &[u32]) -> u32 {
        let mut program = program();
        insert_own_pid(&mut program);
        let (mut at, mut loaded) = (0, 0);
        loop {
            let step = &program[at];
            let code = u32::from(step.code);
            at += 1;
            let yes = match code & 0x07 {
                libc::BPF_LD => {
                    loaded = call[step.k as usize / 4];
                    continue;
                }
                libc::BPF_RET => return step.k,
                _ => match code & 0xf0 {
                    libc::BPF_JEQ => loaded == step.k,
                    libc::BPF_JGT => loaded > step.k,
                    _ => loaded & step.k != 0,
                },
            };
            at += usize::from(if yes { step.jt } else { step.jf });
        }
    }

    const ALLOW: u32 = libc::SECCOMP_RET_ALLOW;

    #[test]
    fn listed_calls_are_refused_and_those_of_decoders_allowed() {
        for call in REFUSED {
            assert_eq!(action_for(*call, [0; 3]), refusal(libc::EPERM), "{call}");
        }
        for call in [
            libc::SYS_read,
            libc::SYS_mmap,
            libc::SYS_futex,
            libc::SYS_execve,
            libc::SYS_get_mempolicy,
            libc::SYS_ftruncate,
            libc::SYS_madvise,
        ] {
            assert_eq!(action_for(call, [0; 3]), ALLOW, "{call}");
        }
    }

    #[test]
    fn signal_to_own_process_is_allowed_and_to_others_refused() {
        let process = u64::from(std::process::id());
        assert_eq!(action_for(libc::SYS_tgkill, [process, 7, 6]), ALLOW);
        let other = action_for(libc::SYS_tgkill, [process + 1, 7, 6]);
        assert_eq!(other, refusal(libc::EPERM));
    }

    #[test]
    fn new_threads_are_allowed_and_processes_refused() {
        let thread = (libc::CLONE_VM | libc::CLONE_THREAD) as u64;
        assert_eq!(action_for(libc::SYS_clone, [thread, 0, 0]), ALLOW);
        let process = libc::SIGCHLD as u64;
        assert_eq!(
            action_for(libc::SYS_clone, [process, 0, 0]),
            refusal(libc::EPERM)
        );
        assert_eq!(action_for(libc::SYS_clone3, [0; 3]), refusal(libc::ENOSYS));
    }

    #[test]
    fn reading_limits_is_allowed_and_setting_them_or_the_death_signal_refused() {
        assert_eq!(action_for(libc::SYS_prlimit64, [0, 7, 0]), ALLOW);
        for new in [1, 1 << 40] {
            let set = action_for(libc::SYS_prlimit64, [0, 7, new]);
            assert_eq!(set, refusal(libc::EPERM));
        }
        let slip = libc::PR_SET_PDEATHSIG as u64;
        assert_eq!(
            action_for(libc::SYS_prctl, [slip, 0, 0]),
            refusal(libc::EPERM)
        );
        assert_eq!(
            action_for(libc::SYS_prctl, [libc::PR_SET_NAME as u64, 0, 0]),
            ALLOW
        );
    }

    #[test]
    fn other_architectures_are_killed_and_newer_calls_unknown() {
        let of_i386 = [libc::SYS_read as u32, 0x4000_0003, 0, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(run(&of_i386), libc::SECCOMP_RET_KILL_PROCESS);
        let unknown = refusal(libc::ENOSYS);
        assert_eq!(action_for(c_long::from(MAX_NUMBER) + 1, [0; 3]), unknown);
        assert_eq!(action_for(libc::SYS_socket | 0x4000_0000, [0; 3]), unknown);
    }
}
