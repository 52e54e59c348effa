//! The bytes that are held, and the most that were: an allocator that counts.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bytes that are held.
static HELD: AtomicUsize = AtomicUsize::new(0);

/// The most bytes that were held since [`reset`].
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// Most bytes that may be held: more is refused, so that a promise of a file cannot take the machine down.
const MOST: usize = 6 << 30;

struct Meter;

#[global_allocator]
static METER: Meter = Meter;

fn grow(bytes: usize) -> bool {
    let held = HELD.fetch_add(bytes, Relaxed) + bytes;
    if held > MOST {
        HELD.fetch_sub(bytes, Relaxed);
        return false;
    }
    PEAK.fetch_max(held, Relaxed);
    true
}

// SAFETY: every call is one of the system's allocator with the same arguments, or refuses.
unsafe impl GlobalAlloc for Meter {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        match grow(layout.size()) {
            true => unsafe { System.alloc(layout) },
            false => std::ptr::null_mut(),
        }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        match grow(layout.size()) {
            true => unsafe { System.alloc_zeroed(layout) },
            false => std::ptr::null_mut(),
        }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(ptr, layout) }
    }

    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if !grow(size.saturating_sub(layout.size())) {
            return std::ptr::null_mut();
        }
        HELD.fetch_sub(layout.size().saturating_sub(size), Relaxed);
        unsafe { System.realloc(ptr, layout, size) }
    }
}

/// Begins to look for the most bytes; those that are held now.
pub fn reset() -> usize {
    let held = HELD.load(Relaxed);
    PEAK.store(held, Relaxed);
    held
}

/// The most bytes that were held since.
pub fn peak() -> usize {
    PEAK.load(Relaxed)
}
