//! The two media tools: their paths, their libraries, and the layers of the sandbox in which they run
//! (docs/explanation/promises.md, "Sandbox"). The search happens once, at first use. A layer is left out and
//! reported if the kernel lacks it or the tool cannot print its version inside it. With `--sandbox strict` no
//! tool is started then.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use super::error::Error;
use super::gate::{Child, Order};
use super::limits::Limits;
use super::sandbox::{Layer, Layers, Reach, lack_of, landlock_abi};
use crate::config::{Media, Sandbox};

/// The programs that may be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    /// Reads headers and packet timestamps.
    Ffprobe,
    /// Decodes and encodes.
    Ffmpeg,
}

/// An installed tool.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// Path of the program.
    pub(super) path: PathBuf,
    /// Files that the program needs.
    pub(super) reach: Reach,
    /// Layers in which it runs on this machine.
    pub(super) layers: Layers,
}

/// The media tool and its sandbox on this machine.
#[derive(Clone, Debug)]
pub struct Walls {
    /// The version line of ffmpeg.
    pub version: String,
    /// Landlock ABI version of the kernel; `None` if it has no Landlock.
    pub landlock_abi: Option<i64>,
    /// All layers. A layer that is not in use has the reason.
    pub layers: Vec<(Layer, Option<String>)>,
}

/// The result of a search for a tool.
struct Found {
    place: Place,
    version: String,
    lacks: Vec<(Layer, String)>,
}

/// The search for a tool.
struct Search {
    outcome: OnceLock<Result<Found, String>>,
    /// Held during the search, so that other threads wait for the result instead of searching too.
    turn: Mutex<()>,
}

static SETTINGS: OnceLock<Media> = OnceLock::new();
static FFMPEG: Search = Search::new();
static FFPROBE: Search = Search::new();

/// Library folders if the loader lists none, for example for a static program or another loader.
const USUAL_FOLDERS: [&str; 5] = ["/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib"];

/// Maximum output of a tool about itself, bytes. Free choice.
const MAX_ANSWER_BYTES: usize = 1 << 20;

/// Sets tools and sandbox for this process. Call it before the first film is read; later calls have no
/// effect.
pub fn set_up(settings: &Media) {
    // On a second call the first settings remain.
    SETTINGS.set(settings.clone()).ok();
}

/// Starts the search for the tools in the background, because starting a tool to get its version takes time.
pub fn look_for(tools: &[Tool]) {
    for &tool in tools {
        // Errors are ignored here: the search is repeated at first use, which reports them.
        let thread = std::thread::Builder::new();
        thread.spawn(move || found(tool).is_ok()).ok();
    }
}

/// Returns the sandbox of media children on this machine. Fails if a tool is missing or does not run.
pub fn walls() -> Result<Walls, Error> {
    let found = found(Tool::Ffmpeg)?;
    let other = self::found(Tool::Ffprobe)?;
    let lack_in = |lacks: &[(Layer, String)], layer| {
        let lack = lacks.iter().find(|(lacking, _)| *lacking == layer);
        lack.map(|(_, reason)| reason.clone())
    };
    let lack = |layer| lack_in(&found.lacks, layer).or_else(|| lack_in(&other.lacks, layer));
    Ok(Walls {
        version: found.version.clone(),
        landlock_abi: landlock_abi().ok(),
        layers: Layer::ALL.map(|layer| (layer, lack(layer))).to_vec(),
    })
}

/// Like [`walls`], but also fails if `--sandbox strict` is set and a layer is missing.
pub fn demanded_walls() -> Result<Walls, Error> {
    place(Tool::Ffprobe)?;
    place(Tool::Ffmpeg)?;
    walls()
}

/// Returns the version line of the installed ffmpeg.
pub fn tool_version() -> Result<String, Error> {
    found(Tool::Ffmpeg).map(|found| found.version.clone())
}

/// Returns an installed tool. Fails if it is missing, or if `--sandbox strict` is set and a layer is missing.
pub(super) fn place(tool: Tool) -> Result<&'static Place, Error> {
    let found = found(tool)?;
    let strict = mode() == Sandbox::Strict;
    match found.lacks.first().filter(|_| strict) {
        Some((layer, reason)) => Err(Error::SandboxIncomplete {
            layer: layer.name(),
            reason: reason.clone(),
        }),
        None => Ok(&found.place),
    }
}

/// Returns the installed ffmpeg even if `--sandbox strict` is not satisfied, to query its features.
pub(super) fn whole_place() -> Result<&'static Place, Error> {
    found(Tool::Ffmpeg).map(|found| &found.place)
}

fn mode() -> Sandbox {
    SETTINGS.get().map_or(Sandbox::Auto, |media| media.sandbox)
}

fn found(tool: Tool) -> Result<&'static Found, Error> {
    let search = match tool {
        Tool::Ffmpeg => &FFMPEG,
        Tool::Ffprobe => &FFPROBE,
    };
    (search.outcome(tool)?.as_ref()).map_err(|why| Error::ToolMissing(why.clone()))
}

impl Search {
    const fn new() -> Search {
        Search {
            outcome: OnceLock::new(),
            turn: Mutex::new(()),
        }
    }

    /// Returns the result of the search and searches if there is none. Transient errors are not stored as
    /// results.
    fn outcome(&self, tool: Tool) -> Result<&Result<Found, String>, Error> {
        let _turn = match self.outcome.get() {
            Some(outcome) => return Ok(outcome),
            None => self.turn.lock().unwrap_or_else(PoisonError::into_inner),
        };
        if let Some(outcome) = self.outcome.get() {
            return Ok(outcome);
        }
        let found = match find(tool) {
            Err(error) if is_of_the_moment(&error) => return Err(error),
            found => found.map_err(|error| error.to_string()),
        };
        Ok(self.outcome.get_or_init(|| found))
    }
}

fn find(tool: Tool) -> Result<Found, Error> {
    let path = path_of(tool)?;
    let mut layers = Layers::ALL;
    let mut lacks = Vec::new();
    for layer in Layer::ALL {
        let reason = match mode() == Sandbox::Off && !Layers::OLD.has(layer) {
            true => Some("turned off by `--sandbox off`".to_owned()),
            false => lack_of(layer),
        };
        if let Some(reason) = reason {
            layers = layers.without(layer);
            lacks.push((layer, reason));
        }
    }
    let reach = match layers.has(Layer::Files) {
        true => reach_of(&path),
        false => Reach::default(),
    };
    let mut place = Place {
        path,
        reach,
        layers,
    };
    let (version, unbearable) = try_out(&mut place)?;
    lacks.extend(unbearable);
    Ok(Found {
        place,
        version,
        lacks,
    })
}

fn path_of(tool: Tool) -> Result<PathBuf, Error> {
    let settings = SETTINGS.get();
    let (name, chosen) = match tool {
        Tool::Ffmpeg => ("ffmpeg", settings.and_then(|media| media.ffmpeg.clone())),
        Tool::Ffprobe => ("ffprobe", settings.and_then(|media| media.ffprobe.clone())),
    };
    if let Some(path) = chosen {
        return std::path::absolute(path).map_err(Error::io("finding the media tool"));
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let mut places = std::env::split_paths(&folders).map(|folder| folder.join(name));
    places
        .find(|file| file.is_absolute() && file.is_file())
        .ok_or_else(|| Error::ToolMissing(name.to_owned()))
}

/// Returns whether the error is transient, caused by an overloaded machine and not by the tool or its layers.
fn is_of_the_moment(error: &Error) -> bool {
    use std::io::ErrorKind::{Interrupted, OutOfMemory, ResourceBusy, WouldBlock};
    const TOO_MANY_FILES: [Option<i32>; 2] = [Some(libc::EMFILE), Some(libc::ENFILE)];
    match error {
        Error::TimeLimit => true,
        Error::Io { source, .. } => {
            let kinds = [Interrupted, OutOfMemory, ResourceBusy, WouldBlock];
            kinds.contains(&source.kind()) || TOO_MANY_FILES.contains(&source.raw_os_error())
        }
        _ => false,
    }
}

/// Runs the tool for its version in all supported layers, and with fewer layers if that fails. Returns the
/// version and the layers in which it does not run. A transient error never removes a layer.
fn try_out(place: &mut Place) -> Result<(String, Vec<(Layer, String)>), Error> {
    let asked = match ask(place, &["-version"]) {
        Err(error) if is_of_the_moment(&error) => ask(place, &["-version"]),
        asked => asked,
    };
    let whole = match asked {
        Ok(version) => return Ok((version, Vec::new())),
        Err(error) if is_of_the_moment(&error) => return Err(error),
        Err(error) => error.to_string(),
    };
    let all = place.layers;
    let suspects = [Layer::Files, Layer::Calls, Layer::Privileges, Layer::Limits];
    let one_less = suspects.map(|layer| all.without(layer));
    let few = Layers::NONE.with(Layer::Leash);
    for layers in one_less.into_iter().chain([few]) {
        place.layers = layers;
        let Ok(version) = ask(place, &["-version"]) else {
            continue;
        };
        let unbearable = Layer::ALL
            .into_iter()
            .filter(|&layer| all.has(layer) && !layers.has(layer));
        let reason = format!(
            "{} does not run with this layer: {whole}",
            place.path.display()
        );
        let lacks = unbearable.map(|layer| (layer, reason.clone()));
        return Ok((version, lacks.collect()));
    }
    Err(Error::ToolMissing(format!(
        "{} does not run: {whole}",
        place.path.display()
    )))
}

/// Returns the first line of the tool's answer to a query about itself.
fn ask(place: &Place, question: &[&str]) -> Result<String, Error> {
    let text = answer(place, question, false)?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

/// Returns the files that a program needs, as listed by its loader: its library folders and the loader.
fn reach_of(path: &Path) -> Reach {
    let place = Place {
        path: path.to_owned(),
        reach: Reach::default(),
        layers: Layers::OLD,
    };
    let listing = answer(&place, &[], true).unwrap_or_default();
    let mut reach = parse_listing(&listing);
    if reach.reads.is_empty() {
        reach.reads = USUAL_FOLDERS.map(PathBuf::from).to_vec();
    }
    reach.runs.push(path.to_owned());
    reach
}

/// Returns the output of the tool for `question`, or with `of_loader` the list of its libraries.
pub(super) fn answer(place: &Place, question: &[&str], of_loader: bool) -> Result<String, Error> {
    let limits = Limits::default();
    let args = question.iter().map(Into::into).collect();
    let mut order = Order::new(Tool::Ffmpeg, args, &limits, 0);
    if of_loader {
        order = order.listing_libraries();
    }
    let mut child = Child::launch(order, place, std::process::Stdio::null())?;
    let mut text = vec![0; MAX_ANSWER_BYTES];
    let n_bytes = child.read_full(&mut text)?;
    let end = child.finish()?;
    if !of_loader {
        end.check()?;
    }
    Ok(String::from_utf8_lossy(&text[..n_bytes]).into_owned())
}

/// Parses lines such as `libz.so.1 => /lib/libz.so.1 (0x7f00)`. The line of the loader itself has no arrow.
fn parse_listing(listing: &str) -> Reach {
    let mut reach = Reach::default();
    for line in listing.lines().filter(|line| line.contains(" (0x")) {
        let (name, path) = line.split_once("=>").unwrap_or((line, line));
        let path = path.split(" (0x").next().unwrap_or_default().trim();
        let Ok(file) = Path::new(path).canonicalize() else {
            continue;
        };
        if name.contains("/ld-") || !line.contains("=>") {
            reach.runs.push(file.clone());
        }
        let folder = file.parent().map(Path::to_owned);
        reach.reads.extend(folder);
    }
    reach.reads.sort();
    reach.reads.dedup();
    reach
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    #[test]
    fn a_busy_machine_says_nothing_of_a_layer_and_a_refusal_does() {
        let io = |errno| Error::io("starting the media tool")(io::Error::from_raw_os_error(errno));
        for error in [
            Error::TimeLimit,
            io(libc::EAGAIN),
            io(libc::ENOMEM),
            io(libc::EMFILE),
        ] {
            assert!(is_of_the_moment(&error), "{error}");
        }
        for error in [io(libc::EPERM), io(libc::ENOSYS), io(libc::ENOENT)] {
            assert!(!is_of_the_moment(&error), "{error}");
        }
    }
}
