//! Learns which moving thing is the animal: its size and color, from frames of the whole film.
//!
//! Each component of each sample frame is described by its [`Look`]. The [`Subject`] is the look that
//! explains the most samples as one body. It occurs once per frame, moves about and differs clearly from the
//! background. A hand, a plant, a shadow or a mirror image explains fewer samples or stays in place. The
//! subject then scores the candidates of every frame.

use crate::geometry::Rect;
use crate::order;
use crate::raster::RgbImage;
use crate::raster::runs::{Component, Run};

/// Histogram bins of a color channel. Free choice.
const N_BINS: usize = 16;
/// Greatest number of pixels sampled from a component. Free choice: it bounds the time.
const MAX_SAMPLED_PX: u64 = 2048;
/// Standard deviation of one animal's color between frames, levels of 255. Free choice.
const COLOR_SPREAD: f64 = 14.0;
/// Standard deviation of log area between frames: a fish turned toward the camera covers a third. Free
/// choice.
const AREA_SPREAD: f64 = 0.45;
/// Cost below which a look fits the subject: two standard deviations, squared.
pub const FITS: f64 = 4.0;
/// Number of components per sample that are tried as the subject. Free choice.
const SEEDS_PER_SAMPLE: usize = 3;
/// Least area of a component, pixels; smaller ones are noise. Free choice.
pub const MIN_AREA_PX: u64 = 12;

/// Cumulative histograms of R, G and B, each rising to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Color([[f32; N_BINS]; 3]);

impl Color {
    /// Returns the color histogram of RGB pixels.
    pub fn from_pixels<'a>(pixels: impl Iterator<Item = &'a [u8]>) -> Color {
        let mut counts = [[0.0f32; N_BINS]; 3];
        let mut n = 0.0;
        for rgb in pixels {
            n += 1.0;
            for (counts, &value) in counts.iter_mut().zip(rgb) {
                // A value counts for the two nearest bins, so that a change of one level changes little.
                let at = f32::from(value) * (N_BINS - 1) as f32 / 255.0;
                let low = at as usize;
                counts[low] += 1.0 - (at - low as f32);
                counts[(low + 1).min(N_BINS - 1)] += at - low as f32;
            }
        }
        for counts in &mut counts {
            let mut below = 0.0;
            for count in counts {
                below += *count / f32::max(n, 1.0);
                *count = below;
            }
        }
        Color(counts)
    }

    /// Returns the color histogram of a picture inside a component.
    pub fn in_component(picture: &RgbImage, component: &Component) -> Color {
        let row = |run: &Run| {
            let first = run.y as usize * picture.width as usize;
            let pixels = first + run.x0 as usize..first + run.x1 as usize;
            picture.pixels[3 * pixels.start..3 * pixels.end].chunks(3)
        };
        Color::from_pixels(component.runs.iter().flat_map(row))
    }

    /// Returns the earth mover's distance of two colors, as the mean over the channels, levels of 255.
    pub fn distance(&self, other: &Color) -> f64 {
        let channel = |(a, b): (&[f32; N_BINS], &[f32; N_BINS])| {
            a.iter()
                .zip(b)
                .map(|(a, b)| f64::from((a - b).abs()))
                .sum::<f64>()
        };
        let sum: f64 = self.0.iter().zip(&other.0).map(channel).sum();
        sum * 255.0 / (N_BINS - 1) as f64 / 3.0
    }

    fn mean<'a>(all: impl Iterator<Item = &'a Color>) -> Color {
        let mut sum = [[0.0; N_BINS]; 3];
        let mut n = 0.0;
        for color in all {
            n += 1.0;
            for (sum, values) in sum.iter_mut().flatten().zip(color.0.iter().flatten()) {
                *sum += values;
            }
        }
        Color(sum.map(|bins| bins.map(|value| value / f32::max(n, 1.0))))
    }
}

/// Measurements of one component: size, color and place.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Area, pixels.
    pub area_px: f64,
    /// Color, in the light of the background.
    pub color: Color,
    /// Mean difference from the background, levels of 255.
    pub contrast: f64,
    /// Bounding box, pixels.
    pub box_px: Rect,
    /// Mean of the pixel centers, pixels.
    pub centroid_px: [f64; 2],
    /// Whether the box touches the border of the picture.
    pub on_border: bool,
    /// Whether it has the background's color, but darker.
    pub is_shadow: bool,
    /// Whether the thing is in the background and not in the frame.
    pub is_ghost: bool,
    /// Index of the light that the background was filmed in.
    pub light: usize,
}

impl Look {
    /// Measures a component. `rgb` and `levels` (differences from the background) cover the component's box.
    pub fn measure(
        component: &Component,
        rgb: &RgbImage,
        levels: &[u8],
        picture: [u32; 2],
        light: usize,
    ) -> Look {
        let rect = component.rect;
        let step = component.area.div_ceil(MAX_SAMPLED_PX).max(1) as usize;
        let indices = || {
            let indices_of = move |run: &Run| {
                let row = (run.y - rect.y) as usize * rect.w as usize;
                (run.x0 - rect.x) as usize + row..(run.x1 - rect.x) as usize + row
            };
            component.runs.iter().flat_map(indices_of).step_by(step)
        };
        let n = indices().count().max(1) as f64;
        Look {
            area_px: component.area as f64,
            color: Color::from_pixels(indices().map(|k| &rgb.pixels[3 * k..3 * k + 3])),
            contrast: indices().map(|k| f64::from(levels[k])).sum::<f64>() / n,
            box_px: rect,
            centroid_px: component.centroid_px(),
            on_border: touches_border(rect, picture),
            is_shadow: false,
            is_ghost: false,
            light,
        }
    }

    fn may_be_animal(&self) -> bool {
        !self.is_ghost && self.area_px >= MIN_AREA_PX as f64
    }

    fn diagonal_px(&self) -> f64 {
        libm::hypot(f64::from(self.box_px.w), f64::from(self.box_px.h))
    }
}

/// Returns whether a box touches the border of a picture of the given size.
pub fn touches_border(rect: Rect, [width, height]: [u32; 2]) -> bool {
    rect.x == 0 || rect.y == 0 || rect.right() == width || rect.bottom() == height
}

/// The animal's usual size, color and contrast in the film.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// Mean color for each light; `None` where the animal was not seen in it.
    colors: Vec<Option<Color>>,
    /// 5th percentile, median and 95th percentile of the area, pixels.
    areas_px: [f64; 3],
    /// Median diagonal of the bounding box, pixels.
    pub diagonal_px: f64,
    /// Median contrast, levels of 255.
    pub contrast: f64,
}

impl Subject {
    /// Learns the subject from the looks of samples; returns `None` when there are none.
    ///
    /// `at` is a sample and the index of its component that is known to be the animal.
    pub fn learn(samples: &[Vec<Look>], at: Option<(usize, usize)>) -> Option<Subject> {
        let seed = match at {
            Some((sample, component)) => Subject::from_look(&samples[sample][component]),
            None => best_seed(samples)?,
        };
        let mut subject = seed;
        for _ in 0..2 {
            subject = subject.refined(samples);
        }
        Some(subject)
    }

    /// Returns the subject of a single look.
    fn from_look(look: &Look) -> Subject {
        Subject {
            colors: (0..=look.light)
                .map(|light| (light == look.light).then(|| look.color.clone()))
                .collect(),
            areas_px: [look.area_px; 3],
            diagonal_px: look.diagonal_px(),
            contrast: look.contrast,
        }
    }

    /// Returns the median area, pixels.
    pub fn area_px(&self) -> f64 {
        self.areas_px[1]
    }

    /// Returns the least area of a moving object, pixels: 0.3 of the subject's, but at least `MIN_AREA_PX`.
    pub fn least_area_px(&self) -> u64 {
        ((0.3 * self.area_px()) as u64).max(MIN_AREA_PX)
    }

    /// Returns whether a color fits the subject in a look's light, and better than the look's own color.
    pub fn prefers(&self, color: &Color, look: &Look) -> bool {
        let usual = self.color_in(look.light);
        usual.is_some_and(|usual| {
            let off = usual.distance(color);
            off < usual.distance(&look.color) && off / COLOR_SPREAD < FITS.sqrt()
        })
    }

    fn color_in(&self, light: usize) -> Option<&Color> {
        self.colors.get(light)?.as_ref()
    }

    /// Returns the misfit of a look: 0 for a usual look, 1 for one standard deviation of area or color.
    ///
    /// Misfits of area and color are squared and added. In a light without a known color, only the area
    /// counts.
    pub fn cost(&self, look: &Look) -> f64 {
        let usual = self.color_in(look.light);
        let color = usual.map_or(0.0, |usual| usual.distance(&look.color)) / COLOR_SPREAD;
        self.area_cost(look.area_px) + color * color
    }

    /// Returns the part of the cost that comes from the area: 0 between the 5th and 95th percentile.
    fn area_cost(&self, area_px: f64) -> f64 {
        let [low, _, high] = self.areas_px;
        let off = libm::log(area_px / area_px.clamp(low, high)) / AREA_SPREAD;
        off * off
    }

    /// Returns for each sample the index of the cheapest component that fits; `None` when none fits.
    pub fn choices(&self, samples: &[Vec<Look>]) -> Vec<Option<usize>> {
        samples.iter().map(|looks| self.choice(looks)).collect()
    }

    fn choice(&self, looks: &[Look]) -> Option<usize> {
        let real = (0..looks.len()).filter(|&k| looks[k].may_be_animal());
        let best = real
            .map(|k| (k, self.cost(&looks[k])))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        best.filter(|(_, cost)| *cost < FITS).map(|(k, _)| k)
    }

    /// Returns the subject measured from its own choices in the samples.
    fn refined(&self, samples: &[Vec<Look>]) -> Subject {
        let members = self.members(samples);
        if members.is_empty() {
            return self.clone();
        }
        let mut areas: Vec<f64> = members.iter().map(|look| look.area_px).collect();
        let n_lights = members.iter().map(|look| look.light + 1).max().unwrap_or(0);
        let color_in = |light| {
            let mut of_light = members.iter().filter(|look| look.light == light).peekable();
            of_light
                .peek()
                .is_some()
                .then(|| Color::mean(of_light.map(|look| &look.color)))
        };
        let at = [0.05, 0.5, 0.95].map(|share| order::percentile(&mut areas, share).unwrap_or(0.0));
        let median =
            |of: &dyn Fn(&Look) -> f64| order::median(members.iter().map(|l| of(l))).unwrap_or(0.0);
        Subject {
            colors: (0..n_lights).map(color_in).collect(),
            areas_px: at,
            diagonal_px: median(&|look| look.diagonal_px()),
            contrast: median(&|look| look.contrast),
        }
    }

    fn members<'a>(&self, samples: &'a [Vec<Look>]) -> Vec<&'a Look> {
        let chosen = samples.iter().zip(self.choices(samples));
        chosen.filter_map(|(looks, k)| Some(&looks[k?])).collect()
    }

    /// Returns the score of the subject as an explanation of the samples.
    ///
    /// It grows with the number of fitting samples, area, contrast and number of places.
    pub fn score(&self, samples: &[Vec<Look>]) -> f64 {
        let members = self.members(samples);
        if members.is_empty() {
            return 0.0;
        }
        let support: f64 = members
            .iter()
            .map(|look| libm::exp(-0.5 * self.cost(look)))
            .sum();
        let side = self.diagonal_px.max(4.0);
        let mut places: Vec<[i64; 2]> = members
            .iter()
            .map(|look| look.centroid_px.map(|c| (c / side).floor() as i64))
            .collect();
        places.sort_unstable();
        places.dedup();
        let roams = (places.len() as f64 / members.len().min(4) as f64).min(1.0);
        support * roams * self.area_px().sqrt() * self.contrast.max(1.0)
    }
}

/// Returns the subject with the highest score, from the largest components of each sample.
fn best_seed(samples: &[Vec<Look>]) -> Option<Subject> {
    let largest = |looks: &'_ Vec<Look>| {
        let mut real: Vec<usize> = (0..looks.len())
            .filter(|&k| looks[k].may_be_animal())
            .collect();
        real.sort_by(|&a, &b| looks[b].area_px.total_cmp(&looks[a].area_px));
        real.truncate(SEEDS_PER_SAMPLE);
        real
    };
    let seeds = samples
        .iter()
        .flat_map(|looks| largest(looks).into_iter().map(|k| &looks[k]));
    let scored = seeds
        .map(Subject::from_look)
        .map(|subject| (subject.score(samples), subject));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, subject)| subject)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORANGE: [u8; 3] = [230, 120, 30];
    const SKIN: [u8; 3] = [224, 172, 140];
    const GRAY: [u8; 3] = [110, 110, 110];

    fn look(rgb: [u8; 3], side: u32, x: u32, light: usize) -> Look {
        let box_px = Rect {
            x,
            y: 80,
            w: side,
            h: side,
        };
        Look {
            area_px: f64::from(side * side),
            color: Color::from_pixels(std::iter::once(rgb.as_slice())),
            contrast: 60.0,
            box_px,
            centroid_px: [f64::from(x), 80.0],
            on_border: false,
            is_shadow: false,
            is_ghost: false,
            light,
        }
    }

    #[test]
    fn subject_is_seen_in_most_samples_and_moves_about() {
        let samples: Vec<Vec<Look>> = (0..40)
            .map(|k| match k {
                0..8 => vec![look(SKIN, 90, 200, 0)],
                8..12 => vec![look(SKIN, 90, 200, 0), look(ORANGE, 30, 20 + 10 * k, 0)],
                // A plant that sways in place.
                _ => vec![look(ORANGE, 30, 20 + 10 * k, 0), look(GRAY, 40, 500, 0)],
            })
            .collect();
        let subject = Subject::learn(&samples, None).expect("something moves");
        let choices = subject.choices(&samples);
        let wanted = |k: usize| (k >= 8).then_some(usize::from(k < 12));
        assert_eq!(choices, (0..40).map(wanted).collect::<Vec<_>>());
    }

    #[test]
    fn subject_has_a_color_for_each_light() {
        let samples: Vec<Vec<Look>> = (0..40)
            .map(|k| match k {
                0..20 => vec![look(ORANGE, 30, 20 + 10 * k, 0)],
                _ => vec![look(GRAY, 30, 20 + 10 * k, 1)],
            })
            .collect();
        let subject = Subject::learn(&samples, None).expect("something moves");
        assert!(subject.choices(&samples).iter().all(Option::is_some));
        assert!(subject.cost(&look(GRAY, 30, 0, 0)) > FITS);
        assert!(subject.cost(&look(GRAY, 30, 0, 1)) < 1.0);
    }
}
