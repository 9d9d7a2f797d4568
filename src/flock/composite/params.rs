//! What a person may set about the film of a flock (ALGORITHMS.md 8): its size, what lies behind, how
//! jumps are bridged, and which files are made. Nothing here changes what the flock does.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Parameters of a flock's film; all have defaults.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Render {
    /// Width and height of the film, pixels, 16..=8192 each, at most 8,294,400 (3840 x 2160) together; null = the footage's. The field of view stays
    /// that of the footage; a film of another shape has bars.
    pub size_px: Option<[u32; 2]>,
    /// What lies behind: `plate`, `transparent`, or a color as `#rrggbb`. Where a format has no
    /// transparency, the plate takes its place.
    #[schema(value_type = String)]
    pub background: Background,
    /// How jumps are bridged.
    pub cut: Cut,
    /// How much of what is a body length farther is lost in haze, 0..=1; 0 = clear.
    pub haze_per_bl: f64,
    /// How dark the shadow of everyone on the floor is, 0..=1; 0 = none, null = as it was filmed from above, and none from
    /// the side.
    pub shadow: Option<f64>,
    /// Files to make besides video.mp4.
    pub formats: Vec<Format>,
    /// Whether to make overlay.mp4: where everyone's boid is and where it heads (O's figure 10).
    pub overlay: bool,
    /// Whether to make ground-truth.zip and tracks.csv.
    pub ground_truth: bool,
}

/// The largest picture, as of footage: a frame is held in memory several times over.
const MOST_PIXELS: u64 = 3840 * 2160;

/// What lies behind a flock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Background {
    /// The scene without the animal.
    Plate,
    /// Nothing: the film has straight alpha.
    Transparent,
    /// One color.
    Color([u8; 3]),
}

/// How a jump is bridged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Cut {
    /// One sprite fades out while the other fades in.
    Fade,
    /// Both are bent to each other while they fade, where that can be done.
    Morph,
}

/// A kind of file that shows a flock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Format {
    /// H.264 in MP4, without transparency.
    Mp4,
    /// VP9 in WebM.
    Webm,
    /// ProRes 4444 in QuickTime, for editors.
    Mov,
    /// A PNG picture for every frame.
    Png,
    /// A small animated GIF of the first seconds, without transparency.
    Gif,
    /// A small animated WebP of the first seconds.
    Webp,
    /// The frame in the middle, as one picture.
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
    /// Checks every range; the sentence says which parameter is out of which range.
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
                "render.size_px must have at most {MOST_PIXELS} pixels in all, as 3840 x 2160 has: {width} x {height}"
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
    /// Whether it can show what is behind the film.
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
