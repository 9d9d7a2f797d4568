//! Films, pictures and masks: the first bytes of a film, the output of ffprobe, and pictures that this process decodes.

use std::fs;
use std::sync::LazyLock;

use flockreel::jobs::masks::Masks;
use flockreel::media::{self, Limits, ReadOptions, Video};
use flockreel_core::footage::FrameSource;
use flockreel_core::raster::Frame;
use tempfile::TempDir;

/// Side of the pictures of the masks' film, pixels.
const SIDE_PX: u32 = 16;

/// Limits of small pictures, so that an input takes milliseconds.
fn limits() -> Limits {
    Limits {
        max_side_px: 512,
        max_pixels: 1 << 16,
        max_frames: 200,
        max_bytes: 1 << 20,
        ..Limits::default()
    }
}

static FOLDER: LazyLock<TempDir> =
    LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));

fn is_pictures(bytes: &[u8]) -> bool {
    // A film would start ffprobe. The target `probe` reads its output.
    let is_animated_webp =
        bytes.get(8..16) == Some(b"WEBPVP8X") && bytes.get(20).is_some_and(|b| b & 2 > 0);
    is_animated_webp
        || [&b"PK\x03\x04"[..], b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]
            .iter()
            .any(|magic| bytes.starts_with(magic))
}

/// Footage of pictures (zip, TIFF or WebP), or one picture: a background.
pub(super) fn pictures(bytes: &[u8]) {
    if !is_pictures(bytes) {
        media::decode_image(bytes, &limits()).map(drop).ok();
        return;
    }
    let path = FOLDER.path().join("footage");
    fs::write(&path, bytes).expect("a temporary folder has room");
    if let Ok(video) = Video::open(&path, &limits()) {
        read_all(&video);
        let masks = Masks::open(&video, &path, None, &limits(), &ReadOptions::default());
        if let Ok(Some(masks)) = masks {
            masks.over(&video).map(|masked| read_all(&masked)).ok();
        }
    }
}

/// Masks for a film of pictures.
pub(super) fn masks(bytes: &[u8]) {
    static VIDEO: LazyLock<Video> = LazyLock::new(|| {
        let path = FOLDER.path().join("pages");
        fs::write(&path, film()).expect("a temporary folder has room");
        Video::open(&path, &limits()).expect("a good film")
    });
    if !is_pictures(bytes) {
        return;
    }
    let path = FOLDER.path().join("masks");
    fs::write(&path, bytes).expect("a temporary folder has room");
    let options = ReadOptions::default();
    let masks = Masks::open(&VIDEO, &path, Some(&path), &limits(), &options);
    if let Ok(Some(masks)) = masks {
        masks.over(&VIDEO).map(|masked| read_all(&masked)).ok();
    }
}

/// Returns a TIFF of three gray pages.
fn film() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut encoder = tiff::encoder::TiffEncoder::new(&mut bytes).expect("memory has room");
    for page in 0..3_u8 {
        let levels = vec![page * 40; (SIDE_PX * SIDE_PX) as usize];
        let written =
            encoder.write_image::<tiff::encoder::colortype::Gray8>(SIDE_PX, SIDE_PX, &levels);
        written.expect("memory has room");
    }
    bytes.into_inner()
}

/// Reads all frames, and some of them in order.
fn read_all(source: &dyn FrameSource) {
    let mut frame = Frame::default();
    if let Ok(mut stream) = source.open() {
        while let Ok(Some(_)) = stream.next_frame(&mut frame) {}
    }
    let visit = &mut |_: &Frame| std::ops::ControlFlow::Continue(());
    source.spread(4, visit).ok();
}

/// What ffprobe prints about a film, and the film: its headers as JSON, the lines of its packets, those of its pictures,
/// and the file. A line `----` ends each part but the last.
pub(super) fn probe(bytes: &[u8]) {
    let mut parts = split(bytes).into_iter();
    let mut next = || parts.next().unwrap_or_default();
    let (header, packets, pictures, film) = (next(), next(), next(), next());
    let path = FOLDER.path().join("film");
    fs::write(&path, film).expect("a temporary folder has room");
    media::check_ffprobe_output(&path, header, packets, pictures, &limits()).ok();
}

fn split(bytes: &[u8]) -> Vec<&[u8]> {
    const END: &[u8] = b"----\n";
    let (mut parts, mut rest) = (Vec::new(), bytes);
    while let Some(at) = rest.windows(END.len()).position(|window| window == END) {
        parts.push(&rest[..at]);
        rest = &rest[at + END.len()..];
    }
    parts.push(rest);
    parts
}
