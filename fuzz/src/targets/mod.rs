//! Fuzz targets: each passes bytes to one reader of foreign bytes, and then does with the result what the program does
//! (docs/explanation/promises.md, "Parsers do not fall over"). A target returns for every input. A panic, an abort, an
//! internal error of the service, or a limit of memory or time is a fault.
//!
//! libFuzzer runs the targets (`make fuzz`), and `tests/it/fuzz.rs` replays the inputs in `fuzz/corpus`.

mod footage; // films, pictures and masks
mod library; // folders of libraries, and flocks made from them
mod parameters; // JSON objects of requests
mod service; // HTTP requests to the whole service
mod settings; // settings file, flags, places of data

/// A target: reads bytes and panics at a fault.
pub type Target = fn(&[u8]);

/// All targets by name. The name is that of the target's folder in `fuzz/corpus`.
pub const ALL: [(&str, Target); 14] = [
    ("analysis", parameters::analysis),
    ("fish", parameters::fish),
    ("flock", parameters::flock),
    ("form", service::form),
    ("library", library::library),
    ("masks", footage::masks),
    ("names", service::names),
    ("pictures", footage::pictures),
    ("plan", library::plan),
    ("poses", library::poses),
    ("probe", footage::probe),
    ("range", service::range),
    ("request", service::request),
    ("settings", settings::settings),
];

/// Memory that the process may map, bytes. The largest picture within the limits needs a few hundred megabytes.
const MAX_MEMORY_BYTES: u64 = 3 << 30;

/// Limits the memory of this process, so that an input that asks for more aborts it. Child processes have limits of
/// their own. Call it before the first target.
pub fn limit_memory() {
    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
    let limit = Rlimit {
        current: Some(MAX_MEMORY_BYTES),
        maximum: getrlimit(Resource::As).maximum,
    };
    setrlimit(Resource::As, limit).expect("a process may lower its own limit");
}

/// Runs a target by name, for libFuzzer.
pub fn run(name: &str, bytes: &[u8]) {
    let target = ALL.iter().find(|(known, _)| *known == name);
    target.expect("a target of this name").1(bytes);
}
