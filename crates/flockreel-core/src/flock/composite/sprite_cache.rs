//! Cache of premultiplied sprites, shared by all threads.
//!
//! Most sprites are shown several times by several individuals. The memory of the cache is bounded,
//! whatever the length of footage and film: the cache is emptied when the next sprite does not fit
//! (docs/explanation/algorithms.md, "Compositing").

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::library::Sprites;
use crate::raster::resample::Premultiplied;

/// Maximum size of the cached sprites, in bytes. Free choice.
const MAX_BYTES: usize = 96 << 20;

/// Premultiplied sprites by frame and by level of halved pictures.
#[derive(Default)]
pub(super) struct SpriteCache {
    entries: Mutex<Entries>,
}

#[derive(Default)]
struct Entries {
    sprites: HashMap<(u32, u32), Arc<Premultiplied>>,
    n_bytes: usize,
}

impl SpriteCache {
    /// Returns the sprite of a frame, prepared for drawing at `scale`. A frame without a sprite gives an
    /// empty one. `packed` is a buffer for reuse.
    pub(super) fn get(
        &self,
        sprites: &Sprites,
        frame: u32,
        scale: f64,
        packed: &mut Vec<u8>,
    ) -> Arc<Premultiplied> {
        let key = (frame, Premultiplied::mip_level(scale));
        let kept = self.with(|entries| entries.sprites.get(&key).cloned());
        kept.unwrap_or_else(|| {
            let sprite = match sprites.matte(frame as usize) {
                Some(matte) => {
                    sprites.read_matte(&matte, packed);
                    Premultiplied::new(packed, matte.size, matte.center_px, scale)
                }
                None => Premultiplied::new(&[], [0; 2], [0.0; 2], scale),
            };
            let sprite = Arc::new(sprite);
            self.with(|entries| entries.keep(key, &sprite));
            sprite
        })
    }

    fn with<T>(&self, work: impl FnOnce(&mut Entries) -> T) -> T {
        work(&mut self.entries.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Entries {
    fn keep(&mut self, key: (u32, u32), sprite: &Arc<Premultiplied>) {
        let n_bytes = sprite.n_bytes();
        if self.n_bytes + n_bytes > MAX_BYTES {
            self.sprites.clear();
            self.n_bytes = 0;
        }
        if self.sprites.insert(key, Arc::clone(sprite)).is_none() {
            self.n_bytes += n_bytes;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flock::synthetic;
    use crate::library::View;

    #[test]
    fn sprite_is_made_once_for_each_level_and_the_cache_is_bounded() {
        let library = synthetic::library(View::Side);
        let (sprite_cache, mut packed) = (SpriteCache::default(), Vec::new());
        let mut take = |frame, scale| sprite_cache.get(&library.sprites, frame, scale, &mut packed);
        let first = take(3, 1.0);
        assert!(Arc::ptr_eq(&first, &take(3, 0.9)));
        assert!(!Arc::ptr_eq(&first, &take(3, 0.5)));
        sprite_cache.with(|entries| entries.n_bytes = MAX_BYTES);
        take(4, 1.0);
        sprite_cache
            .with(|entries| assert!(entries.n_bytes < MAX_BYTES && entries.sprites.len() == 1));
    }
}
