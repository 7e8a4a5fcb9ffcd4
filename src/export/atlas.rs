//! Packs charts into one page with sides that are powers of two.

use guillotiere::{AllocatorOptions, AtlasAllocator, size2};

use super::chart::Chart;

/// Side of the largest page, texels: what every engine and GPU of the last decade loads.
pub const MAX_SIDE: u32 = 8192;

/// Places all charts on one page and returns its size in texels, or `None` where they don't fit
/// on the largest page (the caller lowers the texel density and tries again).
pub fn pack(charts: &mut [Chart]) -> Option<[u32; 2]> {
    let slots = slots(charts);
    let texels: u64 = slots
        .iter()
        .map(|s| u64::from(s.size[0]) * u64::from(s.size[1]))
        .sum();
    let widest = slots
        .iter()
        .map(|s| s.size[0].max(s.size[1]))
        .max()
        .unwrap_or(1);
    let mut side = [16u32, 16];
    while u64::from(side[0]) * u64::from(side[1]) < texels || side[0] < widest {
        grow(&mut side);
    }
    while side[0] <= MAX_SIDE {
        if let Some(places) = allocate(&slots, side) {
            for (slot, place) in slots.iter().zip(places) {
                place_slot(charts, slot, place);
            }
            return Some(side);
        }
        grow(&mut side);
    }
    None
}

/// 16x16, 32x16, 32x32, 64x32, ...
fn grow(side: &mut [u32; 2]) {
    if side[0] == side[1] {
        side[0] *= 2;
    } else {
        side[1] *= 2;
    }
}

/// A rectangle for one chart, or for two triangular charts that share it.
struct Slot {
    size: [u32; 2],
    charts: [Option<u32>; 2],
}

fn slots(charts: &[Chart]) -> Vec<Slot> {
    let mut halves: Vec<u32> = (0..charts.len() as u32)
        .filter(|&i| charts[i as usize].half)
        .collect();
    halves.sort_by_key(|&i| {
        let [w, h] = charts[i as usize].size;
        (std::cmp::Reverse(h), std::cmp::Reverse(w), i)
    });
    let mut out: Vec<Slot> = halves
        .chunks(2)
        .map(|pair| {
            let (a, b) = (
                charts[pair[0] as usize].size,
                charts[pair[pair.len() - 1] as usize].size,
            );
            Slot {
                size: [a[0].max(b[0]), a[1].max(b[1])],
                charts: [Some(pair[0]), pair.get(1).copied()],
            }
        })
        .collect();
    out.extend(
        (0..charts.len() as u32)
            .filter(|&i| !charts[i as usize].half)
            .map(|i| Slot {
                size: charts[i as usize].size,
                charts: [Some(i), None],
            }),
    );
    // Large rectangles first; ties keep the order of the charts.
    out.sort_by_key(|s| std::cmp::Reverse((s.size[1].max(s.size[0]), s.size[0].min(s.size[1]))));
    out
}

fn allocate(slots: &[Slot], side: [u32; 2]) -> Option<Vec<[u32; 2]>> {
    let options = AllocatorOptions::default();
    let mut allocator =
        AtlasAllocator::with_options(size2(side[0] as i32, side[1] as i32), &options);
    slots
        .iter()
        .map(|slot| {
            let size = size2(slot.size[0] as i32, slot.size[1] as i32);
            let found = allocator.allocate(size)?.rectangle.min;
            Some([found.x as u32, found.y as u32])
        })
        .collect()
}

fn place_slot(charts: &mut [Chart], slot: &Slot, place: [u32; 2]) {
    if let Some(first) = slot.charts[0] {
        charts[first as usize].place = place;
    }
    if let Some(second) = slot.charts[1] {
        let chart = &mut charts[second as usize];
        chart.turned = true;
        // Turned by 180 degrees, its right angle sits in the opposite corner of the rectangle.
        chart.place = [
            place[0] + slot.size[0] - chart.size[0],
            place[1] + slot.size[1] - chart.size[1],
        ];
    }
}
