//! Charts as SVG: headings.svg, trajectory.svg, confidence.svg and transitions.svg of a library, plan.svg of
//! a flock.
//!
//! Each chart has a title and a description for screen readers. Its attributes hold the colors for a light
//! page, and its style sheet those for a dark one.

mod axis;
mod confidence;
mod curve;
mod headings;
mod plan;
mod trajectory;
mod transitions;

use std::fmt::Write;

pub use confidence::confidence;
pub use headings::headings;
pub use plan::plan;
pub use trajectory::trajectory;
pub use transitions::transitions;

use crate::library::Library;

/// Returns all charts of a library with their file names.
pub fn pictures(library: &Library) -> [(&'static str, String); 4] {
    let poses = &library.poses;
    [
        ("headings.svg", headings(poses)),
        ("trajectory.svg", trajectory(poses)),
        ("confidence.svg", confidence(poses)),
        ("transitions.svg", transitions(library)),
    ]
}

/// Width of every chart.
const WIDTH: f64 = 960.0;
/// Left and right end of the plot area.
const LEFT: f64 = 78.0;
const RIGHT: f64 = WIDTH - 16.0;

/// Colors by role: on a light page, on a dark page.
const COLORS: &[(&str, &str, &str)] = &[
    ("paper", "#fdfcf9", "#142127"),
    ("sunken", "#efece3", "#0d171b"),
    ("ink", "#18272d", "#e6ecea"),
    ("soft", "#4c5c61", "#a3b3b5"),
    ("line", "#d5d1c4", "#2f4149"),
    ("accent", "#b8410f", "#ff9d66"),
    ("water", "#1c6b78", "#6cc3cf"),
];

/// A chart under construction.
struct Sheet {
    svg: String,
}

impl Sheet {
    /// Returns an empty chart of `WIDTH` by `height`.
    fn new(height: f64, title: &str, description: &str) -> Sheet {
        let mut sheet = Sheet {
            svg: String::with_capacity(1 << 16),
        };
        sheet.write(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" \
             height=\"{height}\" role=\"img\" aria-labelledby=\"title desc\" \
             font-family=\"system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif\" font-size=\"13\">\n\
             <title id=\"title\">{title}</title>\n<desc id=\"desc\">{description}</desc>\n<style>"
        ));
        for (scheme, open, close) in [
            (0, "", ""),
            (1, "@media (prefers-color-scheme: dark) { ", " }"),
        ] {
            sheet.write(format_args!("{open}"));
            for (role, light, dark) in COLORS {
                let color = [light, dark][scheme];
                sheet.write(format_args!(
                    ".{role} {{ fill: {color} }} .{role}-stroke {{ stroke: {color} }} "
                ));
            }
            sheet.write(format_args!("{close}"));
        }
        sheet.write(format_args!("</style>\n"));
        sheet.rect("paper", [0.0, 0.0, WIDTH, height]);
        sheet
    }

    fn write(&mut self, text: std::fmt::Arguments) {
        self.svg.write_fmt(text).expect("memory");
    }

    fn rect(&mut self, role: &str, [x, y, w, h]: [f64; 4]) {
        self.write(format_args!(
            "<rect {} x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\"/>\n",
            fill(role)
        ));
    }

    fn text(&mut self, role: &str, anchor: &str, [x, y]: [f64; 2], text: &str) {
        self.write(format_args!(
            "<text {} text-anchor=\"{anchor}\" x=\"{x:.1}\" y=\"{y:.1}\">{text}</text>\n",
            fill(role)
        ));
    }

    /// Draws a line of path data; `more` holds further attributes.
    fn stroke(&mut self, role: &str, path: &str, more: &str) {
        if !path.is_empty() {
            self.write(format_args!(
                "<path {} fill=\"none\" {more} d=\"{path}\"/>\n",
                stroke(role)
            ));
        }
    }

    fn finish(mut self) -> String {
        self.write(format_args!("</svg>\n"));
        self.svg
    }
}

fn light(role: &str) -> &'static str {
    let found = COLORS.iter().find(|(name, ..)| *name == role);
    found.map_or("#18272d", |(_, light, _)| light)
}

fn fill(role: &str) -> String {
    format!("class=\"{role}\" fill=\"{}\"", light(role))
}

fn stroke(role: &str) -> String {
    format!("class=\"{role}-stroke\" stroke=\"{}\"", light(role))
}

/// Returns the attributes for a fill in one role's color and an outline in another's.
fn rimmed(inside: &str, rim: &str) -> String {
    let (fill, stroke) = (light(inside), light(rim));
    format!("class=\"{inside} {rim}-stroke\" fill=\"{fill}\" stroke=\"{stroke}\"")
}

/// Returns the runs of frames for which `holds` is true: the first frame and the frame after the last.
fn runs(n_frames: usize, holds: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for k in (0..n_frames).filter(|&k| holds(k)) {
        match runs.last_mut().filter(|run| run[1] == k) {
            Some(run) => run[1] = k + 1,
            None => runs.push([k, k + 1]),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_have_their_first_frame_and_the_one_after_the_last() {
        assert_eq!(runs(6, |k| [0, 1, 4].contains(&k)), [[0, 2], [4, 5]]);
    }

    #[test]
    fn no_attribute_is_repeated() {
        let mut library = crate::flock::synthetic::library(crate::library::View::Side);
        let flock = crate::flock::Params {
            count: Some(3),
            frames: 40,
            ..Default::default()
        };
        let flock = crate::flock::plan_flock(&library, &flock, &crate::progress::Silent);
        let plan = ("plan.svg", plan(&flock.expect("a good library")));
        let poses = &mut library.poses;
        poses.frames[20..30].fill(crate::library::Pose::default());
        poses.tail_beat = Some(crate::library::TailBeat {
            method: crate::library::TailBeatMethod::Bend,
            spans: vec![crate::library::BeatSpan {
                frames: [30, 80],
                start_s: 1.0,
                end_s: 2.7,
                frequency_hz: 2.0,
                amplitude: 0.1,
                confidence: 0.9,
            }],
        });
        for (name, svg) in pictures(&library).into_iter().chain([plan]) {
            for tag in svg.split('<').filter_map(|rest| rest.split_once('>')) {
                let mut names: Vec<&str> = tag
                    .0
                    .split("=\"")
                    .filter_map(|p| p.rsplit([' ', '\n']).next())
                    .collect();
                names.pop();
                names.sort_unstable();
                let n_names = names.len();
                names.dedup();
                assert_eq!(names.len(), n_names, "{name}: <{}>", tag.0);
            }
        }
    }

    #[test]
    fn chart_has_a_title_and_dark_colors() {
        let svg = Sheet::new(100.0, "A title", "What it shows").finish();
        assert!(svg.contains("<title id=\"title\">A title</title>"));
        assert!(svg.contains("<desc id=\"desc\">What it shows</desc>"));
        assert!(svg.contains("prefers-color-scheme: dark"));
        assert!(svg.ends_with("</svg>\n"));
    }
}
