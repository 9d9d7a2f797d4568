//! Sheet of nine samples of a data set with the truth drawn over them, to be looked at before it is made.

use super::scene::Scene;
use super::{Dataset, MakeError};
use flockreel_core::flock::Shot;
use flockreel_core::flock::composite::truth::FrameTruth;
use flockreel_core::progress::Progress;
use flockreel_core::raster::RgbImage;
use flockreel_core::raster::resize::resized;

/// Number of columns and rows.
const SIDE: usize = 3;
/// Largest width and height of a cell, pixels. Free choice: the sheet then fits a screen.
const CELL_PX: [u32; 2] = [640, 480];
/// Colors of outlines, by label. Free choice.
const COLORS: [[u8; 3]; 6] = [
    [255, 80, 80],
    [80, 220, 80],
    [90, 140, 255],
    [255, 200, 0],
    [230, 90, 255],
    [0, 220, 220],
];
/// Colors of keypoints: visible, and hidden.
const POINTS: [[u8; 3]; 2] = [[255, 255, 255], [255, 0, 0]];

impl Dataset {
    /// Returns the sheet. Its samples come from flocks over the whole data set. Outlines show masks; white points
    /// are visible keypoints, red ones hidden.
    pub fn sheet(&self, progress: &dyn Progress) -> Result<RgbImage, MakeError> {
        let n_cells = SIDE * SIDE;
        let mut samples = Vec::new();
        for cell in 0..n_cells {
            let n = self.plan.n_flocks();
            let sequence = &self.plan.sequence(cell * n / n_cells);
            let failed = |cause| MakeError::Flock {
                number: sequence.number,
                cause,
            };
            // The animals meet only after some time, so the sample is the last picture of its part of the flock.
            let pictures = u64::from(self.params.pictures);
            let number = (pictures * (cell as u64 + 1) / (n_cells as u64 + 1)) as u32;
            let scene = Scene::new(self, sequence, number + 1, progress).map_err(failed)?;
            let mut shot = Shot::default();
            let picture = scene.film().render(number, &mut shot);
            samples.push((picture, shot.truth));
            progress.report("drawing samples", (cell + 1) as f64 / n_cells as f64);
        }
        let sizes = samples.iter().map(|(picture, _)| fitted(picture.size()).1);
        let cell_px = sizes.fold([1; 2], |cell, size| [0, 1].map(|k| size[k].max(cell[k])));
        let mut sheet = RgbImage::new(cell_px[0] * SIDE as u32, cell_px[1] * SIDE as u32);
        for (cell, (picture, truth)) in samples.iter().enumerate() {
            let corner = [
                cell_px[0] * (cell % SIDE) as u32,
                cell_px[1] * (cell / SIDE) as u32,
            ];
            draw(&mut sheet, corner, picture, truth);
        }
        Ok(sheet)
    }
}

/// Returns the scale at which a picture fits a cell, and its size there.
fn fitted([width, height]: [u32; 2]) -> (f64, [u32; 2]) {
    let [w, h] = [f64::from(width), f64::from(height)];
    let scale = (f64::from(CELL_PX[0]) / w).min(f64::from(CELL_PX[1]) / h);
    (scale, [w, h].map(|side| ((side * scale) as u32).max(1)))
}

/// Draws a picture and its truth at a corner of the sheet, as large as fits a cell.
fn draw(sheet: &mut RgbImage, [left, top]: [u32; 2], picture: &RgbImage, truth: &FrameTruth) {
    let (scale, size) = fitted(truth.size_px);
    let shown = resized(picture, size[0], size[1]);
    let label = |x: u32, y: u32| {
        let [x, y] = [x, y].map(|at| ((f64::from(at) + 0.5) / scale) as u32);
        let [width, height] = truth.size_px;
        truth.labels[(y.min(height - 1) * width + x.min(width - 1)) as usize]
    };
    for y in 0..size[1] {
        for x in 0..size[0] {
            let own = label(x, y);
            let is_edge = own > 0
                && [
                    (x + 1, y),
                    (x.saturating_sub(1), y),
                    (x, y + 1),
                    (x, y.saturating_sub(1)),
                ]
                .iter()
                .any(|&(x, y)| label(x, y) != own);
            let color = if is_edge {
                COLORS[usize::from(own) % COLORS.len()]
            } else {
                shown.pixel(x, y)
            };
            sheet.set_pixel(left + x, top + y, color);
        }
    }
    for point in truth
        .seen
        .iter()
        .flat_map(|seen| seen.keypoints.iter().flatten())
    {
        let [x, y] = point.px.map(|px| (px * scale).floor() as i64);
        let color = POINTS[usize::from(!point.is_visible)];
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (x, y) = (x + dx, y + dy);
            if (0..i64::from(size[0])).contains(&x) && (0..i64::from(size[1])).contains(&y) {
                sheet.set_pixel(left + x as u32, top + y as u32, color);
            }
        }
    }
}
