//! transitions.svg: the playback graph as an arc diagram (Okabe et al., figure 7.2). Each jump is an arc over
//! the frames of the footage, above the axis if the mirror side stays and below if it changes. Cheaper jumps
//! have stronger lines. The axis shows the patches, the runs between jump ends.

use std::fmt::Write;

use super::axis::Axis;
use super::{LEFT, RIGHT, Sheet, fill, stroke};
use crate::library::{Jump, Library};

/// Top of the highest arc.
const TOP: f64 = 64.0;
/// Height of an arc over the whole footage.
const MAX_RISE: f64 = 250.0;
/// Height of the axis with its patches.
const BAND: f64 = 20.0;
/// Maximum number of drawn arcs, the cheapest; more would not be distinguishable. Free choice.
const MAX_ARCS: usize = 4000;

/// Number of arcs for which the line widths below hold. Lines are thinner for more arcs and stronger for
/// fewer.
const REFERENCE_ARCS: f64 = 500.0;

/// Line style of jumps that cost at most `max_share` times epsilon.
struct CostClass {
    max_share: f64,
    role: &'static str,
    width: f64,
    opacity: f64,
    name: &'static str,
}

/// The costliest first, so that cheaper ones are drawn over them.
const CLASSES: [CostClass; 4] = [
    CostClass {
        max_share: f64::INFINITY,
        role: "soft",
        width: 0.6,
        opacity: 0.45,
        name: "above 0.8",
    },
    CostClass {
        max_share: 0.8,
        role: "water",
        width: 0.8,
        opacity: 0.65,
        name: "0.6 to 0.8",
    },
    CostClass {
        max_share: 0.6,
        role: "water",
        width: 1.5,
        opacity: 0.9,
        name: "0.4 to 0.6",
    },
    CostClass {
        max_share: 0.4,
        role: "accent",
        width: 1.9,
        opacity: 1.0,
        name: "0.4 or less",
    },
];

impl CostClass {
    fn pen(&self, n_arcs: usize) -> String {
        let strength = (REFERENCE_ARCS / n_arcs.max(1) as f64)
            .sqrt()
            .clamp(0.3, 1.6);
        format!(
            "stroke-width=\"{:.2}\" stroke-opacity=\"{:.2}\"",
            self.width * strength,
            (self.opacity * strength.max(0.8)).min(1.0)
        )
    }
}

/// Returns the jumps of a library as an SVG picture, 960 wide.
pub fn transitions(library: &Library) -> String {
    let playback = &library.playback;
    let n_mirrored = playback.jumps.iter().filter(|jump| jump.mirrored).count();
    let axis = Axis::of_frames(library.poses.frames.len(), [LEFT, RIGHT]);
    let jumps = cheapest(&playback.jumps);
    // Space for the highest arc on either side, and for the label beside it.
    let highest = |mirrored: bool| {
        let of_side = jumps.iter().filter(|jump| jump.mirrored == mirrored);
        let rises = of_side.map(|jump| rise(jump, &axis) + 6.0);
        rises.reduce(f64::max).map(|highest| highest.max(28.0))
    };
    let above = TOP + highest(false).unwrap_or(28.0);
    let band = [above, above + BAND];
    let bottom = band[1] + highest(true).unwrap_or(0.0) + 6.0;
    let description = summary(library, n_mirrored, jumps.len());
    let mut sheet = Sheet::new(bottom + 66.0, "Jumps of the library", &description);
    sheet.text("ink", "start", [16.0, 26.0], "Jumps of the library");
    sheet.text("soft", "start", [16.0, 46.0], &description);
    axis.draw(&mut sheet, TOP, bottom);
    sheet.text("soft", "end", [LEFT - 8.0, band[0] - 12.0], "same side");
    if n_mirrored > 0 {
        sheet.text("soft", "end", [LEFT - 8.0, band[1] + 20.0], "mirrored");
    }
    arcs(&mut sheet, library, &jumps, &axis, band);
    patches(&mut sheet, library, &axis, band);
    key(&mut sheet, jumps.len(), bottom + 48.0);
    sheet.finish()
}

fn summary(library: &Library, n_mirrored: usize, n_drawn: usize) -> String {
    let n_jumps = library.playback.jumps.len();
    let share = 100.0 * library.stats.component_share;
    let drawn = if n_drawn < n_jumps {
        format!("; the cheapest {n_drawn} are drawn")
    } else {
        String::new()
    };
    format!(
        "{} transitions allow {n_jumps} jumps, {n_mirrored} of them mirrored{drawn}; endless playback uses {share:.0} \
         % of {} frames.",
        library.transitions.len(),
        library.poses.frames.len()
    )
}

/// Returns the cheapest `MAX_ARCS` jumps, the costliest first, so that cheaper ones are drawn over them.
fn cheapest(jumps: &[Jump]) -> Vec<Jump> {
    let mut jumps = jumps.to_vec();
    jumps.sort_by_key(|jump| (jump.cost, jump.from, jump.to, jump.mirrored));
    jumps.truncate(MAX_ARCS);
    jumps.reverse();
    jumps
}

/// Returns the height of an arc. The exponent below 1 keeps short arcs visible.
fn rise(jump: &Jump, axis: &Axis) -> f64 {
    MAX_RISE * libm::pow(f64::from(jump.from.abs_diff(jump.to)) / axis.end, 0.75)
}

/// Draws the arcs. Arcs of one class form one path, so that they do not darken each other.
fn arcs(sheet: &mut Sheet, library: &Library, jumps: &[Jump], axis: &Axis, band: [f64; 2]) {
    let mut paths: [String; CLASSES.len()] = Default::default();
    for jump in jumps {
        let share = jump.cost as f64 / library.epsilon.max(1) as f64;
        let fits = |class: &CostClass| share <= class.max_share;
        let class = CLASSES.iter().rposition(fits).unwrap_or(0);
        let (first, last) = (jump.from.min(jump.to), jump.from.max(jump.to));
        let [x0, x1] = [first, last].map(|frame| axis.x(f64::from(frame) + 0.5));
        let rx = (x1 - x0) / 2.0;
        let ry = rise(jump, axis);
        let (y, sweep) = if jump.mirrored {
            (band[1], 0)
        } else {
            (band[0], 1)
        };
        let arc = format_args!("M{x0:.1} {y}A{rx:.1} {ry:.1} 0 0 {sweep} {x1:.1} {y}");
        paths[class].write_fmt(arc).expect("memory");
    }
    for (class, path) in CLASSES.iter().zip(paths) {
        sheet.stroke(class.role, &path, &class.pen(jumps.len()));
    }
}

/// Draws the patches in two alternating shades; other frames stay empty.
fn patches(sheet: &mut Sheet, library: &Library, axis: &Axis, band: [f64; 2]) {
    sheet.rect("sunken", [LEFT, band[0], RIGHT - LEFT, BAND]);
    let mut shades = [String::new(), String::new()];
    for (patch_idx, patch) in library.patches.iter().enumerate() {
        let [x0, x1] = [patch.frames.start, patch.frames.end].map(|f| axis.x(f64::from(f)));
        let block = format_args!("M{x0:.2} {}V{}H{x1:.2}V{}Z", band[0], band[1], band[0]);
        shades[patch_idx % 2].write_fmt(block).expect("memory");
    }
    for (path, opacity) in shades.iter().zip(["1", "0.6"]) {
        if !path.is_empty() {
            sheet.write(format_args!(
                "<path {} fill-opacity=\"{opacity}\" d=\"{path}\"/>\n",
                fill("water")
            ));
        }
    }
}

fn key(sheet: &mut Sheet, n_arcs: usize, y: f64) {
    sheet.text(
        "soft",
        "start",
        [16.0, y],
        "cost of a jump, share of epsilon",
    );
    let mut x = 232.0;
    for class in CLASSES.iter().rev() {
        sheet.write(format_args!(
            "<path {} {} fill=\"none\" d=\"M{x} {}h26\"/>\n",
            stroke(class.role),
            class.pen(n_arcs),
            y - 4.5
        ));
        sheet.text("soft", "start", [x + 33.0, y], class.name);
        x += 122.0;
    }
    let blocks = format!("M{x} {0}h13v11h-13z", y - 10.0);
    sheet.write(format_args!("<path {} d=\"{blocks}\"/>\n", fill("water")));
    let blocks = format!("M{} {}h13v11h-13z", x + 13.0, y - 10.0);
    sheet.write(format_args!(
        "<path {} fill-opacity=\"0.6\" d=\"{blocks}\"/>\n",
        fill("water")
    ));
    sheet.text("soft", "start", [x + 33.0, y], "runs between jumps");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::synthetic;
    use crate::library::View;

    fn library(jumps: Vec<Jump>) -> Library {
        let mut library = synthetic::library(View::Side);
        library.playback.jumps = jumps;
        library
    }

    fn jump(from: u32, to: u32, cost: u64, mirrored: bool) -> Jump {
        Jump {
            from,
            to,
            cost,
            mirrored,
        }
    }

    #[test]
    fn plain_arcs_are_above_and_mirrored_ones_below() {
        // 600 frames, and an epsilon of 1000.
        let jumps = vec![jump(0, 300, 300, false), jump(599, 300, 900, true)];
        let svg = transitions(&library(jumps));
        let arc_of = |role: &str| {
            let class = format!("class=\"{role}-stroke\"");
            let path = svg.lines().find(|l| l.contains(&class) && l.contains('A'));
            path.expect("an arc").to_owned()
        };
        assert!(arc_of("accent").contains(" 0 0 1 "), "above, left to right");
        assert!(arc_of("soft").contains(" 0 0 0 "), "below");
        assert!(svg.contains("allow 2 jumps, 1 of them mirrored"));
    }

    #[test]
    fn above_the_limit_only_the_cheapest_jumps_are_drawn() {
        let jumps = (0..5000).map(|k| jump(k % 300, 300 + k % 299, u64::from(k), false));
        let svg = transitions(&library(jumps.collect()));
        assert!(svg.contains("the cheapest 4000 are drawn"));
        let arcs: usize = svg.lines().map(|line| line.matches('A').count()).sum();
        assert!((4000..4010).contains(&arcs), "{arcs}");
        assert!(!svg.contains(">mirrored<"), "no room is left for none");
    }
}
