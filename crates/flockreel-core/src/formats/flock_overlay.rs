//! The boids drawn over the video of their flock (Okabe et al., figure 10). For each individual: position and
//! heading of the boid, a line to the drawn animal, the heading of the animal, and its number.

use super::overlay::{RIM, arrow, unit_px, write_rim};
use crate::flock::{Flock, Individual};
use crate::raster::{Frame, Pen};

const BOID: [u8; 3] = [84, 214, 230];
const SHOWN: [u8; 3] = [255, 132, 60];
const NUMBER: [u8; 3] = [236, 240, 238];

/// Draws the boids of a flock over its video.
pub struct FlockOverlay {
    pen: Pen,
    scale: f64,
    offset_px: [f64; 2],
    /// Unit of stroke widths, pixels; grows with the picture size.
    unit_px: f64,
    /// Length of the heading lines, pixels.
    reach_px: f64,
}

impl FlockOverlay {
    /// Makes an overlay for videos of `size_px`. The flock's picture is scaled to fit and centered.
    pub fn new(flock: &Flock, size_px: [u32; 2]) -> FlockOverlay {
        let [w, h] = flock.image_size_px.map(f64::from);
        let [width, height] = size_px.map(f64::from);
        let scale = (width / w).min(height / h);
        let unit_px = unit_px(size_px[0], size_px[1]);
        FlockOverlay {
            pen: Pen::new(size_px[0], size_px[1]),
            scale,
            offset_px: [(width - w * scale) / 2.0, (height - h * scale) / 2.0],
            unit_px,
            reach_px: (0.5 * flock.length_px * scale).max(10.0 * unit_px),
        }
    }

    /// Draws over a frame of the video.
    pub fn draw(&mut self, flock: &Flock, frame_idx: usize, frame: &mut Frame) {
        let unit = self.unit_px;
        for individual in &flock.individuals {
            let (boid, shown) = self.positions(individual, frame_idx);
            let (meant, seen) = (
                self.arrow(boid, individual.boid.heading_rad[frame_idx]),
                self.arrow(shown, individual.heading_rad[frame_idx]),
            );
            self.stroke(frame, &[boid, shown], 0.4 * unit, BOID);
            self.stroke(frame, &meant, 0.8 * unit, BOID);
            self.stroke(frame, &[boid, boid], 2.4 * unit, BOID);
            self.stroke(frame, &seen, 0.8 * unit, SHOWN);
            let at = [boid[0] + 5.0 * unit, boid[1] + 4.0 * unit];
            self.number(frame, &individual.id.to_string(), at);
        }
    }

    /// Returns the positions of the boid and its animal in the video, pixels.
    fn positions(&self, individual: &Individual, frame_idx: usize) -> ([f64; 2], [f64; 2]) {
        let [x, y, _] = individual.boid.position_px[frame_idx];
        let film = |at: [f64; 2]| [0, 1].map(|k| self.offset_px[k] + at[k] * self.scale);
        (film([x, y]), film(individual.centroid_px[frame_idx]))
    }

    fn arrow(&self, from: [f64; 2], heading_rad: f64) -> [[f64; 2]; 5] {
        arrow(from, heading_rad, self.reach_px, 5.0 * self.unit_px)
    }

    fn number(&mut self, frame: &mut Frame, text: &str, at: [f64; 2]) {
        let dot_px = 1.1 * self.unit_px;
        write_rim(&mut self.pen, frame, text, at, dot_px, 0.7 * dot_px);
        self.pen.text(text, at, dot_px);
        self.pen.draw(frame, NUMBER);
    }

    /// Draws a line in one color with a dark outline.
    fn stroke(&mut self, frame: &mut Frame, points: &[[f64; 2]], radius_px: f64, rgb: [u8; 3]) {
        self.pen
            .polyline(points, radius_px + 0.7 * self.unit_px, 0.45);
        self.pen.draw(frame, RIM);
        self.pen.polyline(points, radius_px, 1.0);
        self.pen.draw(frame, rgb);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::{Params, plan_flock, synthetic};
    use crate::library::View;
    use crate::progress::Silent;
    use crate::raster::ColorSpec;

    #[test]
    fn boids_are_marked_at_their_positions_at_any_size() {
        let params = Params {
            count: Some(3),
            frames: 10,
            ..Params::default()
        };
        let library = synthetic::library(View::Side);
        let flock = plan_flock(&library, &params, &Silent).expect("a good library");
        for (size_px, scale) in [([320, 240], 1.0), ([640, 480], 2.0)] {
            let mut frame = Frame::new(size_px[0], size_px[1], ColorSpec::default());
            FlockOverlay::new(&flock, size_px).draw(&flock, 5, &mut frame);
            let luma = |x: f64, y: f64| frame.luma()[y as usize * size_px[0] as usize + x as usize];
            for individual in &flock.individuals {
                let [x, y, _] = individual.boid.position_px[5];
                assert!(luma(x * scale, y * scale) > 80, "{x} {y}");
            }
            let n_marked = frame.luma().iter().filter(|&&value| value > 0).count();
            assert!(n_marked < frame.luma().len() / 4, "{n_marked}");
        }
    }
}
