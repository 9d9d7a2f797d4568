//! Makes a flock of a library and writes its plan and its frames as PNG pictures.
//!
//!     cargo run --release -p flockreel-core --example make_flock LIBRARY_DIR OUTPUT_DIR [COUNT] [FRAMES]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use flockreel_core::flock::composite::Compositor;
use flockreel_core::flock::{Params, plan_flock};
use flockreel_core::formats::{flock_json, library_dir, picture};
use flockreel_core::progress::Silent;
use flockreel_core::scratch::InMemory;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [library_dir, output, rest @ ..] = &args[..] else {
        return Err("usage: make_flock LIBRARY_DIR OUTPUT_DIR [COUNT] [FRAMES]".into());
    };
    let number = |idx: usize| rest.get(idx).map(|text| text.parse::<u32>()).transpose();
    let scratch = Arc::new(InMemory::default());
    let library = library_dir::read(Path::new(library_dir), scratch)?.library;
    let params = Params {
        count: number(0)?,
        frames: number(1)?.unwrap_or(100),
        ..Params::default()
    };
    let flock = plan_flock(&library, &params, &Silent)?;
    let output = Path::new(output);
    std::fs::create_dir_all(output)?;
    std::fs::write(output.join("flock.json"), flock_json::write(&flock))?;
    let compositor = Compositor::new(&library, &flock).straight();
    let [width, height] = compositor.size_px();
    compositor.render_all(
        |_, _| Ok(()),
        |idx, shot| {
            let png = picture::write_rgba(width, height, &shot.rgba);
            std::fs::write(output.join(format!("{idx:06}.png")), png)
        },
    )?;
    println!(
        "{} individuals, {} frames",
        flock.individuals.len(),
        flock.params.frames
    );
    Ok(())
}
