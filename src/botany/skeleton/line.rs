//! The centre line of a chain: put straight where branches leave, and as few nodes as show it.

use glam::Vec3;

/// A node is left out where the line without it passes nearer than this many radii, and its radius
/// differs by no more than this share.
const TOLERANCE_IN_RADII: f32 = 0.1;

/// Where branches leave, level sets hold them too and their middles lie between: those nodes are
/// put on the line between their clean neighbours.
pub fn straighten(nodes: &mut [(Vec3, f32)], clean: &[bool]) {
    let mut below: Option<usize> = None;
    for above in (0..nodes.len()).filter(|&i| clean[i]) {
        if let Some(below) = below {
            let ((p, a), (q, b)) = (nodes[below], nodes[above]);
            for (k, node) in nodes[below..above].iter_mut().enumerate().skip(1) {
                let along = k as f32 / (above - below) as f32;
                *node = (p.lerp(q, along), a + (b - a) * along);
            }
        }
        below = Some(above);
    }
}

/// Which nodes to keep: both ends, those marked already, and what the line needs (Douglas and
/// Peucker 1973).
pub fn needed(nodes: &[(Vec3, f32)], keep: &mut [bool]) {
    let Some(last) = nodes.len().checked_sub(1) else {
        return;
    };
    (keep[0], keep[last]) = (true, true);
    let fixed: Vec<usize> = (0..nodes.len()).filter(|&i| keep[i]).collect();
    let mut open: Vec<(usize, usize)> = fixed.windows(2).map(|w| (w[0], w[1])).collect();
    while let Some((from, to)) = open.pop() {
        let worst = (from + 1..to)
            .map(|i| (i, deviation(nodes, from, to, i)))
            .fold((from, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        if worst.1 > TOLERANCE_IN_RADII {
            keep[worst.0] = true;
            open.extend([(from, worst.0), (worst.0, to)]);
        }
    }
}

/// How far a node is from the segment between two others, in its radii.
fn deviation(nodes: &[(Vec3, f32)], from: usize, to: usize, i: usize) -> f32 {
    let ((p, a), (q, b), (x, r)) = (nodes[from], nodes[to], nodes[i]);
    let along = ((x - p).dot(q - p) / (q - p).length_squared().max(1e-24)).clamp(0.0, 1.0);
    let off = x
        .distance(p.lerp(q, along))
        .max((a + (b - a) * along - r).abs());
    off / r.max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_shows_the_line_is_kept() {
        let mut nodes: Vec<(Vec3, f32)> = (0..=10).map(|i| (Vec3::Y * i as f32, 1.0)).collect();
        nodes.extend((1..=10).map(|i| (Vec3::new(i as f32, 10.0, 0.0), 1.0)));
        let mut keep = vec![false; nodes.len()];
        // A fork.
        keep[4] = true;
        needed(&nodes, &mut keep);
        let kept: Vec<usize> = (0..nodes.len()).filter(|&i| keep[i]).collect();
        assert_eq!(kept, [0, 4, 10, 20]);
    }

    #[test]
    fn a_change_of_radius_is_kept() {
        let radius = |i: usize| if i < 6 { 1.0 } else { 0.5 };
        let nodes: Vec<(Vec3, f32)> = (0..12).map(|i| (Vec3::Y * i as f32, radius(i))).collect();
        let mut keep = vec![false; 12];
        needed(&nodes, &mut keep);
        assert!(keep[5] && keep[6], "{keep:?}");
    }

    #[test]
    fn nodes_that_hold_a_branch_too_go_back_on_the_line() {
        let mut nodes: Vec<(Vec3, f32)> = (0..5).map(|i| (Vec3::Y * i as f32, 1.0)).collect();
        nodes[2] = (Vec3::new(0.7, 2.0, 0.0), 1.6);
        straighten(&mut nodes, &[true, true, false, true, true]);
        assert_eq!(nodes[2], (Vec3::Y * 2.0, 1.0));
    }
}
