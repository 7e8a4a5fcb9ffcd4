//! Lays out cards on one page with sides that are powers of two.

use guillotiere::{AllocatorOptions, AtlasAllocator, size2};
use rayon::prelude::*;

use super::chart::{Chart, Shape};
use crate::cloud::card::Card;
use crate::recipe::Packer;

/// Side of the largest page, texels: what every engine and GPU of the last decade loads.
pub const MAX_SIDE: u32 = 8192;

/// How cards are laid out.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Texels a normalised unit.
    pub density: f32,
    /// Gutter on each side of a chart, texels.
    pub pad: f32,
    /// What shares a page how.
    pub packer: Packer,
}

/// One chart for each card, then one for the back of each of the cards `sided`, and the size of their page
/// in texels. Where they don't fit on the largest page, density and gutters fall until they do.
pub fn lay_out(cards: &[&Card], sided: &[u32], layout: Layout) -> (Vec<Chart>, [u32; 2]) {
    let Layout {
        mut density,
        mut pad,
        packer,
    } = layout;
    loop {
        let page = match packer {
            Packer::Rectangles => rectangles(cards, sided, density, pad),
            Packer::Outlines => outlines(cards, sided, density, pad),
        };
        match page {
            Some(page) => return page,
            None => (density, pad) = (density * 0.8, pad * 0.8),
        }
    }
}

/// Gutters wider than this gain nothing any more: with 12 texels the fourth mip, whose texels are
/// 16 wide and are read two by two, sees no other chart.
const WIDEST: u32 = 12;

type Page = (Vec<Chart>, [u32; 2]);

fn rectangles(cards: &[&Card], sided: &[u32], density: f32, pad: f32) -> Option<Page> {
    let with_gutter = |pad: f32| -> Vec<Chart> {
        let charts = cards.par_iter().map(|card| Chart::new(card, density, pad));
        let mut charts: Vec<Chart> = charts.collect();
        charts.extend(backs(&charts, sided));
        charts
    };
    let mut charts = with_gutter(pad);
    let size = pack(&mut charts)?;
    // What the page has to spare: sides that are powers of two leave up to half of it empty.
    let (mut fits, mut too_wide) = (pad.floor() as u32, WIDEST + 1);
    while fits + 1 < too_wide {
        let middle = u32::midpoint(fits, too_wide);
        let mut wider = with_gutter(middle as f32);
        if place(&mut wider, size) {
            (charts, fits) = (wider, middle);
        } else {
            too_wide = middle;
        }
    }
    Some((charts, size))
}

fn backs(charts: &[Chart], sided: &[u32]) -> Vec<Chart> {
    let back = |&card: &u32| charts[card as usize].back();
    sided.iter().map(back).collect()
}

#[cfg(feature = "xatlas")]
fn outlines(cards: &[&Card], sided: &[u32], density: f32, pad: f32) -> Option<Page> {
    let again = sided.iter().map(|&card| cards[card as usize]);
    let both: Vec<&Card> = cards.iter().copied().chain(again).collect();
    let outline = |card: &&Card| {
        let chart = Chart::rectangle(card, density, 0.0);
        chart.corners.iter().map(|&p| chart.texel(p)).collect()
    };
    let outlines: Vec<_> = both.iter().map(outline).collect();
    let packed = super::xatlas::pack(&outlines, pad.ceil() as u32, MAX_SIDE)?;
    let charts = both.par_iter().zip(&packed.corners);
    let charts = charts.map(|(card, corners)| Chart::placed(card, corners, pad, packed.size));
    let mut charts: Vec<Chart> = charts.collect();
    for back in &mut charts[cards.len()..] {
        *back = back.back();
    }
    Some((charts, packed.size))
}

/// Nobody gets here: [`Packer::check`] refuses outlines before a bake starts.
#[cfg(not(feature = "xatlas"))]
fn outlines(cards: &[&Card], sided: &[u32], density: f32, pad: f32) -> Option<Page> {
    rectangles(cards, sided, density, pad)
}

/// Places all charts on the smallest page that holds them and returns its size in texels, or
/// `None` where the largest does not.
pub fn pack(charts: &mut [Chart]) -> Option<[u32; 2]> {
    let slots = slots(charts);
    let texels = texels(&slots);
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
        if place_slots(charts, &slots, side) {
            return Some(side);
        }
        grow(&mut side);
    }
    None
}

/// Places all charts on a page of the given size, or none.
pub fn place(charts: &mut [Chart], side: [u32; 2]) -> bool {
    let slots = slots(charts);
    let room = u64::from(side[0]) * u64::from(side[1]);
    texels(&slots) <= room && place_slots(charts, &slots, side)
}

fn texels(slots: &[Slot]) -> u64 {
    let texels = slots
        .iter()
        .map(|s| u64::from(s.size[0]) * u64::from(s.size[1]));
    texels.sum()
}

fn place_slots(charts: &mut [Chart], slots: &[Slot], side: [u32; 2]) -> bool {
    let Some(places) = allocate(slots, side) else {
        return false;
    };
    for (slot, place) in slots.iter().zip(places) {
        place_slot(charts, slot, place);
    }
    true
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

/// How many candidates a triangular chart looks at for one to share its rectangle with.
const CANDIDATES: usize = 64;

fn slots(charts: &[Chart]) -> Vec<Slot> {
    let size = |i: u32| charts[i as usize].size;
    let is_half = |i: &u32| charts[*i as usize].shape == Shape::Half;
    let all = 0..charts.len() as u32;
    let mut halves: Vec<u32> = all.clone().filter(is_half).collect();
    halves.sort_by_key(|&i| {
        (
            std::cmp::Reverse(size(i)[1]),
            std::cmp::Reverse(size(i)[0]),
            i,
        )
    });
    let mut out: Vec<Slot> = all
        .filter(|i| !is_half(i))
        .map(|i| Slot {
            size: size(i),
            charts: [Some(i), None],
        })
        .collect();
    let mut free = vec![true; halves.len()];
    for first in 0..halves.len() {
        if !std::mem::replace(&mut free[first], false) {
            continue;
        }
        let joint = |a: u32, b: u32| {
            let (a, b) = (size(a), size(b));
            [a[0].max(b[0]), a[1].max(b[1])]
        };
        let area = |[w, h]: [u32; 2]| i64::from(w) * i64::from(h);
        let one = halves[first];
        // The partner in whose company the fewest texels of the rectangle are nobody's.
        let other = (first + 1..halves.len())
            .filter(|&k| free[k])
            .take(CANDIDATES)
            .min_by_key(|&k| 2 * area(joint(one, halves[k])) - area(size(halves[k])));
        out.push(match other {
            Some(k) => {
                free[k] = false;
                Slot {
                    size: joint(one, halves[k]),
                    charts: [Some(one), Some(halves[k])],
                }
            }
            None => Slot {
                size: size(one),
                charts: [Some(one), None],
            },
        });
    }
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

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    /// Cards of all sizes and shapes that occur: triangles, slivers among them, and rectangles.
    fn cards(count: u32) -> Vec<Card> {
        let unit = |i: u32| {
            let mixed = (i ^ (i >> 7)).wrapping_mul(0x9e37_79b9);
            (mixed ^ (mixed >> 15)).wrapping_mul(0x2c1b_3c6d) as f32 / u32::MAX as f32
        };
        let card = |i: u32| {
            let [w, h] = [unit(4 * i), unit(4 * i + 1)].map(|s| 0.05 + s * s);
            let height = if i.is_multiple_of(4) { 0.02 } else { h };
            let (sin, cos) = unit(4 * i + 2).sin_cos();
            let (u, v) = (Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0));
            match i.is_multiple_of(5) {
                true => Card::rectangle(Vec3::ONE, u, v, Vec2::new(w, h) / 2.0),
                false => Card {
                    origin: Vec3::ZERO,
                    u,
                    v,
                    outline: vec![
                        Vec2::ZERO,
                        Vec2::new(w, 0.0),
                        Vec2::new(w * (1.4 * unit(4 * i + 3) - 0.2), height),
                    ],
                },
            }
        };
        (0..count).map(card).collect()
    }

    fn check(packer: Packer, pad: f32) {
        let cards = cards(80);
        let cards: Vec<&Card> = cards.iter().collect();
        let layout = Layout {
            density: 40.0,
            pad,
            packer,
        };
        let (charts, [w, h]) = lay_out(&cards, &[3, 40], layout);
        assert!(w.is_power_of_two() && h.is_power_of_two());
        let mut owner = vec![None; (w * h) as usize];
        for (i, chart) in charts.iter().enumerate() {
            for (x, y) in (0..chart.size[1]).flat_map(|y| (0..chart.size[0]).map(move |x| (x, y))) {
                if chart.owns(x, y) {
                    let [ax, ay] = chart.in_atlas(x, y);
                    let before = owner[(ay * w + ax) as usize].replace(i);
                    assert_eq!(before, None, "{packer:?}: {i} at {ax}, {ay}");
                }
            }
        }
        assert_eq!(charts.len(), cards.len() + 2);
        for (i, (chart, card)) in charts.iter().zip(&cards).enumerate() {
            let corners: Vec<Vec3> = card.corners().collect();
            for k in 0..corners.len() {
                let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
                // What a client reads along an edge, the four texels around it, is the card's, but
                // for a trace across the edge that two triangles share.
                for t in 0..=20 {
                    let at = chart.atlas_point(a.lerp(b, t as f32 / 20.0)) - 0.5;
                    let (texel, t) = (at.floor(), at - at.floor());
                    let mut foreign = 0.0;
                    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                        let (x, y) = ((texel.x + dx) as u32, (texel.y + dy) as u32);
                        if owner[(y * w + x) as usize] != Some(i) {
                            foreign += (1.0 - dx - t.x).abs() * (1.0 - dy - t.y).abs();
                        }
                    }
                    assert!(foreign < 0.1, "{packer:?}: {foreign} of {i} at {at}");
                }
                // No side of a card gets far fewer texels than it asked for.
                let texels = chart.atlas_point(a).distance(chart.atlas_point(b));
                assert!(
                    texels > 0.7 * a.distance(b) * layout.density,
                    "{packer:?}: {i}"
                );
            }
        }
    }

    #[test]
    fn every_texel_has_one_owner_and_edges_have_their_gutters() {
        check(Packer::Rectangles, 1.0);
        check(Packer::Rectangles, 3.0);
    }

    #[cfg(feature = "xatlas")]
    #[test]
    fn outlines_packed_by_xatlas_keep_apart_too() {
        check(Packer::Outlines, 1.0);
        check(Packer::Outlines, 3.0);
    }

    #[test]
    fn slivers_do_not_blow_up() {
        // 100 x 2 texels with the tip over the middle: sheared to a right triangle on its short
        // sides it would take a square of 50.
        let outline = [(0.0, 0.0), (100.0, 0.0), (50.0, 2.0)]
            .map(Vec2::from)
            .to_vec();
        let card = Card {
            origin: Vec3::ZERO,
            u: Vec3::X,
            v: Vec3::Y,
            outline,
        };
        let chart = Chart::new(&card, 1.0, 1.0);
        assert_eq!((chart.size, chart.shape), ([102, 4], Shape::Whole));
    }
}
