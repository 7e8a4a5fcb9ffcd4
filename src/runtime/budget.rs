//! Which leaves to draw under a budget (Lee and others, "View-Dependent Visibility Estimation for
//! Tree Models").
//!
//! Leaves, or groups of them, get a priority; the highest are drawn until the budget is spent,
//! exactly: of the group that would exceed it only a part is drawn. With layers, the budget is first
//! shared out by equation 1.

use glam::Vec3;

/// A leaf, or a group of leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// Its middle.
    pub center: Vec3,
    /// Unit normal; either side.
    pub normal: Vec3,
    /// Number of leaves.
    pub leaves: u32,
}

/// What is drawn of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// Index of the item.
    pub item: u32,
    /// So many of its leaves.
    pub leaves: u32,
}

/// Priority by distance (section III.A): the nearer to the eye, the more visible. 0 to 1.
pub fn by_distance(item: &Item, eye: Vec3) -> f32 {
    1.0 / (1.0 + item.center.distance(eye))
}

/// Priority by normal (section III.B): the more a leaf faces the eye, the more visible. 0 to 1.
///
/// The viewing direction is the one from the eye to the leaf.
pub fn by_normal(item: &Item, eye: Vec3) -> f32 {
    let direction = (item.center - eye).normalize_or_zero();
    item.normal.dot(direction).abs().min(1.0)
}

/// Spends budgets; keeps its lists, so that no frame allocates.
#[derive(Clone, Debug, Default)]
pub struct Spender {
    order: Vec<(u32, f32, u32)>,
    chosen: Vec<Chosen>,
    counts: Vec<u32>,
    shares: Vec<u32>,
}

impl Spender {
    /// Draws the items of highest priority (`priority` by index), `budget` leaves in all, or all
    /// there are. Equal priorities go by index; not a number counts as the lowest.
    pub fn spend(
        &mut self,
        items: &[Item],
        budget: u32,
        priority: impl Fn(usize) -> f32,
    ) -> &[Chosen] {
        self.rank(items, |_| 0, priority);
        self.chosen.clear();
        take(&self.order, items, budget, &mut self.chosen);
        &self.chosen
    }

    /// Layers of equal depth along `forward` share the budget (section III.C), in each layer by
    /// `priority`.
    ///
    /// Equation 1: layer i of G, the nearest first, gets `(G - i + 1) / (1 + ... + G) * L`, and what it
    /// can't use passes to the next. L is the budget: the paper says all leaves of the tree, which
    /// would leave the budget without effect. Fractions of a leaf are carried along. What even the
    /// last layer can't use goes to the first that still can.
    pub fn spend_layers(
        &mut self,
        items: &[Item],
        budget: u32,
        (eye, forward): (Vec3, Vec3),
        layers: u32,
        priority: impl Fn(usize) -> f32,
    ) -> &[Chosen] {
        let layers = layers.clamp(1, 1 << 16);
        let depth = |item: &Item| (item.center - eye).dot(forward);
        let bounds = items
            .iter()
            .map(depth)
            .fold((f32::MAX, f32::MIN), |(a, b), d| (a.min(d), b.max(d)));
        let width = (bounds.1 - bounds.0).max(1e-20) / layers as f32;
        let layer = |i: usize| (((depth(&items[i]) - bounds.0) / width) as u32).min(layers - 1);
        self.rank(items, layer, priority);
        self.share_out(items, budget, layers);
        self.chosen.clear();
        let mut rest = &self.order[..];
        for (layer, &share) in self.shares.iter().enumerate() {
            let end = rest.partition_point(|o| o.0 <= layer as u32);
            take(&rest[..end], items, share, &mut self.chosen);
            rest = &rest[end..];
        }
        &self.chosen
    }

    /// Sorts by layer, then by falling priority, then by index.
    fn rank(
        &mut self,
        items: &[Item],
        layer: impl Fn(usize) -> u32,
        priority: impl Fn(usize) -> f32,
    ) {
        let key = |i: usize| match priority(i) {
            p if p.is_nan() => f32::NEG_INFINITY,
            p => p,
        };
        self.order.clear();
        self.order
            .extend((0..items.len()).map(|i| (layer(i), key(i), i as u32)));
        self.order
            .sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(&b.2)));
    }

    /// Equation 1.
    fn share_out(&mut self, items: &[Item], budget: u32, layers: u32) {
        self.counts.clear();
        self.counts.resize(layers as usize, 0);
        for &(layer, _, item) in &self.order {
            self.counts[layer as usize] += items[item as usize].leaves;
        }
        let g = u64::from(layers);
        let (whole, mut given) = (g * (g + 1) / 2, 0u64);
        self.shares.clear();
        // Up to layer i the layers' shares add up to this, whatever was passed on.
        let mut due = 0u64;
        for (i, &count) in (0u64..).zip(&self.counts) {
            due += (g - i) * u64::from(budget);
            let share = (due / whole).saturating_sub(given).min(u64::from(count));
            given += share;
            self.shares.push(share as u32);
        }
        let mut rest = u64::from(budget) - given;
        for (share, &count) in self.shares.iter_mut().zip(&self.counts) {
            let more = u64::from(count - *share).min(rest);
            *share += more as u32;
            rest -= more;
        }
    }
}

/// Takes leaves in order until the budget is spent.
fn take(order: &[(u32, f32, u32)], items: &[Item], budget: u32, chosen: &mut Vec<Chosen>) {
    let mut rest = budget;
    for &(_, _, item) in order {
        let leaves = items[item as usize].leaves.min(rest);
        if rest == 0 {
            return;
        }
        if leaves > 0 {
            chosen.push(Chosen { item, leaves });
        }
        rest -= leaves;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(z: f32, normal: Vec3, leaves: u32) -> Item {
        Item {
            center: Vec3::Z * z,
            normal,
            leaves,
        }
    }

    fn total(chosen: &[Chosen]) -> u32 {
        chosen.iter().map(|c| c.leaves).sum()
    }

    #[test]
    fn nearer_and_facing_leaves_come_first() {
        let items = [
            leaf(5.0, Vec3::X, 1),
            leaf(3.0, Vec3::Z, 1),
            leaf(9.0, Vec3::NEG_Z, 1),
        ];
        let mut spender = Spender::default();
        let first = |chosen: &[Chosen]| chosen[0].item;
        let eye = Vec3::ZERO;
        assert_eq!(
            first(spender.spend(&items, 1, |i| by_distance(&items[i], eye))),
            1
        );
        let by = |i: usize| by_normal(&items[i], eye);
        assert_eq!((by(0), by(1), by(2)), (0.0, 1.0, 1.0));
        assert_eq!(
            spender.spend(&items, 2, by),
            [Chosen { item: 1, leaves: 1 }, Chosen { item: 2, leaves: 1 }]
        );
    }

    #[test]
    fn equation_1_by_hand() {
        // Three layers of 10, 1 and 10 leaves; a budget of 12: 6, 4 and 2. The second layer can
        // use one, so the third gets 2 + 3.
        let mut items: Vec<Item> = (0..10).map(|_| leaf(0.0, Vec3::Z, 1)).collect();
        items.push(leaf(1.5, Vec3::Z, 1));
        items.extend((0..10).map(|_| leaf(3.0, Vec3::Z, 1)));
        let mut spender = Spender::default();
        let chosen = spender.spend_layers(&items, 12, (Vec3::NEG_Z, Vec3::Z), 3, |_| 1.0);
        let count = |from: u32, to: u32| {
            chosen
                .iter()
                .filter(|c| (from..to).contains(&c.item))
                .count()
        };
        assert_eq!((count(0, 10), count(10, 11), count(11, 21)), (6, 1, 5));
    }

    #[test]
    fn what_the_last_layer_cannot_use_goes_back_to_the_first() {
        let mut items: Vec<Item> = (0..10).map(|_| leaf(0.0, Vec3::Z, 1)).collect();
        items.push(leaf(3.0, Vec3::Z, 1));
        let mut spender = Spender::default();
        // Two layers, a budget of 9: 6 and 3, but the second has one leaf.
        let chosen = spender.spend_layers(&items, 9, (Vec3::NEG_Z, Vec3::Z), 2, |_| 1.0);
        assert_eq!(total(chosen), 9);
        assert!(chosen.iter().any(|c| c.item == 10));
    }

    #[test]
    fn budgets_are_spent_exactly_on_leaves_and_on_groups() {
        let items: Vec<Item> = (0..100)
            .map(|i| leaf((i * 37 % 50) as f32, Vec3::new(0.6, 0.0, 0.8), 1 + i % 7))
            .collect();
        let all: u32 = items.iter().map(|i| i.leaves).sum();
        let (eye, mut spender) = (Vec3::NEG_Z, Spender::default());
        for budget in [0, 1, 5, 100, 101, all - 1, all, all + 50] {
            let wanted = budget.min(all);
            assert_eq!(
                total(spender.spend(&items, budget, |i| by_distance(&items[i], eye))),
                wanted
            );
            for layers in [1, 2, 10, 1000] {
                let chosen = spender.spend_layers(&items, budget, (eye, Vec3::Z), layers, |i| {
                    by_normal(&items[i], eye)
                });
                assert_eq!(total(chosen), wanted);
                let mut seen: Vec<u32> = chosen.iter().map(|c| c.item).collect();
                seen.sort_unstable();
                seen.dedup();
                assert_eq!(seen.len(), chosen.len());
                assert!(
                    chosen
                        .iter()
                        .all(|c| c.leaves <= items[c.item as usize].leaves)
                );
            }
        }
    }

    #[test]
    fn no_items_and_strange_priorities_have_an_answer() {
        let mut spender = Spender::default();
        assert!(spender.spend(&[], 5, |_| 0.0).is_empty());
        assert!(
            spender
                .spend_layers(&[], 5, (Vec3::ZERO, Vec3::Z), 4, |_| 0.0)
                .is_empty()
        );
        let items = [leaf(0.0, Vec3::Z, 1), leaf(1.0, Vec3::Z, 1)];
        let chosen = spender.spend(&items, 1, |i| if i == 0 { f32::NAN } else { 0.1 });
        assert_eq!(chosen[0].item, 1);
    }
}
