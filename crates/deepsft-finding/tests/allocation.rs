//! What a search allocates once the buffers have grown.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]
// An allocator cannot be written without.
#![allow(unsafe_code)]

use deepsft_finding::{FeatureFinder, Features};
use deepsft_geometry::{Camera, ImageSize, Picture, Template};
use deepsft_synth::painting::artwork;
use deepsft_synth::random::{Stream, generator};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static ALLOCATED: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator, which counts the bytes that each thread asks for.
struct Counting;

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATED.set(ALLOCATED.get() + layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATED.set(ALLOCATED.get() + size);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn allocated(run: impl FnOnce()) -> usize {
    let before = ALLOCATED.get();
    run();
    ALLOCATED.get() - before
}

fn print(number: u64) -> Picture {
    artwork(0, &mut generator(number, 0, Stream::Scene)).1
}

/// `picture` in the upper left corner of a grey image.
fn image(picture: &Picture) -> Picture {
    let ImageSize { width, height } = picture.size();
    Picture::from_fn(960, 540, |x, y| {
        if x < width && y < height {
            picture.pixel(x, y)
        } else {
            [99; 3]
        }
    })
}

#[test]
fn a_search_allocates_the_same_every_time() {
    let camera = Camera::typical((960, 540)).unwrap();
    let features = [1, 2].map(|number| Features::of(&image(&print(number)), &camera).unwrap().0);
    let picture = print(1);
    let height_mm = 200.0 * picture.height() as f64 / picture.width() as f64;
    let mut finder = FeatureFinder::new(Template::thin_shell(picture, 200.0, height_mm).unwrap()).unwrap();
    let mut search = |features: &Features| {
        let mut found = false;
        let searched = allocated(|| found = finder.find(features, &camera).unwrap().is_some());
        (searched, found)
    };
    search(&features[0]);
    search(&features[1]);
    let again = search(&features[0]);
    // The solver of the mesh and the confirmed pairs: 22 MB here.
    assert!(again.0 < 32_000_000 && again.1, "{again:?}");
    search(&features[1]);
    assert_eq!(search(&features[0]), again);
}
