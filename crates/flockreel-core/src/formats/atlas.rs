//! The atlas of a library: the animal of every playable frame, packed into a few pictures
//! (docs/reference/formats.md, "Atlas"). Browsers and game engines draw flocks from it.
//!
//! An atlas has two sheets of different resolution, for screens and for phones. The sprites of a sheet are
//! sorted by height and placed in rows from left to right, which wastes little because their heights are
//! similar. The resolution of a sheet is reduced until its pages are few enough.

use serde::Serialize;

use crate::cpu::Level;
use crate::geometry::Rect;
use crate::library::{Library, Matte, Sprites};
use crate::raster::RgbaImage;
use crate::raster::canvas::straight;
use crate::raster::resample::{Placement, Premultiplied, Resampled, Viewport};

/// Name and version of the schema.
const SCHEMA: &str = "flockreel/atlas@1";
/// Largest width and height of a page, pixels. Phones can show textures of this size.
const PAGE_SIDE: u32 = 2048;
/// Transparent pixels between sprites, so that interpolation does not mix them.
const GAP: u32 = 1;
/// Frames before and after the playable frames that fades may show. The longest fade has 16 frames.
const FADE_REACH: usize = 16;
/// Pages and largest resolution of the two sheets. Free choice: a download of a few megabytes, and of one.
const SHEETS: [(&str, usize, f64); 2] = [("atlas", 4, 1.0), ("atlas-small", 1, 0.5)];
/// Factor by which the resolution is reduced if a sheet has too many pages. Free choice.
const REDUCTION: f64 = 0.9;

/// Positions of all sprites in their sheets.
pub struct Atlas {
    frames: Vec<usize>,
    mattes: Vec<Matte>,
    sheets: Vec<Sheet>,
}

/// Pages of one resolution.
struct Sheet {
    name: &'static str,
    /// Pixels of the sheet per pixel of the film, 0..=1.
    scale: f64,
    /// Width and height of each page, pixels.
    pages: Vec<[u32; 2]>,
    /// Page and box of each sprite.
    cells: Vec<Cell>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Cell {
    page: usize,
    rect: Rect,
}

impl Atlas {
    /// Packs the playable frames of a library, and the frames that fades may show beside them.
    pub fn new(library: &Library) -> Atlas {
        let sprites = &library.sprites;
        let mut wanted = vec![false; sprites.n_frames()];
        for &frame in &library.playback.component {
            let frame = frame as usize;
            let end = (frame + FADE_REACH + 1).min(wanted.len());
            wanted[frame.saturating_sub(FADE_REACH)..end].fill(true);
        }
        let shown = wanted.iter().enumerate().filter(|(_, wanted)| **wanted);
        let found = shown.filter_map(|(frame, _)| Some((frame, sprites.matte(frame)?)));
        let (frames, mattes): (Vec<usize>, Vec<Matte>) = found.unzip();
        let sizes: Vec<[u32; 2]> = mattes.iter().map(|matte| matte.size).collect();
        let sheets = SHEETS.map(|(name, n_pages, scale)| Sheet::new(name, &sizes, n_pages, scale));
        Atlas {
            frames,
            mattes,
            sheets: sheets.into(),
        }
    }

    /// Returns the name and content of every page. `sprites` are those of the library.
    pub fn pages<'a>(
        &'a self,
        sprites: &'a Sprites,
    ) -> impl Iterator<Item = (String, RgbaImage)> + 'a {
        self.sheets.iter().flat_map(move |sheet| {
            let pages = sheet.pages.iter().enumerate();
            pages
                .map(move |(page, &size)| (sheet.file(page), self.draw(sheet, page, size, sprites)))
        })
    }

    fn draw(&self, sheet: &Sheet, page: usize, [w, h]: [u32; 2], sprites: &Sprites) -> RgbaImage {
        let mut picture = RgbaImage::new(w, h);
        let (mut rgba, mut drawn) = (Vec::new(), Resampled::default());
        for (matte, cell) in self.mattes.iter().zip(&sheet.cells) {
            if cell.page != page {
                continue;
            }
            sprites.read_matte(matte, &mut rgba);
            let place = Placement {
                center_px: matte.center_px.map(|px| px * sheet.scale),
                rotation_rad: 0.0,
                scale: sheet.scale,
                mirrored: false,
            };
            let sprite = Premultiplied::new(&rgba, matte.size, matte.center_px, sheet.scale);
            let size = [cell.rect.w, cell.rect.h];
            let viewport = Viewport { size, nearer: None };
            drawn.draw(&sprite, &place, viewport, Level::detect());
            for ([x, y], row) in drawn.shown() {
                let first = (cell.rect.y + y) * w + cell.rect.x + x;
                let out = &mut picture.pixels[first as usize * 4..][..row.len() * 4];
                for (out, &pixel) in out.chunks_exact_mut(4).zip(row) {
                    out.copy_from_slice(&straight(pixel));
                }
            }
        }
        picture
    }

    /// Returns the atlas.json.
    pub fn to_json(&self) -> Vec<u8> {
        let file = AtlasFile {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            frame: &self.frames,
            center_px: self.mattes.iter().map(|matte| matte.center_px).collect(),
            sheets: self.sheets.iter().map(Sheet::to_file).collect(),
        };
        serde_json::to_vec(&file).expect("plain values serialize")
    }
}

impl Sheet {
    fn new(name: &'static str, sizes: &[[u32; 2]], max_pages: usize, max_scale: f64) -> Sheet {
        let mut scale = max_scale;
        loop {
            let scaled: Vec<[u32; 2]> = sizes
                .iter()
                .map(|size| size.map(|side| ((f64::from(side) * scale).ceil() as u32).max(1)))
                .collect();
            let packed = pack(&scaled).filter(|(pages, _)| pages.len() <= max_pages);
            if let Some((pages, cells)) = packed {
                return Sheet {
                    name,
                    scale,
                    pages,
                    cells,
                };
            }
            scale *= REDUCTION;
        }
    }

    fn file(&self, page: usize) -> String {
        format!("{}-{page}.webp", self.name)
    }

    fn to_file(&self) -> SheetFile {
        let rects = || self.cells.iter().map(|cell| cell.rect);
        SheetFile {
            scale: self.scale,
            pages: (self.pages.iter().enumerate())
                .map(|(page, &size_px)| PageFile {
                    file: self.file(page),
                    size_px,
                })
                .collect(),
            page: self.cells.iter().map(|cell| cell.page).collect(),
            x: rects().map(|rect| rect.x).collect(),
            y: rects().map(|rect| rect.y).collect(),
            w: rects().map(|rect| rect.w).collect(),
            h: rects().map(|rect| rect.h).collect(),
        }
    }
}

/// Places boxes in rows on pages, the highest first. Returns the size of each page and the place of each box;
/// `None` if a box is larger than a page.
fn pack(sizes: &[[u32; 2]]) -> Option<(Vec<[u32; 2]>, Vec<Cell>)> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&idx| (u32::MAX - sizes[idx][1], idx));
    let (mut pages, mut cells) = (Vec::<[u32; 2]>::new(), vec![Cell::default(); sizes.len()]);
    let (mut x, mut y, mut row_h) = (0, 0, 0);
    for idx in order {
        let [w, h] = sizes[idx];
        if w > PAGE_SIDE || h > PAGE_SIDE {
            return None;
        }
        if x + w > PAGE_SIDE {
            (x, y, row_h) = (0, y + row_h + GAP, 0);
        }
        if pages.is_empty() || y + h > PAGE_SIDE {
            pages.push([0, 0]);
            (x, y, row_h) = (0, 0, 0);
        }
        let page = pages.len() - 1;
        cells[idx] = Cell {
            page,
            rect: Rect { x, y, w, h },
        };
        let size = &mut pages[page];
        *size = [size[0].max(x + w), size[1].max(y + h)];
        x += w + GAP;
        row_h = row_h.max(h);
    }
    Some((pages, cells))
}

#[derive(Serialize)]
struct AtlasFile<'a> {
    schema: &'static str,
    version: &'static str,
    frame: &'a [usize],
    center_px: Vec<[f64; 2]>,
    sheets: Vec<SheetFile>,
}

#[derive(Serialize)]
struct SheetFile {
    scale: f64,
    pages: Vec<PageFile>,
    page: Vec<usize>,
    x: Vec<u32>,
    y: Vec<u32>,
    w: Vec<u32>,
    h: Vec<u32>,
}

#[derive(Serialize)]
struct PageFile {
    file: String,
    size_px: [u32; 2],
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::flock::synthetic;
    use crate::library::View;

    proptest! {
        #[test]
        fn boxes_lie_apart_within_their_pages(sizes in prop::collection::vec([1..300_u32, 1..200_u32], 0..120)) {
            let (pages, cells) = pack(&sizes).expect("no box is larger than a page");
            for (k, cell) in cells.iter().enumerate() {
                prop_assert_eq!([cell.rect.w, cell.rect.h], sizes[k]);
                let [w, h] = pages[cell.page];
                prop_assert!(cell.rect.right() <= w && cell.rect.bottom() <= h && w.max(h) <= PAGE_SIDE);
                for other in &cells[..k] {
                    let apart = other.rect.right() < cell.rect.x || cell.rect.right() < other.rect.x
                        || other.rect.bottom() < cell.rect.y || cell.rect.bottom() < other.rect.y;
                    prop_assert!(other.page != cell.page || apart, "{:?} {:?}", other, cell);
                }
            }
        }
    }

    #[test]
    fn large_sprites_are_reduced_until_they_fit_one_page() {
        let sheet = Sheet::new("atlas", &[[3000, 2000]; 8], 1, 1.0);
        assert!(
            sheet.pages.len() == 1 && sheet.scale < 0.4,
            "{}",
            sheet.scale
        );
    }

    #[test]
    fn a_page_shows_every_playable_frame_as_it_was_cut_out() {
        let library = synthetic::library(View::Side);
        let atlas = Atlas::new(&library);
        let playable = &library.playback.component;
        assert!(
            playable
                .iter()
                .all(|&frame| atlas.frames.contains(&(frame as usize)))
        );
        let pages: Vec<_> = atlas.pages(&library.sprites).collect();
        let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["atlas-0.webp", "atlas-small-0.webp"]);
        let (mut rgba, sheet) = (Vec::new(), &atlas.sheets[0]);
        for (matte, cell) in atlas.mattes.iter().zip(&sheet.cells) {
            library.sprites.read_matte(matte, &mut rgba);
            for (k, pixel) in rgba.chunks_exact(4).enumerate() {
                let (x, y) = (k as u32 % matte.size[0], k as u32 / matte.size[0]);
                let shown = pages[0].1.pixel(cell.rect.x + x, cell.rect.y + y);
                assert!(shown[3].abs_diff(pixel[3]) <= 1, "{shown:?} {pixel:?}");
            }
        }
    }
}
