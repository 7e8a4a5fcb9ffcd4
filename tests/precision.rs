//! The papers' formulas against evaluations that round less, over random inputs.
//!
//! `cargo test --release --test precision -- --nocapture` prints the largest errors. An error is relative to the
//! value, or to one where the formula gives a share: a share of 1e-9 that is off by 1e-9 is as good as right.

use glam::{DMat3, DVec3, IVec3, Vec2, Vec3};
use pleach::cloud::card::Card;
use pleach::cloud::coverage::{coverage, epsilon};
use pleach::cloud::foliage::{Face, Foliage};
use pleach::cloud::occlusion::{Density, ball, transfer};
use pleach::runtime::{
    Cells, Density as DengDensity, Hierarchy, Item, Law, Occlusion, Place, Subtree, Visibility,
    blend, by_distance, by_normal,
};
use pleach::space::eigen::{Moments, symmetric_eigen};
use pleach::space::raster::Coverage;

/// Numbers from 0 to 1, the same on every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }

    fn direction(&mut self) -> Vec3 {
        self.point().normalize_or(Vec3::X)
    }
}

/// Prints the largest error of many cases, and fails beyond `most`. A case is what the program says, what is
/// right, and what the difference is measured by.
fn hold(formula: &str, most: f64, cases: impl Iterator<Item = [f64; 3]>) {
    let (mut worst, mut count, mut spread) = (0.0f64, 0, (f64::MAX, f64::MIN));
    for [said, right, unit] in cases {
        assert!(
            said.is_finite() && right.is_finite(),
            "{formula}: {said} {right}"
        );
        worst = worst.max((said - right).abs() / unit);
        spread = (spread.0.min(right), spread.1.max(right));
        count += 1;
    }
    println!("| {formula} | {count} | {worst:.1e} |");
    assert!(worst <= most, "{formula}: {worst:e} is more than {most:e}");
    assert!(
        count > 0 && (spread.0 < spread.1 || count == 1),
        "{formula}: all cases are alike"
    );
}

#[test]
fn kratts_density_and_transfer() {
    let mut random = Random(1);
    hold(
        "metaball D(q), Kratt 3.4",
        1e-6,
        (0..100_000).map(|_| {
            let (q, c, r) = (random.point(), random.point(), 0.05 + random.next());
            let ratio = q.as_dvec3().distance_squared(c.as_dvec3()) / f64::from(r).powi(2);
            [ball(q, c, r), (1.0 - ratio).max(0.0).powi(2), 1.0]
        }),
    );
    let centers: Vec<Vec3> = (0..3000).map(|_| random.point()).collect();
    let field = Density::new(&centers, 0.2);
    hold(
        "density d(q), sum over 3,000 leaves",
        1e-6,
        (0..2000).map(|_| {
            let q = random.point();
            let one = |c: &Vec3| {
                let ratio = q.as_dvec3().distance_squared(c.as_dvec3()) / f64::from(0.2f32).powi(2);
                (1.0 - ratio).max(0.0).powi(2)
            };
            let right: f64 = centers.iter().map(one).sum();
            [field.at(q), right, right.max(1.0)]
        }),
    );
    hold(
        "sigma(d)",
        1e-15,
        (0..10_000).map(|_| {
            // A quarter and an eighth are exact: so is the ramp at these.
            let (steps, d) = (1 + (random.next() * 7.0) as i32, 8.0f64);
            [
                transfer(f64::from(steps), d),
                f64::from(8 - steps) / 8.0,
                1.0,
            ]
        }),
    );
}

#[test]
fn kratts_coverage() {
    let mut random = Random(2);
    hold(
        "coverage C(P) of 300 faces, Kratt 3.4",
        1e-5,
        (0..300).map(|_| {
            let card = Card::rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, Vec2::splat(4.0));
            // Three in four near the card: what is covered outweighs what is not.
            let mut corners = || {
                let flat = if random.next() < 0.75 { 0.1 } else { 1.0 };
                let low = random.point() * Vec3::new(1.0, 1.0, flat);
                [low, low + random.point() * flat, low + random.point() * 0.1]
            };
            let all: Vec<[Vec3; 3]> = (0..300).map(|_| corners()).collect();
            let faces: Vec<Face> = all.iter().filter_map(|&c| Face::new(c)).collect();
            let foliage = Foliage {
                faces: &faces,
                connector: Vec3::ZERO,
            };
            let limit = 0.4;
            let said = coverage(&foliage, &[card], limit).covered();
            let signed = |corners: &[Vec3; 3]| {
                let [a, b, c] = corners.map(|p| p.as_dvec3());
                let area = (b - a).cross(c - a).z.abs() / 2.0;
                let near = corners.iter().all(|p| f64::from(p.z).abs() <= limit);
                if near { area } else { -area }
            };
            let right = all.iter().map(signed).sum::<f64>().max(0.0);
            [said, right, right]
        }),
    );
    hold(
        "epsilon, pixels at a distance",
        1e-14,
        (0..1000).map(|_| {
            let (d, lines) = (f64::from(random.next()) * 1e4 + 1e-3, 1080);
            // tan 45 degrees is one: 2 d / lines for a pixel.
            let right = 4.0 * 2.0 * d / f64::from(lines);
            [
                epsilon(d, std::f64::consts::FRAC_PI_2, lines, 4.0),
                right,
                right,
            ]
        }),
    );
}

/// Moments of points on a grid of whole numbers, where sums of 128-bit integers are exact.
#[test]
fn plane_fits() {
    let mut random = Random(3);
    let mut whole = || (f64::from(random.next()) * 2e6 - 1e6).round();
    let cases: Vec<(Vec<[i128; 3]>, DMat3)> = (0..200)
        .map(|_| {
            let points: Vec<Vec3> = (0..500)
                .map(|_| {
                    Vec3::new(whole() as f32, whole() as f32, (whole() / 1000.0) as f32).round()
                })
                .collect();
            let moments = Moments::of_points(points.iter().map(|&p| (p, 1.0)));
            let exact = points.iter().map(|p| p.to_array().map(|v| v as i128));
            (exact.collect(), moments.scatter)
        })
        .collect();
    let entries = cases.iter().flat_map(|(points, scatter)| {
        let n = points.len() as i128;
        (0..3).flat_map(move |i| {
            (0..3).map(move |j| {
                let of = |i: usize, j: usize| {
                    let (sums, products) = points.iter().fold(([0, 0], 0), |(s, p), q| {
                        ([s[0] + q[i], s[1] + q[j]], p + q[i] * q[j])
                    });
                    (n * products - sums[0] * sums[1]) as f64 / n as f64
                };
                let unit = (of(i, i) * of(j, j)).sqrt();
                [scatter.col(j)[i], of(i, j), unit]
            })
        })
    });
    hold("scatter of 500 points (plane fit)", 1e-13, entries);
    // Rotations by whole quaternions: eigenvalues of the turned matrix are known exactly.
    let mut random = Random(4);
    let mut small = || (random.next() * 9.0).floor() as f64 - 4.0;
    let eigenvalues = (0..20_000).flat_map(|_| {
        let [a, b, c, d] = [small(), small(), small(), small() + 0.5].map(|v| v * 2.0);
        let norm = a * a + b * b + c * c + d * d;
        let turn = DMat3::from_cols(
            DVec3::new(
                a * a + b * b - c * c - d * d,
                2.0 * (b * c + a * d),
                2.0 * (b * d - a * c),
            ),
            DVec3::new(
                2.0 * (b * c - a * d),
                a * a - b * b + c * c - d * d,
                2.0 * (c * d + a * b),
            ),
            DVec3::new(
                2.0 * (b * d + a * c),
                2.0 * (c * d - a * b),
                a * a - b * b - c * c + d * d,
            ),
        );
        let mut values = [small().abs(), 10.0 + small(), 1000.0 + small()];
        let matrix = turn * DMat3::from_diagonal(DVec3::from_array(values)) * turn.transpose();
        values.sort_by(f64::total_cmp);
        let (found, _) = symmetric_eigen(&matrix).unwrap();
        let scale = norm * norm;
        [0, 1, 2].map(|i| [found[i], values[i] * scale, values[2] * scale])
    });
    hold(
        "eigenvalues, by the largest",
        1e-13,
        eigenvalues.into_iter(),
    );
}

#[test]
fn dengs_scaled_distance() {
    let mut random = Random(5);
    hold(
        "d (1 + k max(0, v.b) rho), Deng",
        2e-6,
        (0..50_000).map(|_| {
            let (center, branch) = (random.point() * 10.0, random.direction());
            let (eye, density, strength) =
                (random.point() * 100.0, random.next(), 2.0 * random.next());
            let subtree = Subtree {
                center,
                branch,
                density,
                leaves: 1,
                ..Subtree::default()
            };
            let hierarchy = Hierarchy::new(&[subtree]).unwrap();
            let mut estimator = DengDensity { strength };
            let place = Place::at(Vec3::ZERO);
            let said = estimator
                .sight(&hierarchy.nodes()[0], 0, eye, &place)
                .distance;
            let way = center.as_dvec3() - eye.as_dvec3();
            let along = way.normalize().dot(branch.as_dvec3()).max(0.0);
            let right = way.length() * (1.0 + f64::from(strength) * along * f64::from(density));
            [f64::from(said), right, right]
        }),
    );
}

/// The cells along a segment by slabs, in f64: entry, length and solidity, front to back.
fn along(cells: &Cells, from: IVec3, to: IVec3) -> Vec<(f64, f64, f64)> {
    let edge = cells.edge().as_dvec3();
    let middle = |c: IVec3| (c.as_dvec3() + 0.5) * edge;
    let (start, way) = (middle(from), middle(to) - middle(from));
    let mut out = Vec::new();
    for z in 0..cells.count().z {
        for y in 0..cells.count().y {
            for x in 0..cells.count().x {
                let cell = IVec3::new(x, y, z);
                let (mut enter, mut leave) = (0.0f64, 1.0f64);
                for axis in 0..3 {
                    let low = f64::from(cell[axis]) * edge[axis] - start[axis];
                    let ends = [low, low + edge[axis]].map(|e| e / way[axis]);
                    if way[axis] != 0.0 {
                        enter = enter.max(ends[0].min(ends[1]));
                        leave = leave.min(ends[0].max(ends[1]));
                    } else if low > 0.0 || low + edge[axis] < 0.0 {
                        leave = -1.0;
                    }
                }
                let index = cells.index(cell).unwrap();
                if leave - enter > 1e-9 {
                    let length = (leave - enter) * way.length();
                    out.push((enter, length, f64::from(cells.solidity()[index])));
                }
            }
        }
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0));
    out
}

#[test]
fn el_sanas_occlusion() {
    let mut random = Random(6);
    let mut cells = Cells::new(Vec3::ZERO, Vec3::new(9.0, 7.0, 8.0), [9, 7, 8]);
    for i in 0..cells.solidity().len() as i32 {
        let cell = IVec3::new(i % 9, i / 9 % 7, i / 63);
        let solidity = 0.6 * random.next();
        cells.set(cell, solidity);
    }
    for (law, name) in [
        (Law::Equation4, "occlusion probability, El-Sana equation 4"),
        (Law::Beer, "the same by Beer's law"),
    ] {
        let mut pick = || {
            let share = Vec3::new(random.next(), random.next(), random.next());
            (share * Vec3::new(9.0, 7.0, 8.0)).floor().as_ivec3()
        };
        let pairs: Vec<[IVec3; 2]> = (0..3000).map(|_| [pick(), pick()]).collect();
        // Through corners the order of cells is open; equation 4 counts a cell of no length.
        let open = |p: &&[IVec3; 2]| {
            let way = (p[1] - p[0]).abs();
            let odd = |n: i32| n.trailing_zeros();
            let pairs = [(way.x, way.y), (way.y, way.z), (way.x, way.z)];
            way != IVec3::ZERO
                && pairs
                    .iter()
                    .all(|&(a, b)| a == 0 || b == 0 || odd(a) != odd(b))
        };
        let cases = pairs.iter().filter(open).map(|&[from, to]| {
            let mut occlusion = Occlusion::new(&cells, law);
            occlusion.look_from(cells.middle(from));
            let said = occlusion.probability(cells.middle(to));
            let path = along(&cells, from, to);
            let right = match law {
                Law::Equation4 => {
                    let longest = cells.edge().as_dvec3().length();
                    let (mut hidden, mut passing) = (0.0, 1.0);
                    for (_, length, rho) in &path {
                        hidden += rho * passing;
                        passing *= (1.0 - rho) * (-length / longest).exp();
                    }
                    hidden
                }
                Law::Beer => {
                    let before = &path[..path.len() - 1];
                    let passing = before
                        .iter()
                        .map(|(_, length, rho)| (1.0 - rho).powf(*length));
                    1.0 - passing.product::<f64>()
                }
            };
            [f64::from(said), right, 1.0]
        });
        hold(name, 5e-6, cases);
    }
    hold(
        "blend, El-Sana equation 5",
        5e-7,
        (0..10_000).map(|_| {
            let [a, b, p] = [random.next() * 100.0, random.next(), random.next()];
            let [x, y, q] = [a, b, p].map(f64::from);
            let right = (1.0 - q) * x + q * y;
            [f64::from(blend(a, b, p)), right, right]
        }),
    );
}

#[test]
fn lees_priorities() {
    let mut random = Random(7);
    let mut items = || {
        let item = Item {
            center: random.point() * 10.0,
            normal: random.direction(),
            leaves: 1,
        };
        (item, random.point() * 100.0)
    };
    let all: Vec<(Item, Vec3)> = (0..50_000).map(|_| items()).collect();
    let way = |item: &Item, eye: Vec3| item.center.as_dvec3() - eye.as_dvec3();
    hold(
        "priority by distance, Lee III.A",
        1e-6,
        all.iter().map(|&(item, eye)| {
            let right = 1.0 / (1.0 + way(&item, eye).length());
            [f64::from(by_distance(&item, eye)), right, right]
        }),
    );
    hold(
        "priority by normal, Lee III.B",
        2e-6,
        all.iter().map(|&(item, eye)| {
            let right = way(&item, eye)
                .normalize()
                .dot(item.normal.as_dvec3())
                .abs();
            [f64::from(by_normal(&item, eye)), right, 1.0]
        }),
    );
}

#[test]
fn sums_over_many() {
    let mut random = Random(8);
    // Fractions of 2^-24: their sum in whole numbers is exact.
    let fraction: Vec<f32> = (0..10_000_000).map(|_| random.next()).collect();
    let exact: u64 = fraction
        .iter()
        .map(|f| (f64::from(*f) * 16_777_216.0) as u64)
        .sum();
    let sum = Coverage {
        width: 10_000,
        height: 1000,
        fraction,
    };
    let right = exact as f64 / 16_777_216.0;
    hold(
        "covered area, sum of 10^7 f32",
        1e-12,
        std::iter::once([sum.area(), right, right]),
    );
}
