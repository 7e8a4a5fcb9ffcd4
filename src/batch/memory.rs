//! Memory that trees take together.

use std::path::Path;
use std::sync::{Condvar, Mutex};

use crate::pipeline::Request;

/// What any bake takes at most where the first level's texels are for a tree 512 pixels high: masks,
/// reference pictures and pages, bytes.
const EVERY_BAKE: f64 = (192 << 20) as f64;

/// The height that [`EVERY_BAKE`] is for, pixels.
const USUAL_PX: f64 = 512.0;

/// What a byte of the input becomes at most: compressed images and quantised corners are several
/// times as large in memory.
const PER_BYTE: f64 = 24.0;

/// The memory that a bake is expected to take, bytes. Of seven trees of 0.4 to 30 MB that were
/// measured, two took nine and eight tenths of it, the others less.
pub fn expected_bytes(request: &Request) -> u64 {
    let (input, scene) = (&request.input, &request.scene);
    let size = std::fs::metadata(input).map_or(0, |m| m.len());
    let is_gltf = input
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("gltf"));
    // A .gltf is small beside the files that it refers to; those lie in its folder.
    let beside = if is_gltf { folder_bytes(input) } else { 0 };
    let height_px = scene
        .heights_px
        .iter()
        .fold(scene.first_height_px, |a, &b| a.max(b));
    // Pages and pictures grow as the square of what they show.
    let finer = f64::from(request.recipe.texel_density).max(1.0) * (height_px / USUAL_PX).max(1.0);
    (EVERY_BAKE * finer * finer + PER_BYTE * (size + beside) as f64) as u64
}

fn folder_bytes(input: &Path) -> u64 {
    let folder = input.parent().filter(|p| !p.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new(".")));
    let same_stem = |file: &Path| {
        file.extension().is_some_and(|e| e == "bin") && file.file_stem() == input.file_stem()
    };
    entries
        .into_iter()
        .flatten()
        .flatten()
        .filter(|e| same_stem(&e.path()))
        .filter_map(|e| e.metadata().ok())
        .map(|m| m.len())
        .sum()
}

/// Memory of the machine, bytes; `None` where the system does not tell. A container's limit
/// counts where it is lower.
pub fn bytes_of_machine() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    let limit = std::fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let limit = limit.and_then(|l| l.trim().parse::<u64>().ok());
    Some((kib * 1024).min(limit.unwrap_or(u64::MAX)))
}

/// Lets trees in while there is room.
#[derive(Debug)]
pub struct Gate {
    all: u64,
    free: Mutex<u64>,
    left: Condvar,
}

/// Room that is given back when this is dropped.
#[derive(Debug)]
pub struct Room<'a> {
    gate: &'a Gate,
    bytes: u64,
}

impl Gate {
    /// A gate to so many bytes.
    pub fn new(bytes: u64) -> Self {
        Self {
            all: bytes,
            free: Mutex::new(bytes),
            left: Condvar::new(),
        }
    }

    /// Waits for room; who wants more than there is gets all of it, alone.
    pub fn enter(&self, bytes: u64) -> Room<'_> {
        let bytes = bytes.min(self.all);
        let mut free = self.free.lock().unwrap_or_else(|e| e.into_inner());
        while *free < bytes {
            free = self.left.wait(free).unwrap_or_else(|e| e.into_inner());
        }
        *free -= bytes;
        Room { gate: self, bytes }
    }
}

impl Drop for Room<'_> {
    fn drop(&mut self) {
        *self.gate.free.lock().unwrap_or_else(|e| e.into_inner()) += self.bytes;
        self.gate.left.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[test]
    fn finer_texels_are_expected_to_take_more() {
        let mut request = Request {
            input: "absent.glb".into(),
            ..Request::default()
        };
        assert_eq!(expected_bytes(&request), 192 << 20);
        request.recipe.texel_density = 2.0;
        assert_eq!(expected_bytes(&request), (4 * 192) << 20);
        request.scene.heights_px = vec![1024.0, 512.0];
        assert_eq!(expected_bytes(&request), (16 * 192) << 20);
    }

    #[test]
    fn never_more_than_fits_is_inside_and_the_largest_goes_in_alone() {
        let gate = Gate::new(100);
        let (inside, most) = (AtomicU64::new(0), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for bytes in [30, 60, 500, 70, 20, 100, 40, 10] {
                let (gate, inside, most) = (&gate, &inside, &most);
                scope.spawn(move || {
                    let room = gate.enter(bytes);
                    let now = inside.fetch_add(bytes.min(100), Ordering::SeqCst) + bytes.min(100);
                    most.fetch_max(now, Ordering::SeqCst);
                    std::thread::sleep(std::time::Duration::from_millis(2));
                    inside.fetch_sub(bytes.min(100), Ordering::SeqCst);
                    drop(room);
                });
            }
        });
        assert!((60..=100).contains(&most.load(Ordering::SeqCst)));
        assert_eq!(*gate.free.lock().unwrap(), 100);
    }
}
