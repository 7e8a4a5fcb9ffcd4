//! A forest shared out among threads.

use super::place::Place;

/// Which trees each of `count` threads takes, by their index in `places`. Trees of one block of `block_m` on the
/// ground stay together, because what hides one of them is nearly what hides the others, and neighbouring blocks go to
/// different threads, because what is near costs most. Twice the distance between trees is a good block.
///
/// Every other share goes from the last tree to the first: two threads that share what hides trees (clones of
/// [`Occlusion`](super::Occlusion)) are then seldom in one place at once, each computing what the other is about to know.
///
/// A tree that stands nowhere (a position that is not finite) is the first thread's; a block that is not larger than
/// 0 is taken as 1.
pub fn shares(places: &[Place], count: usize, block_m: f32) -> Vec<Vec<u32>> {
    let count = count.max(1);
    let mut out = vec![Vec::new(); count];
    let block = if block_m > 0.0 { block_m } else { 1.0 };
    let stride = stride(count) as i64;
    for (tree, place) in (0..).zip(places) {
        // Casts saturate, and make 0 of what is no number.
        let [x, z] = [place.position.x, place.position.z].map(|at| (at / block).floor() as i32);
        let share = i64::from(x) + stride * i64::from(z);
        out[share.rem_euclid(count as i64) as usize].push(tree);
    }
    out.iter_mut().skip(1).step_by(2).for_each(|s| s.reverse());
    out
}

/// How far a row of blocks is moved against the one before: by about a golden section, so that the blocks of one
/// thread are neighbours neither along rows nor across.
fn stride(count: usize) -> usize {
    let shares_a_factor =
        |a: usize| (2..=a).any(|f| a.is_multiple_of(f) && count.is_multiple_of(f));
    let start = ((count as f32 * 0.382).round() as usize).max(1);
    (start..).find(|&a| !shares_a_factor(a)).unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn at(x: f32, z: f32) -> Place {
        Place::at(Vec3::new(x, 0.0, z))
    }

    #[test]
    fn every_tree_is_shared_out_once_and_blocks_stay_together() {
        let places: Vec<Place> = (0..900)
            .map(|i| at((i % 30) as f32 * 3.0 - 40.0, (i / 30) as f32 * 3.0 - 40.0))
            .collect();
        for count in [1, 2, 3, 4, 7, 16] {
            let shares = shares(&places, count, 9.0);
            assert_eq!(shares.len(), count);
            let mut all: Vec<u32> = shares.concat();
            all.sort_unstable();
            assert_eq!(all, (0..900).collect::<Vec<u32>>());
            let block = |tree: u32| {
                let p = places[tree as usize].position;
                [p.x, p.z].map(|v| (v / 9.0).floor() as i32)
            };
            let thread = |[x, z]: [i32; 2]| {
                shares
                    .iter()
                    .position(|s| s.iter().any(|&t| block(t) == [x, z]))
            };
            for (i, share) in shares.iter().enumerate() {
                assert!(if i % 2 == 0 {
                    share.is_sorted()
                } else {
                    share.is_sorted_by(|a, b| a > b)
                });
                // Near enough to alike.
                let even = 900 / count;
                assert!(share.len() > even / 2 && share.len() < even * 2, "{count}");
                for &tree in share {
                    let first = thread(block(tree)).unwrap();
                    assert!(shares[first].contains(&tree), "{tree} of {count}");
                }
            }
            if count > 1 {
                let here = thread([0, 0]);
                assert!(here != thread([1, 0]) && here != thread([0, 1]), "{count}");
            }
        }
    }

    #[test]
    fn what_stands_nowhere_and_blocks_of_no_size_have_an_answer() {
        let places = [
            at(f32::NAN, 0.0),
            at(f32::INFINITY, 1e30),
            at(0.5, 0.5),
            at(1.5, 0.5),
        ];
        for block in [0.0, -1.0, f32::NAN, 1e-30, 1e30] {
            let shares = shares(&places, 2, block);
            assert_eq!(shares.iter().map(Vec::len).sum::<usize>(), 4);
        }
        assert_eq!(shares(&places[2..], 2, 0.0), [vec![0], vec![1]]);
        assert_eq!(shares(&places, 0, 1.0).len(), 1);
        assert_eq!(shares(&[], 3, 1.0), vec![Vec::<u32>::new(); 3]);
    }
}
