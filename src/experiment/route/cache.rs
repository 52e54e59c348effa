//! Schedules and itineraries that are kept for later requests.

use super::super::counts::Spent;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

/// Poses that schedules which are kept may have together, and tours (100 bytes each); further ones are made again.
const CACHED_POSES: usize = 4_000_000;

/// A schedule or an itinerary that is kept.
pub(super) struct CacheEntry<T> {
    pub made: Arc<T>,
    /// Wall time of its making.
    pub spent: Spent,
    /// Its number of poses.
    pub poses: usize,
    /// True if a later material asks for it.
    pub again: bool,
}

/// Schedules or itineraries of at most [`CACHED_POSES`] poses together.
pub(super) struct Cache<K, T>(pub HashMap<K, CacheEntry<T>>);

impl<K, T> Default for Cache<K, T> {
    fn default() -> Self {
        Self(HashMap::new())
    }
}

impl<K: Eq + Hash, T> Cache<K, T> {
    /// The value kept for a key, and the wall time of its making.
    pub(crate) fn get(&mut self, key: &K, again: bool) -> Option<(Arc<T>, Spent)> {
        let kept = self.0.get_mut(key)?;
        kept.again |= again;
        Some((Arc::clone(&kept.made), kept.spent))
    }

    /// Returns a new value of so many poses, and keeps it if there is room; `again`: a later material asks for it.
    pub(crate) fn keep(
        &mut self,
        key: K,
        (made, spent): (T, Spent),
        poses: usize,
        again: bool,
    ) -> (Arc<T>, Spent) {
        let new = CacheEntry {
            made: Arc::new(made),
            spent,
            poses,
            again,
        };
        let made = (Arc::clone(&new.made), spent);
        let held: usize = self.0.values().map(|kept| kept.poses).sum();
        if held + poses <= CACHED_POSES {
            self.0.insert(key, new);
        }
        made
    }

    /// Drops all that no later material asks for.
    pub(crate) fn drop_unasked(&mut self) {
        self.0.retain(|_, kept| kept.again);
    }
}
