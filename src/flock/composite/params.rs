//! Parameters of a flock's film: size, background, drawing at jumps, and files to write.
//!
//! These parameters change only the drawing. The flock's motion and its plans stay the same
//! (docs/explanation/algorithms.md, "Compositing").

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Parameters of a flock's film. Every field has a default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Render {
    /// Width and height of the film in pixels: 16..=8192 each, and at most 8,294,400 pixels (3840 x 2160)
    /// in total. null = the size of the footage. The film always shows the whole picture of the footage. A
    /// film of another aspect ratio has bars.
    pub size_px: Option<[u32; 2]>,
    /// Background of the film: `plate` (the background of the footage), `transparent`, or a color as
    /// `#rrggbb`. Formats without transparency use `plate` in place of `transparent`.
    #[schema(value_type = String)]
    pub background: Background,
    /// Drawing method at a jump: `fade` or `morph`.
    pub cut: Cut,
    /// Share of an animal's color that haze replaces per body length of depth, 0..=1. 0 = no haze.
    pub haze_per_bl: f64,
    /// Darkness of the animals' shadows on the floor: the share of the light that a shadow removes, 0..=1.
    /// 0 = no shadows. null = the darkness measured in top view. With null, side view has no shadows, nor
    /// has a library without a measured shadow.
    pub shadow: Option<f64>,
    /// Files to write in addition to video.mp4.
    pub formats: Vec<Format>,
    /// Whether to write overlay.mp4, which marks the position and heading of every boid (Okabe et al.,
    /// figure 10).
    pub overlay: bool,
    /// Whether to write ground-truth.zip and tracks.csv.
    pub ground_truth: bool,
}

/// Maximum number of pixels in a frame, the same as for footage. Memory holds several copies of a frame.
const MOST_PIXELS: u64 = 3840 * 2160;

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

impl Default for Render {
    fn default() -> Render {
        Render {
            size_px: None,
            background: Background::Plate,
            cut: Cut::Fade,
            haze_per_bl: 0.0,
            shadow: None,
            formats: vec![Format::Poster],
            overlay: false,
            ground_truth: true,
        }
    }
}

impl Render {
    /// Checks the range of every field. The error names the field and its range.
    pub fn check(&self) -> Result<(), String> {
        for side in self.size_px.into_iter().flatten() {
            if !(16..=8192).contains(&side) {
                return Err(format!("render.size_px must lie in 16..=8192: {side}"));
            }
        }
        if let Some([width, height]) = self.size_px
            && u64::from(width) * u64::from(height) > MOST_PIXELS
        {
            return Err(format!(
                "render.size_px must have at most {MOST_PIXELS} pixels (3840 x 2160): {width} x {height}"
            ));
        }
        for (name, value) in [
            ("render.haze_per_bl", self.haze_per_bl),
            ("render.shadow", self.shadow.unwrap_or(0.0)),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(format!("{name} must lie in 0..=1: {value}"));
            }
        }
        Ok(())
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
    fn what_is_out_of_range_is_named() {
        let huge = Render {
            size_px: Some([9000, 100]),
            ..Render::default()
        };
        assert!(huge.check().unwrap_err().contains("render.size_px"));
        let vast = Render {
            size_px: Some([8192, 8192]),
            ..Render::default()
        };
        assert!(vast.check().unwrap_err().contains("8294400"));
        let long = Render {
            size_px: Some([8192, 1012]),
            ..Render::default()
        };
        assert_eq!(long.check(), Ok(()));
        let dark = Render {
            shadow: Some(f64::NAN),
            ..Render::default()
        };
        assert!(dark.check().unwrap_err().contains("render.shadow"));
        assert_eq!(Render::default().check(), Ok(()));
    }
}
