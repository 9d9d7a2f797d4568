//! Parameters of a flock's film, with defaults and limits: size, background, drawing at jumps, and files.
//!
//! These parameters change only the drawing. The flock's motion and its plans stay the same
//! (docs/explanation/algorithms.md, "Compositing").

use serde::{Deserialize, Serialize};
use smart_default::SmartDefault;
use utoipa::ToSchema;

/// Parameters of a flock's film. Every field has a default.
#[derive(Clone, Debug, PartialEq, SmartDefault, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Render {
    /// Width and height of the film in pixels, at most 8,294,400 pixels (3840 x 2160) in total. null = the
    /// size of the footage. The film always shows the whole picture of the footage. A film of another aspect
    /// ratio has bars.
    #[schema(value_type = Option<[SidePx; 2]>, inline, min_items = 2, max_items = 2)]
    pub size_px: Option<[u32; 2]>,
    /// Background of the film: `plate` (the background of the footage), `transparent`, or a color as
    /// `#rrggbb`. Formats without transparency use `plate` in place of `transparent`.
    #[default(Background::Plate)]
    #[schema(value_type = String, pattern = "^(plate|transparent|#[0-9a-fA-F]{6})$")]
    pub background: Background,
    /// Drawing at a jump: `fade` (cross-fade), or `morph`, a fade in which both shapes also change into each
    /// other.
    #[default(Cut::Fade)]
    pub cut: Cut,
    /// Share of an animal's color that haze replaces per body length of depth. 0 = no haze.
    #[schema(minimum = 0, maximum = 1)]
    pub haze_per_bl: f64,
    /// Darkness of the animals' shadows on the floor: the share of the light that a shadow removes.
    /// 0 = no shadows. null = the darkness measured in top view, and no shadows in side view or without a
    /// measurement.
    #[schema(minimum = 0, maximum = 1)]
    pub shadow: Option<f64>,
    /// Files to write in addition to video.mp4.
    #[default(_code = "vec![Format::Poster]")]
    pub formats: Vec<Format>,
    /// Whether to write overlay.mp4, which marks the position and heading of every boid (Okabe et al.,
    /// figure 10).
    pub overlay: bool,
    /// Whether to write ground-truth.zip and tracks.csv.
    #[default = true]
    pub ground_truth: bool,
}

/// Maximum number of pixels in a frame, the same as for footage. Memory holds several copies of a frame.
const MAX_PIXELS: u64 = 3840 * 2160;

/// Background of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Background {
    /// Background of the footage.
    Plate,
    /// No background: the film has straight alpha.
    Transparent,
    /// One color.
    Color([u8; 3]),
}

/// Drawing method at a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Cut {
    /// Cross-fade: one sprite fades out while the other fades in.
    Fade,
    /// Morph: a cross-fade in which both sprites are warped toward each other. Parts that cannot be matched
    /// only fade.
    Morph,
}

/// File format of a flock's film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// H.264 in MP4, without transparency.
    Mp4,
    /// VP9 in WebM.
    Webm,
    /// ProRes 4444 in QuickTime, for editors.
    Mov,
    /// One PNG picture per frame.
    Png,
    /// Small animated GIF of the first seconds, without transparency.
    Gif,
    /// Small animated WebP of the first seconds.
    Webp,
    /// Poster: the middle frame as one picture.
    Poster,
}

/// Schema of the width or height of a film, pixels.
#[derive(ToSchema)]
#[schema(minimum = 16, maximum = 8192)]
#[expect(dead_code, reason = "it only describes numbers in the schema")]
struct SidePx(u32);

impl Render {
    /// Checks the number of pixels.
    pub(in crate::flock) fn check_combinations(&self) -> Result<(), String> {
        match self.size_px {
            Some([width, height]) if u64::from(width) * u64::from(height) > MAX_PIXELS => {
                Err(format!(
                    "render.size_px must have at most {MAX_PIXELS} pixels (3840 x 2160): {width} x {height}"
                ))
            }
            _ => Ok(()),
        }
    }
}

impl Format {
    /// Returns whether the format can store transparency.
    pub fn has_alpha(self) -> bool {
        !matches!(self, Format::Mp4 | Format::Gif)
    }
}

impl TryFrom<String> for Background {
    type Error = String;

    fn try_from(text: String) -> Result<Background, String> {
        match text.as_str() {
            "plate" => Ok(Background::Plate),
            "transparent" => Ok(Background::Transparent),
            color => color_of(color)
                .map(Background::Color)
                .ok_or_else(|| format!("background must be plate, transparent or #rrggbb: {text}")),
        }
    }
}

fn color_of(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#')?;
    if digits.len() != 6 || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return None;
    }
    let value = u32::from_str_radix(digits, 16).ok()?;
    Some([16, 8, 0].map(|shift| (value >> shift) as u8))
}

impl From<Background> for String {
    fn from(background: Background) -> String {
        match background {
            Background::Plate => "plate".into(),
            Background::Transparent => "transparent".into(),
            Background::Color([r, g, b]) => format!("#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backgrounds_are_written_as_they_are_read() {
        for text in ["plate", "transparent", "#0a7fff"] {
            let background = Background::try_from(text.to_owned()).expect("a good one");
            assert_eq!(String::from(background), text);
        }
        for bad in ["", "red", "#12345", "#1234567", "#+12345", "#äbc"] {
            assert!(Background::try_from(bad.to_owned()).is_err(), "{bad}");
        }
    }

    #[test]
    fn number_of_pixels_is_limited() {
        let check = |size_px| {
            let size_px = Some(size_px);
            let render = Render {
                size_px,
                ..Render::default()
            };
            render.check_combinations()
        };
        assert!(check([8192, 8192]).unwrap_err().contains("8294400"));
        assert_eq!(check([8192, 1012]), Ok(()));
    }
}
