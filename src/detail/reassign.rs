//! After a cut, leaves move to the nearest plane among their neighbours' and planes are refitted.
//!
//! A k-planes iteration in the manner of Lloyd: measured, it gives +.01 to +.025 F1. The locality
//! weight keeps cards compact: a leaf far along a plane costs texels.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::element::Element;
use crate::space::eigen::Moments;
use crate::space::grid::nearest_neighbours;

/// How elements are moved between planes.
#[derive(Clone, Copy, Debug)]
pub struct Reassign {
    /// Rounds of assignment and refit.
    pub rounds: u32,
    /// Weight of the squared in-plane distance to the plane's centre against the squared distance
    /// to the plane (no unit).
    pub locality: f64,
    /// Neighbours whose planes an element may move to.
    pub neighbours: usize,
}

#[derive(Clone, Copy)]
struct Plane {
    center: DVec3,
    normal: DVec3,
}

fn fit(moments: &Moments) -> Plane {
    Plane {
        center: moments.mean,
        normal: moments.axes().map_or(DVec3::Y, |a| a.normal()),
    }
}

/// Mean squared distance of an element's surface from a plane plus the locality term.
fn cost(moments: &Moments, plane: &Plane, locality: f64) -> f64 {
    let offset = moments.mean - plane.center;
    let height = offset.dot(plane.normal);
    let spread = plane.normal.dot(moments.scatter * plane.normal) / moments.weight.max(1e-300);
    let across = spread + height * height;
    across + locality * (offset.length_squared() - height * height)
}

/// Moves the elements of `groups` between them; groups that lose all elements are dropped.
pub fn reassign(elements: &[Element], groups: &mut Vec<Vec<u32>>, options: Reassign) {
    let members: Vec<u32> = groups.iter().flatten().copied().collect();
    if groups.len() < 2 || members.len() <= groups.len() {
        return;
    }
    let centers: Vec<Vec3> = members
        .iter()
        .map(|&e| elements[e as usize].center)
        .collect();
    let near = nearest_neighbours(&centers, options.neighbours);
    let mut group_of: Vec<u32> = Vec::with_capacity(members.len());
    for (g, group) in groups.iter().enumerate() {
        group_of.extend(std::iter::repeat_n(g as u32, group.len()));
    }
    for _ in 0..options.rounds {
        let mut moments = vec![Moments::default(); groups.len()];
        for (i, &e) in members.iter().enumerate() {
            let group = &mut moments[group_of[i] as usize];
            *group = group.merged(&elements[e as usize].moments);
        }
        let planes: Vec<Plane> = moments.par_iter().map(fit).collect();
        let next: Vec<u32> = (0..members.len())
            .into_par_iter()
            .map(|i| {
                let element = &elements[members[i] as usize].moments;
                let mut best = group_of[i];
                let mut least = cost(element, &planes[best as usize], options.locality);
                for &j in &near[i] {
                    let g = group_of[j as usize];
                    if g != best {
                        let c = cost(element, &planes[g as usize], options.locality);
                        if c < least || (c == least && g < best) {
                            (least, best) = (c, g);
                        }
                    }
                }
                best
            })
            .collect();
        let moved = next.iter().zip(&group_of).filter(|(a, b)| a != b).count();
        group_of = next;
        if moved == 0 {
            break;
        }
    }
    let mut out = vec![Vec::new(); groups.len()];
    for (i, &e) in members.iter().enumerate() {
        out[group_of[i] as usize].push(e);
    }
    for group in &mut out {
        group.sort_unstable();
    }
    out.retain(|group| !group.is_empty());
    *groups = out;
}
