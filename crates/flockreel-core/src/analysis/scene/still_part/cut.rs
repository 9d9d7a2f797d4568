//! Cuts a picture into two parts along its edges: the cheapest cut, a segmentation of least energy.
//!
//! The energy of a set of pixels is the sum of their costs plus the length of its outline, where outline along an
//! edge of the picture is cheap (Boykov & Jolly, "Interactive graph cuts", 2001). Its relaxation to values of 0
//! to 1 has the same minimum after thresholding (Chan, Esedoglu & Nikolova, "Algorithms for finding global
//! minimizers of image segmentation and denoising models", 2006). A primal-dual iteration finds it (Chambolle &
//! Pock, "A first-order primal-dual algorithm for convex problems", 2011).

use crate::raster::RgbImage;

/// Number of iterations. Free choice: more change few pixels.
const N_ITERATIONS: usize = 300;
/// Step of the iteration: the norm of the gradient operator is at most the root of 8.
const STEP: f32 = 0.353;
/// Cost of a pixel of outline where the picture has no edge, in units of the log-likelihood. Free choice.
const SMOOTHNESS: f32 = 6.0;

/// Returns the pixels of the part of least energy. `costs` has for each pixel of the picture the cost of
/// belonging to the part; it may be infinite.
pub(super) fn cheapest_part(picture: &RgbImage, costs: &[f32]) -> Vec<bool> {
    let (w, h) = (picture.width as usize, picture.height as usize);
    let weights = weights(picture);
    let mut part: Vec<f32> = costs
        .iter()
        .map(|&cost| f32::from(u8::from(cost < 0.0)))
        .collect();
    let mut ahead = part.clone();
    let mut flow = vec![[0f32; 2]; w * h];
    for _ in 0..N_ITERATIONS {
        for y in 0..h {
            for x in 0..w {
                let at = y * w + x;
                let right = if x + 1 < w {
                    ahead[at + 1] - ahead[at]
                } else {
                    0.0
                };
                let down = if y + 1 < h {
                    ahead[at + w] - ahead[at]
                } else {
                    0.0
                };
                let [fx, fy] = [flow[at][0] + STEP * right, flow[at][1] + STEP * down];
                let excess = (libm::hypotf(fx, fy) / weights[at]).max(1.0);
                flow[at] = [fx / excess, fy / excess];
            }
        }
        for y in 0..h {
            for x in 0..w {
                let at = y * w + x;
                let from_left = if x > 0 { flow[at - 1][0] } else { 0.0 };
                let from_above = if y > 0 { flow[at - w][1] } else { 0.0 };
                let right = if x + 1 < w { flow[at][0] } else { 0.0 };
                let down = if y + 1 < h { flow[at][1] } else { 0.0 };
                let divergence = right - from_left + down - from_above;
                let next = (part[at] + STEP * (divergence - costs[at])).clamp(0.0, 1.0);
                ahead[at] = 2.0 * next - part[at];
                part[at] = next;
            }
        }
    }
    part.into_iter().map(|share| share > 0.5).collect()
}

/// Returns the cost of outline at each pixel: `SMOOTHNESS` in even parts, less along edges of the picture.
fn weights(picture: &RgbImage) -> Vec<f32> {
    let (w, h) = (picture.width as usize, picture.height as usize);
    let gap = |a: usize, b: usize| -> f32 {
        (0..3)
            .map(|c| {
                f32::from(picture.pixels[3 * a + c].abs_diff(picture.pixels[3 * b + c])).powi(2)
            })
            .sum()
    };
    let gaps: Vec<f32> = (0..w * h)
        .map(|at| {
            let right = if at % w + 1 < w { gap(at, at + 1) } else { 0.0 };
            let down = if at / w + 1 < h { gap(at, at + w) } else { 0.0 };
            right + down
        })
        .collect();
    let mean = (gaps.iter().sum::<f32>() / gaps.len().max(1) as f32).max(1.0);
    gaps.iter()
        .map(|gap| (SMOOTHNESS * libm::expf(-gap / mean)).max(1e-3))
        .collect()
}
