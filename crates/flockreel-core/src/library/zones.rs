//! Zones: named parts of the picture, and how the animal used each (docs/reference/formats.md, "Motion"). A zone belongs
//! to the camera's place, not to a film, so the same zones serve all films of an arena.

use std::str::FromStr;

use super::motion::{durations_s, path_px};
use super::{Pose, Poses};

/// Largest number of zones of a request. Free choice: it bounds the width of a table.
const MAX_ZONES: usize = 32;
/// Longest name of a zone, characters. Free choice.
const MAX_NAME: usize = 32;

/// A named part of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Zone {
    /// Name, of letters, digits and `_`.
    pub name: String,
    shape: Shape,
    /// Left, top, width and height, pixels.
    box_px: [f64; 4],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Rectangle,
    /// The ellipse that touches the sides of the box.
    Ellipse,
}

/// How the animal used a zone. It is in a zone while its centroid is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ZoneUse {
    /// Time in the zone, seconds.
    pub time_s: f64,
    /// Number of times that the animal was first seen in the zone, or came from outside.
    pub n_visits: usize,
    /// Time of the first visit, seconds from the start of the film; `None` without one.
    pub first_s: Option<f64>,
    /// Length of the path inside the zone, pixels.
    pub distance_px: f64,
}

/// Zones, separated by `;`. Names are unique.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Zones(Vec<Zone>);

/// A text that names no zones.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ZonesError {
    /// A zone is malformed.
    #[error(
        "a zone is NAME:rect:X,Y,W,H or NAME:ellipse:X,Y,W,H in pixels, as in center:ellipse:80,60,160,120: {0}"
    )]
    Malformed(String),
    /// Two zones have the same name.
    #[error("two zones have the same name: {0}")]
    Twice(String),
    /// There are too many zones.
    #[error("at most {MAX_ZONES} zones are counted at once: {0}")]
    TooMany(usize),
}

impl Zones {
    /// Returns the zones in the given order.
    pub fn iter(&self) -> impl Iterator<Item = &Zone> {
        self.0.iter()
    }
}

impl FromStr for Zones {
    type Err = ZonesError;

    /// Reads zones such as `center:ellipse:80,60,160,120;door:rect:0,0,20,20`.
    fn from_str(text: &str) -> Result<Zones, ZonesError> {
        let parts = text.split(';').filter(|part| !part.is_empty());
        let zones: Vec<Zone> = parts.map(Zone::from_str).collect::<Result<_, _>>()?;
        if zones.len() > MAX_ZONES {
            return Err(ZonesError::TooMany(zones.len()));
        }
        let is_known =
            |(k, zone): (usize, &Zone)| zones[..k].iter().any(|one| one.name == zone.name);
        if let Some((_, twice)) = zones.iter().enumerate().find(|one| is_known(*one)) {
            return Err(ZonesError::Twice(twice.name.clone()));
        }
        Ok(Zones(zones))
    }
}

impl FromStr for Zone {
    type Err = ZonesError;

    fn from_str(text: &str) -> Result<Zone, ZonesError> {
        Zone::read(text).ok_or_else(|| ZonesError::Malformed(text.to_owned()))
    }
}

impl Zone {
    fn read(text: &str) -> Option<Zone> {
        let mut parts = text.split(':');
        let (name, shape, corners) = (parts.next()?, parts.next()?, parts.next()?);
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if !(1..=MAX_NAME).contains(&name.len()) || !name.chars().all(is_name) {
            return None;
        }
        let numbers = corners.split(',').map(|number| number.trim().parse());
        let numbers: Vec<f64> = numbers.collect::<Result<_, _>>().ok()?;
        let box_px: [f64; 4] = numbers.try_into().ok()?;
        let is_box = box_px.iter().all(|v| v.is_finite()) && box_px[2] > 0.0 && box_px[3] > 0.0;
        let shape = match shape {
            "rect" => Shape::Rectangle,
            "ellipse" => Shape::Ellipse,
            _ => return None,
        };
        (is_box && parts.next().is_none()).then(|| Zone {
            name: name.to_owned(),
            shape,
            box_px,
        })
    }

    /// Returns whether a point lies in the zone.
    fn contains(&self, point_px: [f64; 2]) -> bool {
        let [x, y, w, h] = self.box_px;
        // From -1 at the left or upper side to 1 at the other.
        let [u, v] = [(point_px[0] - x) / w, (point_px[1] - y) / h].map(|share| 2.0 * share - 1.0);
        match self.shape {
            Shape::Rectangle => u.abs() <= 1.0 && v.abs() <= 1.0,
            Shape::Ellipse => u * u + v * v <= 1.0,
        }
    }

    /// Returns how the animal used the zone. The path counts as in `motion::summarize_motion`: `step_px` is its least step.
    pub fn used(&self, poses: &Poses, step_px: f64) -> ZoneUse {
        let place = |pose: &Pose| Some(self.contains(pose.centroid_px?));
        let mut used = ZoneUse::default();
        let mut was_in = false;
        for (pose, duration_s) in poses.frames.iter().zip(durations_s(poses)) {
            // A gap is no visit: an animal that was last seen inside has not left.
            let Some(is_in) = place(pose) else {
                continue;
            };
            if is_in {
                used.time_s += duration_s;
                used.first_s = used.first_s.or(Some(pose.time_s));
                used.n_visits += usize::from(!was_in);
            }
            was_in = is_in;
        }
        let inside = |pose: &Pose| pose.centroid_px.filter(|point| self.contains(*point));
        used.distance_px = path_px(poses.frames.iter().map(inside), step_px);
        used
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::View;

    /// An animal that walks from x = 0 in steps of 10 px, ten per second, and back from 100.
    fn walk() -> Poses {
        let x = |k: usize| 10.0 * if k <= 10 { k as f64 } else { 20.0 - k as f64 };
        let frame = |k: usize| Pose {
            time_s: k as f64 / 10.0,
            centroid_px: (k != 5).then(|| [x(k), 50.0]),
            ..Pose::default()
        };
        Poses {
            tail_beat: None,
            fps: 10.0,
            image_size_px: [200, 100],
            view: View::Top,
            view_confidence: None,
            other_movers: Vec::new(),
            camera: None,
            animal: None,
            frames: (0..21).map(frame).collect(),
        }
    }

    fn used(zone: &str) -> ZoneUse {
        zone.parse::<Zone>().unwrap().used(&walk(), 0.0)
    }

    #[test]
    fn time_visits_and_path_in_a_zone() {
        let far = used("far:rect:75,0,100,100");
        // At 80, 90, 100, 90 and 80 px.
        assert!((far.time_s - 0.5).abs() < 1e-9, "{far:?}");
        assert_eq!((far.n_visits, far.first_s), (1, Some(0.8)));
        assert!((far.distance_px - 40.0).abs() < 1e-9, "{far:?}");
        let middle = used("middle:rect:35,0,30,100");
        // At 40 and 60 px on the way out, with a gap between them, and at 60, 50 and 40 px on the way back.
        assert_eq!(middle.n_visits, 2, "{middle:?}");
        assert!((middle.time_s - 0.5).abs() < 1e-9, "{middle:?}");
        assert_eq!(used("away:rect:0,60,200,40"), ZoneUse::default());
    }

    #[test]
    fn corners_of_an_ellipse_are_outside() {
        let zone: Zone = "round:ellipse:0,0,100,50".parse().unwrap();
        assert!(zone.contains([50.0, 25.0]) && zone.contains([1.0, 25.0]));
        assert!(!zone.contains([8.0, 4.0]));
        let zone: Zone = "square:rect:0,0,100,50".parse().unwrap();
        assert!(zone.contains([8.0, 4.0]));
    }

    #[test]
    fn malformed_zones_are_refused_with_a_reason() {
        for bad in [
            "a",
            "a:rect",
            "a:rect:1,2,3",
            "a:rect:1,2,3,4,5",
            "a:rect:1,2,0,4",
            "a:rect:1,2,NaN,4",
            "a:circle:1,2,3,4",
            "a b:rect:1,2,3,4",
            ":rect:1,2,3,4",
            "a:rect:1,2,3,4:",
        ] {
            assert_eq!(
                bad.parse::<Zones>(),
                Err(ZonesError::Malformed(bad.to_owned()))
            );
        }
        let twice = "a:rect:0,0,1,1;a:rect:1,1,2,2".parse::<Zones>();
        assert_eq!(twice, Err(ZonesError::Twice("a".to_owned())));
        let many: Vec<String> = (0..33).map(|k| format!("z{k}:rect:0,0,1,1")).collect();
        assert_eq!(
            many.join(";").parse::<Zones>(),
            Err(ZonesError::TooMany(33))
        );
        assert_eq!("".parse::<Zones>(), Ok(Zones::default()));
    }
}
