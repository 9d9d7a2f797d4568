//! The two media tools: their paths, their libraries, and the layers of the sandbox in which they run
//! (docs/explanation/promises.md, "Sandbox"). The search happens once, at first use. A layer is left out and
//! reported if the kernel lacks it or the tool cannot print its version inside it. With `--sandbox strict` no
//! tool is started then.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use serde::{Deserialize, Serialize};

use super::error::Error;
use super::exit::Exit;
use super::gate::Child;
use super::invocation::{InstalledTool, Invocation};
use super::limits::Limits;
use super::sandbox::{Layer, Layers, ProgramFiles, landlock_abi, unsupported_reason};
use crate::config::{MediaTools, SandboxMode};

/// The programs that may be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    /// Reads headers and packet timestamps.
    Ffprobe,
    /// Decodes and encodes.
    Ffmpeg,
}

/// The media tool and its sandbox on this machine.
#[derive(Clone, Debug)]
pub struct SandboxStatus {
    /// The version line of ffmpeg.
    pub version: String,
    /// Landlock ABI version of the kernel; `None` if it has no Landlock.
    pub landlock_abi: Option<i64>,
    /// All layers. A layer that is not in use has the reason.
    pub layers: Vec<(Layer, Option<String>)>,
}

/// A tool that was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct FoundTool {
    tool: InstalledTool,
    version: String,
    /// Layers that are not in use, each with the reason.
    missing_layers: Vec<(Layer, String)>,
}

/// The tools as this process found them, for its child processes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FoundTools {
    ffmpeg: FoundTool,
    ffprobe: FoundTool,
}

/// The search for a tool.
struct Search {
    result: OnceLock<Result<FoundTool, String>>,
    /// Held during the search, so that other threads wait for the result instead of searching too.
    lock: Mutex<()>,
}

static SETTINGS: OnceLock<MediaTools> = OnceLock::new();
static FFMPEG: Search = Search::new();
static FFPROBE: Search = Search::new();

/// Library folders if the loader lists none, for example for a static program or another loader.
const DEFAULT_LIBRARY_DIRS: [&str; 5] =
    ["/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib"];

/// Maximum output of a tool about itself, bytes. Free choice.
const MAX_OUTPUT_BYTES: usize = 1 << 20;

/// Sets tools and sandbox for this process. Call it before the first film is read; later calls have no
/// effect.
pub fn configure(settings: &MediaTools) {
    // On a second call the first settings remain.
    SETTINGS.set(settings.clone()).ok();
}

/// Starts the search for the tools in the background, because starting a tool to get its version takes time.
pub fn search_in_background(tools: &[Tool]) {
    for &tool in tools {
        // Errors are ignored here: the search is repeated at first use, which reports them.
        let thread = std::thread::Builder::new();
        thread.spawn(move || found(tool).is_ok()).ok();
    }
}

/// Returns the sandbox of media children on this machine. Fails if a tool is missing or does not run.
pub fn sandbox_status() -> Result<SandboxStatus, Error> {
    let (ffmpeg, ffprobe) = (found(Tool::Ffmpeg)?, found(Tool::Ffprobe)?);
    let reason = |layer| {
        let mut missing = ffmpeg.missing_layers.iter().chain(&ffprobe.missing_layers);
        let (_, reason) = missing.find(|(missing, _)| *missing == layer)?;
        Some(reason.clone())
    };
    Ok(SandboxStatus {
        version: ffmpeg.version.clone(),
        landlock_abi: landlock_abi().ok(),
        layers: Layer::ALL.map(|layer| (layer, reason(layer))).to_vec(),
    })
}

/// Like [`sandbox_status`], but also fails if `--sandbox strict` is set and a layer is missing.
pub fn required_sandbox() -> Result<SandboxStatus, Error> {
    installed(Tool::Ffprobe)?;
    installed(Tool::Ffmpeg)?;
    sandbox_status()
}

/// Returns the tools for a child process. Fails as [`required_sandbox`] does.
pub fn found_tools() -> Result<FoundTools, Error> {
    required_sandbox()?;
    Ok(FoundTools {
        ffmpeg: found(Tool::Ffmpeg)?.clone(),
        ffprobe: found(Tool::Ffprobe)?.clone(),
    })
}

/// Makes this process use the tools that its parent found. Call it before the first film is read; it replaces
/// the search.
pub fn adopt_tools(tools: FoundTools) {
    for (search, tool) in [(&FFMPEG, tools.ffmpeg), (&FFPROBE, tools.ffprobe)] {
        // If a search has already ended, its result remains.
        search.result.set(Ok(tool)).ok();
    }
}

/// Returns the version line of the installed ffmpeg.
pub fn tool_version() -> Result<String, Error> {
    found(Tool::Ffmpeg).map(|found| found.version.clone())
}

/// Returns an installed tool. Fails if it is missing, or if `--sandbox strict` is set and a layer is missing.
pub(super) fn installed(tool: Tool) -> Result<&'static InstalledTool, Error> {
    let found = found(tool)?;
    let strict = mode() == SandboxMode::Strict;
    match found.missing_layers.first().filter(|_| strict) {
        Some((layer, reason)) => Err(Error::SandboxIncomplete {
            layer: layer.name(),
            reason: reason.clone(),
        }),
        None => Ok(&found.tool),
    }
}

/// Returns the output of the installed ffmpeg for a query of its features, even if `--sandbox strict` is not
/// satisfied.
pub(super) fn query_ffmpeg(args: &[&str]) -> Result<String, Error> {
    output(&found(Tool::Ffmpeg)?.tool, args)
}

fn mode() -> SandboxMode {
    let settings = SETTINGS.get();
    settings.map_or(SandboxMode::Auto, |settings| settings.sandbox)
}

fn found(tool: Tool) -> Result<&'static FoundTool, Error> {
    let search = match tool {
        Tool::Ffmpeg => &FFMPEG,
        Tool::Ffprobe => &FFPROBE,
    };
    (search.result(tool)?.as_ref()).map_err(|why| Error::ToolMissing(why.clone()))
}

impl Search {
    const fn new() -> Search {
        Search {
            result: OnceLock::new(),
            lock: Mutex::new(()),
        }
    }

    /// Returns the result of the search and searches if there is none. Transient errors are not stored as
    /// results.
    fn result(&self, tool: Tool) -> Result<&Result<FoundTool, String>, Error> {
        let _guard = match self.result.get() {
            Some(result) => return Ok(result),
            None => self.lock.lock().unwrap_or_else(PoisonError::into_inner),
        };
        if let Some(result) = self.result.get() {
            return Ok(result);
        }
        let found = match find(tool) {
            Err(error) if is_transient(&error) => return Err(error),
            found => found.map_err(|error| error.to_string()),
        };
        Ok(self.result.get_or_init(|| found))
    }
}

fn find(tool: Tool) -> Result<FoundTool, Error> {
    let path = path_of(tool)?;
    let mut layers = Layers::ALL;
    let mut missing_layers = Vec::new();
    for layer in Layer::ALL {
        let reason = if mode() == SandboxMode::Off && !Layers::BASIC.has(layer) {
            Some("turned off by `--sandbox off`".to_owned())
        } else {
            unsupported_reason(layer)
        };
        if let Some(reason) = reason {
            layers = layers.without(layer);
            missing_layers.push((layer, reason));
        }
    }
    let program_files = if layers.has(Layer::Files) {
        program_files_of(&path)
    } else {
        ProgramFiles::default()
    };
    let mut tool = InstalledTool {
        path,
        program_files,
        layers,
    };
    let version = find_usable_layers(&mut tool, &mut missing_layers)?;
    Ok(FoundTool {
        tool,
        version,
        missing_layers,
    })
}

fn path_of(tool: Tool) -> Result<PathBuf, Error> {
    let settings = SETTINGS.get();
    let (name, configured) = match tool {
        Tool::Ffmpeg => ("ffmpeg", settings.and_then(|media| media.ffmpeg.clone())),
        Tool::Ffprobe => ("ffprobe", settings.and_then(|media| media.ffprobe.clone())),
    };
    if let Some(path) = configured {
        return std::path::absolute(path).map_err(Error::io("finding the media tool"));
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let mut files = std::env::split_paths(&folders).map(|folder| folder.join(name));
    files
        .find(|file| file.is_absolute() && file.is_file())
        .ok_or_else(|| Error::ToolMissing(name.to_owned()))
}

/// Returns whether the error is transient, caused by an overloaded machine and not by the tool or its layers.
fn is_transient(error: &Error) -> bool {
    use std::io::ErrorKind::{Interrupted, OutOfMemory, ResourceBusy, WouldBlock};
    const TOO_MANY_FILES: [Option<i32>; 2] = [Some(libc::EMFILE), Some(libc::ENFILE)];
    match error {
        Error::TimeLimit | Error::Killed => true,
        Error::Io { source, .. } => {
            let kinds = [Interrupted, OutOfMemory, ResourceBusy, WouldBlock];
            kinds.contains(&source.kind()) || TOO_MANY_FILES.contains(&source.raw_os_error())
        }
        _ => false,
    }
}

/// Runs the tool for its version in all its layers, and with fewer layers if that fails. Removes the layers
/// in which it does not run, adds them to `missing_layers`, and returns the version. A transient error never
/// removes a layer.
fn find_usable_layers(
    tool: &mut InstalledTool,
    missing_layers: &mut Vec<(Layer, String)>,
) -> Result<String, Error> {
    let first_try = match version(tool) {
        Err(error) if is_transient(&error) => version(tool),
        version => version,
    };
    let failure = match first_try {
        Ok(version) => return Ok(version),
        Err(error) if is_transient(&error) => return Err(error),
        Err(error) => error.to_string(),
    };
    let all = tool.layers;
    let suspects = [Layer::Files, Layer::Calls, Layer::Privileges, Layer::Limits];
    let one_less = suspects.map(|layer| all.without(layer));
    let only_leash = Layers::NONE.with(Layer::Leash);
    let program = tool.path.display().to_string();
    for layers in one_less.into_iter().chain([only_leash]) {
        tool.layers = layers;
        let Ok(version) = version(tool) else {
            continue;
        };
        let is_removed = |layer: &Layer| all.has(*layer) && !layers.has(*layer);
        let reason = format!("{program} does not run with this layer: {failure}");
        let removed = Layer::ALL.into_iter().filter(is_removed);
        missing_layers.extend(removed.map(|layer| (layer, reason.clone())));
        return Ok(version);
    }
    Err(Error::ToolMissing(format!(
        "{program} does not run: {failure}"
    )))
}

/// Returns the version of a tool: the first line that `-version` prints.
fn version(tool: &InstalledTool) -> Result<String, Error> {
    let text = output(tool, &["-version"])?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

/// Returns the files that a program needs, as listed by its loader: its library folders and the loader.
fn program_files_of(path: &Path) -> ProgramFiles {
    let tool = InstalledTool {
        path: path.to_owned(),
        program_files: ProgramFiles::default(),
        layers: Layers::BASIC,
    };
    let limits = Limits::default();
    let listing = Invocation::new(&tool, Vec::new(), &limits, 0).listing_libraries();
    // The loader's exit status does not matter.
    let listing = run(listing).map_or(String::new(), |(listing, _)| listing);
    let mut files = parse_listing(&listing);
    if files.library_dirs.is_empty() {
        files.library_dirs = DEFAULT_LIBRARY_DIRS.map(PathBuf::from).to_vec();
    }
    files.executables.push(path.to_owned());
    files
}

/// Returns the output of a tool for a query about itself.
fn output(tool: &InstalledTool, args: &[&str]) -> Result<String, Error> {
    let args = args.iter().map(Into::into).collect();
    let (text, exit) = run(Invocation::new(tool, args, &Limits::default(), 0))?;
    exit.check().map(|_| text)
}

/// Runs a tool and returns its output and exit.
fn run(invocation: Invocation<'_>) -> Result<(String, Exit), Error> {
    let mut child = Child::reading(invocation)?;
    let mut text = vec![0; MAX_OUTPUT_BYTES];
    let n_bytes = child.read_full(&mut text)?;
    let exit = child.finish()?;
    Ok((String::from_utf8_lossy(&text[..n_bytes]).into_owned(), exit))
}

/// Parses lines such as `libz.so.1 => /lib/libz.so.1 (0x7f00)`. The line of the loader itself has no arrow.
fn parse_listing(listing: &str) -> ProgramFiles {
    let mut files = ProgramFiles::default();
    for line in listing.lines().filter(|line| line.contains(" (0x")) {
        let (name, path) = line.split_once("=>").unwrap_or((line, line));
        let path = path.split(" (0x").next().unwrap_or_default().trim();
        let Ok(file) = Path::new(path).canonicalize() else {
            continue;
        };
        let folder = file.parent().map(Path::to_owned);
        files.library_dirs.extend(folder);
        if name.contains("/ld-") || !line.contains("=>") {
            files.executables.push(file);
        }
    }
    files.library_dirs.sort();
    files.library_dirs.dedup();
    files
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn overload_is_transient_and_a_refused_call_is_not() {
        let io = |errno| Error::io("starting the media tool")(io::Error::from_raw_os_error(errno));
        for error in [
            Error::TimeLimit,
            io(libc::EAGAIN),
            io(libc::ENOMEM),
            io(libc::EMFILE),
        ] {
            assert!(is_transient(&error), "{error}");
        }
        for error in [io(libc::EPERM), io(libc::ENOSYS), io(libc::ENOENT)] {
            assert!(!is_transient(&error), "{error}");
        }
    }
}
