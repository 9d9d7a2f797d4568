//! The two media tools: where they lie, what they are made of, and in which layers of the sandbox they
//! can work (RELIABILITY.md, "The gate"). Found out once, at the first need: a layer that the kernel
//! lacks or in which the installed tool does not even tell its version is left out, and said; with
//! `--sandbox strict` nothing is started then.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};

use super::error::Error;
use super::gate::{Child, Order};
use super::limits::Limits;
use super::sandbox::{Layer, Layers, Reach, lack_of, landlock_abi};
use crate::config::{Media, Sandbox};

/// The two programs that may be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tool {
    /// Reads headers and packet times.
    Ffprobe,
    /// Decodes and encodes.
    Ffmpeg,
}

/// An installed tool.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// The program.
    pub(super) path: PathBuf,
    /// What it is made of.
    pub(super) reach: Reach,
    /// The layers in which it works here.
    pub(super) layers: Layers,
}

/// What is known of the media tool and of the walls around it on this machine.
#[derive(Clone, Debug)]
pub struct Walls {
    /// The version line of ffmpeg.
    pub version: String,
    /// Landlock's version in the kernel, where it has it.
    pub landlock_abi: Option<i64>,
    /// Every layer, with the reason where it does not stand.
    pub layers: Vec<(Layer, Option<String>)>,
}

/// A tool that was looked for.
struct Found {
    place: Place,
    version: String,
    lacks: Vec<(Layer, String)>,
}

/// The search for a tool.
struct Search {
    outcome: OnceLock<Result<Found, String>>,
    /// Held by who searches, so that whoever comes meanwhile waits instead of searching too.
    turn: Mutex<()>,
}

static SETTINGS: OnceLock<Media> = OnceLock::new();
static FFMPEG: Search = Search::new();
static FFPROBE: Search = Search::new();

/// Folders of libraries where the loader tells none: a program in one piece, or another loader.
const USUAL_FOLDERS: [&str; 5] = ["/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib"];

/// What a tool may say of itself at most, bytes.
const MAX_ANSWER_BYTES: usize = 1 << 20;

/// Chooses tools and sandbox for this process. Called before any film is touched; later calls change
/// nothing.
pub fn set_up(settings: &Media) {
    // A second call finds the first one's choice.
    SETTINGS.set(settings.clone()).ok();
}

/// Begins to look for tools beside what comes next: to start one and ask its version takes a while, and whoever
/// needs it later need not wait so long.
pub fn look_for(tools: &[Tool]) {
    for &tool in tools {
        // Where no thread can be had, or nothing is found, it is looked for again where it is needed, and said.
        let thread = std::thread::Builder::new();
        thread.spawn(move || found(tool).is_ok()).ok();
    }
}

/// What stands around every media child here. Fails when a tool is missing or does not run at all.
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

/// The same, refused with one sentence where `--sandbox strict` is asked for and a layer is missing.
pub fn demanded_walls() -> Result<Walls, Error> {
    place(Tool::Ffprobe)?;
    place(Tool::Ffmpeg)?;
    walls()
}

/// The version line of the installed ffmpeg.
pub fn tool_version() -> Result<String, Error> {
    found(Tool::Ffmpeg).map(|found| found.version.clone())
}

/// Where a tool lies and what it can bear; refused where it is missing, or where `strict` is not met.
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

/// Where ffmpeg lies, whether or not its walls are as demanded: for questions about itself.
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

    /// What came of it; searches where nobody has. What is only of the moment is no outcome.
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
            true => Some("it is turned off".to_owned()),
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

/// Whether it says something of a machine that had too much to do, and nothing of the tool or its layers.
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

/// Lets the tool tell its version in all layers that there are; where it cannot, in fewer. Returns
/// what it said, and which layers it cannot bear. No layer is given up because the machine was busy.
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
        let reason = format!("{} does not run in it: {whole}", place.path.display());
        let lacks = unbearable.map(|layer| (layer, reason.clone()));
        return Ok((version, lacks.collect()));
    }
    Err(Error::ToolMissing(format!(
        "{} does not run: {whole}",
        place.path.display()
    )))
}

/// The first line that the tool answers to a question about itself.
fn ask(place: &Place, question: &[&str]) -> Result<String, Error> {
    let text = answer(place, question, false)?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

/// What a program is made of, as the loader tells it: the folders of its libraries, and the loader.
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

/// Everything that the tool says, or its loader when asked for the libraries.
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

/// Lines such as `libz.so.1 => /lib/libz.so.1 (0x7f00)`, and the loader's own, which has no arrow.
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
