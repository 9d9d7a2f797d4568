//! Measures the shadow of an animal seen from above: darkness, blur and offset.
//!
//! On the floor beside the animal, the background B loses the same share of light in all colors. The frame
//! shows I = B (1 - d m), where m is the animal's alpha, shifted away from the light and blurred. Shift and
//! blur are the pair, of a small set, that explains most of B - I over many frames. The darkness d is the
//! least-squares solution d = sum(B m (B - I)) / sum((B m)^2). Pixels that show the animal are left out. See
//! docs/explanation/algorithms.md, "Shadows".

use super::track::sighting::{Sighting, Surroundings};
use super::track::{Track, Tracked};
use crate::library::Shadow;
use crate::order::median;
use crate::raster::{RgbImage, RgbaImage};

/// Least distance between two places of the animal that are used, body lengths. Free choice.
const MIN_DISTANCE_BL: f64 = 0.5;
/// Greatest number of places used. Free choice: it bounds the time.
const MAX_PLACES: usize = 100;
/// Least number of places. With fewer, a mirror image or moved bedding could be mistaken for a shadow. Free
/// choice.
const MIN_PLACES: usize = 4;
/// Square cells per body length. Cell means suffice, because shadows are soft. Free choice.
const CELLS_PER_BL: f64 = 32.0;
/// Greatest shift tried in each direction, cells. Free choice.
const MAX_SHIFT: i32 = 8;
/// Blurs tried: standard deviations of a Gaussian, cells. Free choice.
const BLURS: [f64; 4] = [1.0, 2.0, 3.0, 4.5];
/// Greatest share of a cell that the animal may cover; other cells and their neighbors are left out. Free
/// choice.
const MAX_COVERED: f32 = 0.02;
/// Greatest distance of a cell from the animal, cells; farther ones may show other things. Free choice.
const MAX_DISTANCE_CELLS: usize = 8;
/// Least brightness of a cell's background, as a share of that behind the animal. Darker cells are not on the
/// same floor. Free choice.
const MIN_BRIGHTNESS: f32 = 0.65;
/// Least darkness of a shadow, 0..=1. Free choice: less is noise or the blurred edge of the animal.
const MIN_DARKNESS: f64 = 0.05;
/// Least share of the squared differences around the animal that the shadow explains. Of the clips in
/// docs/measurements.md, only the round arena exceeds it.
const MIN_EXPLAINED: f64 = 0.25;

/// Returns the shadow of an animal of length `length_px` in front of the main background.
///
/// `background` is the image of that background. Returns `None` when no shadow can be told from noise.
pub fn measure(track: &Track, background: &RgbImage, length_px: f64) -> Option<Shadow> {
    let places = places(track, length_px);
    if places.len() < MIN_PLACES {
        return None;
    }
    let cell_px = (length_px / CELLS_PER_BL).max(1.0);
    let mut fit = Fit::default();
    for (sighting, surroundings) in places {
        let mut pixels = RgbImage::new(surroundings.rect.w, surroundings.rect.h);
        track.scratch.get(surroundings.at, &mut pixels.pixels);
        let view = View {
            sighting,
            surroundings,
            seen: &pixels,
            matte: &track.image(sighting),
            background,
        };
        fit.add(&view.cells(cell_px));
    }
    fit.solved(cell_px / length_px)
}

/// Returns frames in which the animal is at distant places.
///
/// A shadow follows the animal to all of them. A mirror image in a wall and moved bedding do not.
fn places(track: &Track, length_px: f64) -> Vec<(&Sighting, Surroundings)> {
    let mut places: Vec<(&Sighting, Surroundings)> = Vec::new();
    for seen in track
        .frames
        .iter()
        .filter_map(Tracked::before_main_background)
    {
        let [x, y] = seen.moments.centroid_px;
        let is_apart = |(other, _): &(&Sighting, Surroundings)| {
            let [u, v] = other.moments.centroid_px;
            libm::hypot(x - u, y - v) >= MIN_DISTANCE_BL * length_px
        };
        if let Some(surroundings) = seen.surroundings
            && places.len() < MAX_PLACES
            && places.iter().all(is_apart)
        {
            places.push((seen, surroundings));
        }
    }
    places
}

/// The surroundings of the animal in one frame.
struct View<'a> {
    sighting: &'a Sighting,
    surroundings: Surroundings,
    seen: &'a RgbImage,
    matte: &'a RgbaImage,
    background: &'a RgbImage,
}

/// The surroundings of the animal in cells, row by row.
#[derive(Default)]
struct Cells {
    width: usize,
    height: usize,
    /// Share of the cell that the animal covers, 0..=1.
    alpha: Vec<f32>,
    /// Mean brightness of the background, levels of 255.
    back: Vec<f32>,
    /// Loss of brightness in the frame, levels of 255. The color with the smallest loss counts, as a shadow
    /// dims all.
    lost: Vec<f32>,
}

impl View<'_> {
    fn cells(&self, cell_px: f64) -> Cells {
        let rect = self.surroundings.rect;
        let n_cells = |px: u32| (f64::from(px) / cell_px).ceil() as usize;
        let (width, height) = (n_cells(rect.w), n_cells(rect.h));
        let mut sums = vec![[0.0f32; 8]; width * height];
        for (y, x) in (0..rect.h).flat_map(|y| (0..rect.w).map(move |x| (y, x))) {
            let cell = |px: u32| ((f64::from(px) + 0.5) / cell_px) as usize;
            let sum = &mut sums[cell(y) * width + cell(x)];
            let back = self.background.pixel(rect.x + x, rect.y + y);
            let seen = self.seen.pixel(x, y);
            for c in 0..3 {
                sum[c] += f32::from(back[c]);
                sum[3 + c] += f32::from(seen[c]);
            }
            sum[6] += self.alpha(rect.x + x, rect.y + y);
            sum[7] += 1.0;
        }
        let mut cells = Cells {
            width,
            height,
            ..Cells::default()
        };
        for sum in sums {
            let lost = (0..3).map(|c| 1.0 - sum[3 + c] / sum[c].max(1.0));
            let back = (sum[0] + sum[1] + sum[2]) / (3.0 * sum[7].max(1.0));
            cells.alpha.push(sum[6] / sum[7].max(1.0));
            cells.back.push(back);
            cells.lost.push(back * lost.fold(1.0, f32::min));
        }
        cells
    }

    fn alpha(&self, x: u32, y: u32) -> f32 {
        let rect = self.sighting.rect;
        if rect.contains(x, y) {
            f32::from(self.matte.pixel(x - rect.x, y - rect.y)[3]) / 255.0
        } else {
            0.0
        }
    }
}

/// Sums of the least-squares solutions for every blur and shift.
///
/// The sum of the squared losses is scaled to 1 for each place. Otherwise, places with a mirror image would
/// dominate.
struct Fit {
    sums: Vec<[f64; 2]>,
    n_places: f64,
}

impl Default for Fit {
    fn default() -> Fit {
        Fit {
            sums: vec![[0.0; 2]; BLURS.len() * shifts().count()],
            n_places: 0.0,
        }
    }
}

fn shifts() -> impl Iterator<Item = [i32; 2]> + Clone {
    let along = || -MAX_SHIFT..=MAX_SHIFT;
    along().flat_map(move |dy| along().map(move |dx| [dx, dy]))
}

impl Fit {
    fn add(&mut self, cells: &Cells) {
        let floor_cells = cells.floor_cells();
        let at = |[x, y]: [i32; 2]| y as usize * cells.width + x as usize;
        let squared = |&xy: &[i32; 2]| f64::from(cells.lost[at(xy)]).powi(2);
        let weight = 1.0 / floor_cells.iter().map(squared).sum::<f64>().max(1.0);
        self.n_places += 1.0;
        let mut sums = self.sums.iter_mut();
        for sigma in BLURS {
            let blurred = cells.blurred(sigma);
            for ([dx, dy], sum) in shifts().zip(&mut sums) {
                for &[x, y] in &floor_cells {
                    let from = [x - dx, y - dy];
                    let is_in = (0..cells.width as i32).contains(&from[0])
                        && (0..cells.height as i32).contains(&from[1]);
                    if is_in {
                        let shade = f64::from(cells.back[at([x, y])] * blurred[at(from)]);
                        sum[0] += weight * shade * f64::from(cells.lost[at([x, y])]);
                        sum[1] += weight * shade * shade;
                    }
                }
            }
        }
    }

    /// Returns the shadow that explains most; cells are `cell_bl` body lengths wide.
    fn solved(&self, cell_bl: f64) -> Option<Shadow> {
        let places = BLURS
            .iter()
            .flat_map(|blur| shifts().map(move |shift| (*blur, shift)));
        let explained = |[along, squared]: [f64; 2]| along.max(0.0).powi(2) / squared.max(1e-9);
        let ((blur, shift), best) = (places.zip(&self.sums))
            .max_by(|(_, a), (_, b)| explained(**a).total_cmp(&explained(**b)))?;
        let darkness = (best[0] / best[1].max(1e-9)).min(1.0);
        let is_shadow =
            darkness >= MIN_DARKNESS && explained(*best) >= MIN_EXPLAINED * self.n_places;
        is_shadow.then(|| Shadow {
            darkness,
            offset_bl: shift.map(|cells| f64::from(cells) * cell_bl),
            blur_bl: blur * cell_bl,
        })
    }
}

impl Cells {
    /// Returns column and row of the cells beside the animal that show its floor.
    ///
    /// Cells much darker than the background behind the animal are left out: a dark wall shows a mirror
    /// image.
    fn floor_cells(&self) -> Vec<[i32; 2]> {
        let shows = |k: usize| self.alpha[k] > MAX_COVERED;
        let behind = median(
            (0..self.alpha.len())
                .filter(|&k| shows(k))
                .map(|k| f64::from(self.back[k])),
        );
        let least = MIN_BRIGHTNESS * behind.unwrap_or(0.0) as f32;
        let is_near = |k: usize, reach: usize| {
            let (x, y) = (k % self.width, k / self.width);
            let columns = x.saturating_sub(reach)..(x + reach + 1).min(self.width);
            let rows = y.saturating_sub(reach)..(y + reach + 1).min(self.height);
            let mut all = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
            all.any(|(x, y)| shows(y * self.width + x))
        };
        (0..self.alpha.len())
            .filter(|&k| self.back[k] >= least && is_near(k, MAX_DISTANCE_CELLS) && !is_near(k, 1))
            .map(|k| [(k % self.width) as i32, (k / self.width) as i32])
            .collect()
    }

    /// Returns alpha after a Gaussian blur of `sigma` cells.
    fn blurred(&self, sigma: f64) -> Vec<f32> {
        let reach = (3.0 * sigma).ceil() as i32;
        let weight = |k: i32| libm::exp(-f64::from(k * k) / (2.0 * sigma * sigma)) as f32;
        let weights: Vec<f32> = (-reach..=reach).map(weight).collect();
        let total: f32 = weights.iter().sum();
        let pass = |from: &[f32], step: [i32; 2]| {
            let (width, height) = (self.width as i32, self.height as i32);
            let mut result = Vec::with_capacity(from.len());
            for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
                let weighted = |(k, weight): (i32, &f32)| {
                    let (x, y) = (x + step[0] * k, y + step[1] * k);
                    let is_in = (0..width).contains(&x) && (0..height).contains(&y);
                    if is_in {
                        weight * from[(y * width + x) as usize]
                    } else {
                        0.0
                    }
                };
                result.push((-reach..).zip(&weights).map(weighted).sum::<f32>() / total);
            }
            result
        };
        pass(&pass(&self.alpha, [1, 0]), [0, 1])
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geometry::Rect;
    use crate::scratch::{InMemory, Scratch};

    const PAPER: u8 = 180;
    const LENGTH: u32 = 60;

    /// Returns the share of a pixel covered by a body of 60 x 24 pixels centered at the origin.
    fn body(x: f64, y: f64) -> f64 {
        let away = libm::hypot(x / 30.0, y / 12.0);
        ((1.0 - away) * 12.0 + 0.5).clamp(0.0, 1.0)
    }

    /// Returns the track of a dark animal at several places; `cast` is the share of light left around its
    /// center.
    fn track(cast: impl Fn(f64, f64) -> f64) -> (Track, RgbImage) {
        let scratch: Arc<dyn Scratch> = Arc::new(InMemory::default());
        let background = picture([300, 160], |_, _| PAPER);
        let rect = |x: u32, y: u32, [w, h]: [u32; 2]| Rect {
            x: x - w / 2,
            y: y - h / 2,
            w,
            h,
        };
        let frames = (0..5).map(|k| {
            let (cx, cy) = (70 + 35 * k, 60 + 8 * k);
            let [own, around] = [rect(cx, cy, [64, 28]), rect(cx, cy, [120, 90])];
            let place = |rect: Rect, x: u32, y: u32| {
                let off = |at: u32, first: u32, c: u32| f64::from(first + at) + 0.5 - f64::from(c);
                (off(x, rect.x, cx), off(y, rect.y, cy))
            };
            let mut matte = RgbaImage::new(own.w, own.h);
            for (y, x) in (0..own.h).flat_map(|y| (0..own.w).map(move |x| (y, x))) {
                let (u, v) = place(own, x, y);
                matte.set_pixel(x, y, [20, 20, 20, (255.0 * body(u, v)) as u8]);
            }
            let seen = picture([around.w, around.h], |x, y| {
                let (u, v) = place(around, x, y);
                let floor = f64::from(PAPER) * cast(u, v);
                (floor + body(u, v) * (20.0 - floor)) as u8
            });
            let measured = Sighting::measured(own, &matte).expect("it is opaque");
            let put = |bytes: &[u8]| scratch.put(bytes).expect("memory has room");
            let sighting = Sighting {
                at: put(&matte.pixels),
                surroundings: Some(Surroundings {
                    rect: around,
                    at: put(&seen.pixels),
                }),
                ..measured
            };
            Tracked {
                time_s: f64::from(k),
                background_idx: Some(0),
                sighting: Some(sighting),
            }
        });
        let frames = frames.collect();
        (
            Track {
                frames,
                movers: Vec::new(),
                disturbances: Vec::new(),
                scratch: Arc::clone(&scratch),
            },
            background,
        )
    }

    fn picture([width, height]: [u32; 2], shade: impl Fn(u32, u32) -> u8) -> RgbImage {
        let pixels = (0..width * height).flat_map(|k| [shade(k % width, k / width); 3]);
        RgbImage {
            width,
            height,
            pixels: pixels.collect(),
        }
    }

    fn measured(cast: impl Fn(f64, f64) -> f64) -> Option<Shadow> {
        let (track, background) = track(cast);
        measure(&track, &background, f64::from(LENGTH))
    }

    #[test]
    fn cast_shadow_is_measured() {
        // Mean of the body over 11 x 11 pixels, 9 px to the right and 6 px up.
        let soft = |x: f64, y: f64| {
            let at = |k: i32| f64::from(k);
            let all = (-5..6)
                .flat_map(|dy| (-5..6).map(move |dx| body(x - 9.0 + at(dx), y + 6.0 + at(dy))));
            all.sum::<f64>() / 121.0
        };
        let shadow = measured(|x, y| 1.0 - 0.4 * soft(x, y)).expect("it is plain");
        assert!((shadow.darkness - 0.4).abs() < 0.04, "{shadow:?}");
        let [x, y] = shadow.offset_bl;
        assert!(
            (x - 0.15).abs() < 0.035 && (y + 0.1).abs() < 0.035,
            "{shadow:?}"
        );
        // A box of 11 has a standard deviation of 3.2 px.
        assert!((shadow.blur_bl - 3.2 / 60.0).abs() < 0.02, "{shadow:?}");
    }

    #[test]
    fn bright_rim_and_distant_object_are_no_shadow() {
        assert_eq!(measured(|_, _| 1.0), None);
        assert_eq!(
            measured(|x, y| if libm::hypot(x, y) < 36.0 { 1.1 } else { 1.0 }),
            None
        );
        assert_eq!(measured(|x, _| if x > 48.0 { 0.4 } else { 1.0 }), None);
    }
}
