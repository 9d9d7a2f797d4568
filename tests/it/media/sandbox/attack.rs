//! A program that replaces ffmpeg and acts like a decoder taken over by a malicious film
//! (docs/explanation/promises.md, "Sandbox"). The test in `mod.rs` compiles it, with the standard library
//! only. The attack is named in the film after its first bytes, or in the first frame of a film to be
//! written.

use std::ffi::{CString, c_char, c_int, c_long, c_ulong, c_void};
use std::fs::{self, File};
use std::io::{Error, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::os::unix::fs::FileExt;
use std::process::exit;
use std::time::Duration;

unsafe extern "C" {
    fn fork() -> c_int;
    fn pause() -> c_int;
    fn close(fd: c_int) -> c_int;
    fn truncate(path: *const c_char, n_bytes: i64) -> c_int;
    fn chmod(path: *const c_char, mode: c_int) -> c_int;
    fn chown(path: *const c_char, user: c_int, group: c_int) -> c_int;
    fn utimes(path: *const c_char, times: *const c_void) -> c_int;
    fn getppid() -> c_int;
    fn kill(process: c_int, signal: c_int) -> c_int;
    fn mmap(at: *mut c_void, n: usize, may: c_int, how: c_int, fd: c_int, from: i64)
    -> *mut c_void;
    fn execv(path: *const c_char, arguments: *const *const c_char) -> c_int;
    fn ptrace(request: c_long, process: c_int, address: usize, data: usize) -> c_long;
    fn prctl(what: c_int, argument: c_ulong, ...) -> c_int;
    fn setrlimit(resource: c_int, limit: *const [u64; 2]) -> c_int;
    fn signal(number: c_int, handler: usize) -> usize;
    fn syscall(number: c_long, ...) -> c_long;
}

const SYS_TGKILL: c_long = if cfg!(target_arch = "x86_64") {
    234
} else {
    131
};

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let says = |word: &str| arguments.iter().any(|argument| argument == word);
    if says("-version") {
        println!("attack version 1");
        exit(0);
    }
    if says("-done") {
        tell(Ok(()));
    }
    if arguments
        .get(1)
        .is_some_and(|word| word == "--without-landlock")
    {
        tell(run_without_landlock(&arguments[2..]));
    }
    let file = arguments.iter().rev().find_map(|a| a.strip_prefix("file:"));
    let file = file.unwrap_or_else(|| tell(Err("no file was named".into())));
    let order = if says("pipe:0") {
        read_frame()
    } else {
        fs::read(file).unwrap_or_else(|error| tell(Err(format!("no film: {error}"))))
    };
    let text = String::from_utf8_lossy(&order).into_owned();
    let order = text.split("ATTACK ").nth(1).unwrap_or_default();
    let mut words = order.lines().next().unwrap_or_default().split(' ');
    let (name, target) = (
        words.next().unwrap_or_default(),
        words.next().unwrap_or_default(),
    );
    tell(attack(name, target, file));
}

/// Reports the verdict on stderr, which the sandbox leaves open, and exits.
fn tell(verdict: Result<(), String>) -> ! {
    match verdict {
        Ok(()) => eprintln!("ATTACK DONE"),
        Err(reason) => eprintln!("ATTACK HELD: {reason}"),
    }
    exit(1)
}

fn read_frame() -> Vec<u8> {
    let mut frame = vec![0; 256];
    let n = std::io::stdin().read(&mut frame).unwrap_or(0);
    frame.truncate(n);
    frame
}

fn attack(name: &str, target: &str, output: &str) -> Result<(), String> {
    match name {
        "read" => done(fs::read(target).map(drop)),
        "list" => done(fs::read_dir(target).map(drop)),
        "write" => done(File::create(target).map(drop)),
        "remove" => done(fs::remove_file(target)),
        "truncate" => of_path(target, |path| unsafe { truncate(path, 0) }),
        "chmod" => of_path(target, |path| unsafe { chmod(path, 0o600) }),
        "chown" => of_path(target, |path| unsafe { chown(path, -1, -1) }),
        "touch" => of_path(target, |path| unsafe { utimes(path, std::ptr::null()) }),
        "grow" => done(grow(output)),
        "tcp" => done(TcpStream::connect(target).map(drop)),
        "udp" => done(
            UdpSocket::bind("127.0.0.1:0")
                .and_then(|s| s.send_to(b"x", target))
                .map(drop),
        ),
        "fork" => fork_many(1000),
        "memory" => take_memory(8 << 30),
        "exec" => Err(format!("{}", start(target, &["-done"]))),
        "trace" => is_zero(unsafe { ptrace(0x4206, getppid(), 0, 0) }),
        "stop" => is_zero(c_long::from(unsafe { kill(getppid(), 0) })),
        "stop-thread" => is_zero(unsafe { syscall(SYS_TGKILL, getppid(), getppid(), 0) }),
        "slip" => is_zero(c_long::from(unsafe { prctl(1, 0) })),
        "raise" => is_zero(c_long::from(unsafe { setrlimit(1, &[u64::MAX, u64::MAX]) })),
        "outlive" => outlive(),
        _ => Err(format!("no such attack: {name}")),
    }
}

fn done(tried: std::io::Result<()>) -> Result<(), String> {
    tried.map_err(|error| error.to_string())
}

fn of_path(path: &str, call: impl Fn(*const c_char) -> c_int) -> Result<(), String> {
    let path = CString::new(path).unwrap();
    is_zero(c_long::from(call(path.as_ptr())))
}

fn is_zero(answer: c_long) -> Result<(), String> {
    match answer {
        0 => Ok(()),
        _ => Err(Error::last_os_error().to_string()),
    }
}

/// Creates a sparse file of 10 GiB.
fn grow(output: &str) -> std::io::Result<()> {
    // Ignore SIGXFSZ: the refusal of the write counts.
    unsafe { signal(25, 1) };
    let file = File::options().write(true).open(output)?;
    file.write_all_at(b"x", 10 << 30)
}

fn fork_many(n: usize) -> Result<(), String> {
    for k in 0..n {
        match unsafe { fork() } {
            0 => loop {
                // Close the inherited pipes, which would keep the parent's reader waiting.
                for fd in 0..3 {
                    unsafe { close(fd) };
                }
                unsafe { pause() };
            },
            -1 => return Err(format!("after {k}: {}", Error::last_os_error())),
            _ => {}
        }
    }
    Ok(())
}

/// Reserves address space, which is what the sandbox limits. The memory is not touched.
fn take_memory(n_bytes: usize) -> Result<(), String> {
    const READ_WRITE: c_int = 3;
    const PRIVATE_ANONYMOUS_UNRESERVED: c_int = 0x4022;
    let at = unsafe {
        mmap(
            std::ptr::null_mut(),
            n_bytes,
            READ_WRITE,
            PRIVATE_ANONYMOUS_UNRESERVED,
            -1,
            0,
        )
    };
    match at as isize {
        -1 => Err(Error::last_os_error().to_string()),
        _ => Ok(()),
    }
}

/// Executes another program. Returns only the error of a failed attempt.
fn start(program: &str, arguments: &[&str]) -> Error {
    let words = [&[program], arguments].concat();
    let words: Vec<CString> = words
        .into_iter()
        .map(|word| CString::new(word).unwrap())
        .collect();
    let mut list: Vec<*const c_char> = words.iter().map(|word| word.as_ptr()).collect();
    list.push(std::ptr::null());
    unsafe { execv(list[0], list.as_ptr()) };
    Error::last_os_error()
}

/// Tries to clear the parent-death signal, and stays alive for 30 s.
fn outlive() -> Result<(), String> {
    unsafe {
        signal(13, 1);
        prctl(1, 0);
    }
    std::io::stdout().write_all(b" ").ok();
    std::thread::sleep(Duration::from_secs(30));
    Ok(())
}

/// Runs a command as on a kernel without Landlock: creating a Landlock rule set fails with ENOSYS.
fn run_without_landlock(command: &[String]) -> Result<(), String> {
    // Load the number of the system call; 444 is landlock_create_ruleset; allow all others.
    let filter: [(u16, u8, u8, u32); 4] = [
        (0x20, 0, 0, 0),
        (0x15, 0, 1, 444),
        (0x06, 0, 0, 0x0005_0000 | 38),
        (0x06, 0, 0, 0x7fff_0000),
    ];
    let bytes: Vec<[u8; 8]> = filter
        .iter()
        .map(|&(code, yes, no, value)| {
            let mut step = [0; 8];
            step[..2].copy_from_slice(&code.to_ne_bytes());
            (step[2], step[3]) = (yes, no);
            step[4..].copy_from_slice(&value.to_ne_bytes());
            step
        })
        .collect();
    let program = [bytes.len() as u64, bytes.as_ptr() as u64];
    unsafe {
        prctl(38, 1, 0, 0, 0);
        is_zero(c_long::from(prctl(22, 2, &raw const program)))?;
    }
    let arguments: Vec<&str> = command[1..].iter().map(String::as_str).collect();
    Err(format!("{}", start(&command[0], &arguments)))
}
