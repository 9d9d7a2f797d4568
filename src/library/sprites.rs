//! Sprites: the animal cut out of each frame, all of one size, centred on its centroid (O's clip U).

/// Straight-alpha RGBA pictures of one common size, one for every frame of the footage.
///
/// The centroid lies at (width / 2, height / 2). A frame without the animal holds a wholly
/// transparent sprite and is not `present`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sprites {
    width: u32,
    height: u32,
    present: Vec<bool>,
    pixels: Vec<u8>,
}

impl Sprites {
    /// `n_frames` missing sprites of `width` by `height`.
    pub fn missing(width: u32, height: u32, n_frames: usize) -> Sprites {
        let n_bytes = width as usize * height as usize * 4;
        Sprites {
            width,
            height,
            present: vec![false; n_frames],
            pixels: vec![0; n_bytes * n_frames],
        }
    }

    /// Columns of each sprite.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of each sprite.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Bytes of one sprite: width * height * 4.
    pub fn n_bytes(&self) -> usize {
        self.width as usize * self.height as usize * 4
    }

    /// One for every frame of the footage, missing ones included.
    pub fn n_frames(&self) -> usize {
        self.present.len()
    }

    /// Whether frame `frame_idx` has a sprite.
    pub fn is_present(&self, frame_idx: usize) -> bool {
        self.present[frame_idx]
    }

    /// The RGBA bytes of a frame, all zero when it is missing. Panics beyond the last frame.
    pub fn sprite(&self, frame_idx: usize) -> &[u8] {
        let n = self.n_bytes();
        &self.pixels[frame_idx * n..][..n]
    }

    /// Fills in the sprite of a frame and marks it present. Panics beyond the last frame.
    pub fn fill(&mut self, frame_idx: usize) -> &mut [u8] {
        let n = self.n_bytes();
        self.present[frame_idx] = true;
        &mut self.pixels[frame_idx * n..][..n]
    }

    /// Every sprite's memory at once, one slice a frame, so that threads may fill them; `present`
    /// says which frames will hold one. Panics when the lengths differ.
    pub fn fill_all(&mut self, present: Vec<bool>) -> std::slice::ChunksExactMut<'_, u8> {
        assert_eq!(present.len(), self.present.len(), "one flag a frame");
        self.present = present;
        let n = self.n_bytes();
        self.pixels.chunks_exact_mut(n)
    }
}
