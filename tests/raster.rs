//! The raster against cases worked out by hand, and against its own laws.

use glam::{Vec2, Vec3};
use pleach::space::raster::{
    Camera, EMPTY, Geometry, Light, Material, Mips, Sampling, Scene, Texture, Wrap, coverage,
    coverage_multisampled, coverage_with_stats, draw,
};

/// Owned triangles to borrow a [`Geometry`] from.
#[derive(Default)]
struct Shape {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A rectangle in the plane z, seen from +z, with texture coordinates 0..1 (v down).
    fn rectangle(mut self, low: Vec2, high: Vec2, z: f32) -> Self {
        let at = self.positions.len() as u32;
        for (x, y, u, v) in [
            (low.x, low.y, 0.0, 1.0),
            (high.x, low.y, 1.0, 1.0),
            (high.x, high.y, 1.0, 0.0),
            (low.x, high.y, 0.0, 0.0),
        ] {
            self.positions.push(Vec3::new(x, y, z));
            self.normals.push(Vec3::Z);
            self.uvs.push(Vec2::new(u, v));
        }
        self.triangles.push([at, at + 1, at + 2]);
        self.triangles.push([at, at + 2, at + 3]);
        self
    }

    fn geometry(&self) -> Geometry<'_> {
        Geometry {
            positions: &self.positions,
            normals: &self.normals,
            uvs: [&self.uvs[..], &[]],
            colors: &[],
            triangles: &self.triangles,
            triangle_material: &[],
        }
    }
}

/// Eight by eight pixels, one pixel a unit, the origin in the middle, seen from +z.
fn camera() -> Camera {
    Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 1.0, 8, 8)
}

fn scene<'a>(shape: &'a Shape, materials: &'a [Material], textures: &'a [Texture]) -> Scene<'a> {
    Scene {
        geometry: shape.geometry(),
        materials,
        textures,
    }
}

fn opaque() -> [Material; 1] {
    [Material::default()]
}

fn cut() -> [Material; 1] {
    [Material {
        texture: Some(0),
        cutoff: Some(0.5),
        wrap: [Wrap::Clamp; 2],
        ..Material::default()
    }]
}

const GRID4: Sampling = Sampling {
    side: 4,
    mips: Mips::Base,
};

#[test]
fn a_square_shifted_by_half_a_pixel_covers_halves_and_quarters() {
    let shape = Shape::default().rectangle(Vec2::new(-1.5, -1.5), Vec2::new(0.5, 0.5), 0.0);
    let cover = coverage(&scene(&shape, &opaque(), &[]), &camera(), GRID4).coverage();
    // Columns 2, 3, 4 (x from -2 to 1) and rows 3, 4, 5 (y from 1 down to -2).
    let row = |y: usize| cover.fraction[y * 8..y * 8 + 8].to_vec();
    assert_eq!(row(2), [0.0; 8]);
    assert_eq!(row(3), [0.0, 0.0, 0.25, 0.5, 0.25, 0.0, 0.0, 0.0]);
    assert_eq!(row(4), [0.0, 0.0, 0.5, 1.0, 0.5, 0.0, 0.0, 0.0]);
    assert_eq!(row(5), row(3));
    assert_eq!(row(6), [0.0; 8]);
    assert_eq!(cover.area(), 4.0);
}

#[test]
fn orthographic_scale_is_pixels_per_unit_and_placement_is_a_similarity() {
    let shape = Shape::default().rectangle(Vec2::new(-0.5, -0.5), Vec2::new(0.5, 0.5), 0.0);
    let mut at = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 20.0, 64, 64);
    let area = |c: &Camera| coverage(&scene(&shape, &opaque(), &[]), c, GRID4).area();
    assert_eq!(area(&at), 400.0);
    at.placement.scale = 2.0;
    at.placement.offset = Vec3::new(0.5, 0.25, 3.0);
    assert_eq!(area(&at), 1600.0);
    let mask = coverage(&scene(&shape, &opaque(), &[]), &at, Sampling::CLIENT);
    // x from -0.5 to 1.5 units: pixels 32 - 10 .. 32 + 30; y from 1.25 down: row 32 - 25.
    let first = mask.samples.iter().position(|&s| s == 1).unwrap();
    assert_eq!((first % 64, first / 64), (22, 7));
}

#[test]
fn a_perspective_camera_halves_what_is_twice_as_far() {
    let fov = 2.0 * (0.5f32).atan(); // 64 pixels are as high as the distance: 32 a unit at 2
    let area = |distance: f32| {
        let shape = Shape::default().rectangle(Vec2::splat(-0.5), Vec2::splat(0.5), 0.0);
        let eye = Vec3::new(0.0, 0.0, distance);
        let camera = Camera::perspective(eye, Vec3::ZERO, Vec3::Y, fov, 64, 64);
        coverage(&scene(&shape, &opaque(), &[]), &camera, GRID4).area()
    };
    assert_eq!(area(2.0), 32.0 * 32.0);
    assert_eq!(area(4.0), 16.0 * 16.0);
}

#[test]
fn a_perspective_texture_is_not_bent_along_the_diagonal() {
    // A floor that runs away from the eye; its texture is opaque in the far half of v only.
    let shape = Shape {
        positions: [
            [-9.0, 0.0, 0.0],
            [9.0, 0.0, 0.0],
            [9.0, 0.0, -8.0],
            [-9.0, 0.0, -8.0],
        ]
        .map(Vec3::from)
        .to_vec(),
        normals: vec![Vec3::Y; 4],
        uvs: [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]
            .map(Vec2::from)
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let texture = [Texture::from_alpha(1, 2, vec![255, 0])];
    let camera = Camera::perspective(
        Vec3::new(0.0, 1.0, 2.0),
        Vec3::new(0.0, 1.0, -1.0),
        Vec3::Y,
        std::f32::consts::FRAC_PI_2,
        64,
        64,
    );
    let mask = coverage(
        &scene(&shape, &cut(), &texture),
        &camera,
        Sampling {
            side: 1,
            mips: Mips::Base,
        },
    );
    // z = -4 is 6 away and 1 below: 32 / 6 = 5.33 pixels under the middle; the far end 32 / 10 = 3.2.
    for x in 0..64 {
        let column: Vec<usize> = (0..64).filter(|y| mask.samples[y * 64 + x] == 1).collect();
        if x > 8 && x < 56 {
            assert_eq!(column, [35, 36], "column {x}");
        }
    }
}

#[test]
fn a_checkerboard_of_alpha_covers_half() {
    let shape = Shape::default().rectangle(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    let alpha = (0..64)
        .map(|i| if (i % 8 + i / 8) % 2 == 0 { 255 } else { 0 })
        .collect();
    let texture = [Texture::from_alpha(8, 8, alpha)];
    let nearest = [Material {
        linear: false,
        ..cut()[0]
    }];
    let cover = coverage(&scene(&shape, &nearest, &texture), &camera(), GRID4).coverage();
    for (i, &c) in cover.fraction.iter().enumerate() {
        assert_eq!(
            c,
            if (i % 8 + i / 8) % 2 == 0 { 1.0 } else { 0.0 },
            "pixel {i}"
        );
    }
}

#[test]
fn the_mip_follows_texels_per_sample() {
    // 32 texels over 8 pixels are 4 a pixel: level 2. Only the alpha of level 2 is 0.5 or more.
    let stripes: Vec<u8> = (0..32 * 32)
        .map(|i| if i % 8 < 4 { 255 } else { 0 })
        .collect();
    let texture = [Texture::from_alpha(32, 32, stripes)];
    let shape = Shape::default().rectangle(Vec2::splat(-4.0), Vec2::splat(4.0), 0.0);
    let area = |mips, side| {
        let sampling = Sampling { side, mips };
        coverage(&scene(&shape, &cut(), &texture), &camera(), sampling).area()
    };
    assert_eq!(
        area(Mips::Linear, 1),
        32.0,
        "level 2: columns in turn 255 and 0"
    );
    assert_eq!(area(Mips::Nearest, 1), 32.0);
    // At half the size, level 3 is grey everywhere: 128 of 255 passes a cutoff of one half.
    let small = Shape::default().rectangle(Vec2::splat(-2.0), Vec2::splat(2.0), 0.0);
    let sampling = Sampling {
        side: 1,
        mips: Mips::Linear,
    };
    assert_eq!(
        coverage(&scene(&small, &cut(), &texture), &camera(), sampling).area(),
        16.0
    );
    let strict = [Material {
        cutoff: Some(0.51),
        ..cut()[0]
    }];
    assert_eq!(
        coverage(&scene(&small, &strict, &texture), &camera(), sampling).area(),
        0.0
    );
}

#[test]
fn mips_average_light_and_plain_alpha() {
    let rgba = [
        0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 0,
    ];
    let texture = Texture::from_rgba(2, 2, &rgba);
    assert_eq!(texture.level_count(), 2);
    assert_eq!(texture.alpha_level(1), (1, 1, &[128u8][..]));
    // Half of the light is sRGB 188, not 128.
    let shape = Shape::default().rectangle(Vec2::splat(-0.5), Vec2::splat(0.5), 0.0);
    let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 1.0, 1, 1);
    let textures = [texture];
    let material = [Material {
        cutoff: None,
        ..cut()[0]
    }];
    let scene = scene(&shape, &material, &textures);
    let picture = draw(&scene, &camera, Sampling::CLIENT).shade(
        &scene,
        &camera,
        Sampling::CLIENT,
        Light::Unlit,
    );
    assert_eq!(picture.over([0; 3])[..3], [188, 188, 188]);
}

#[test]
fn odd_sizes_lose_no_texel_in_their_mips() {
    let texture = Texture::from_alpha(5, 3, vec![90; 15]);
    let sizes: Vec<_> = (0..texture.level_count())
        .map(|l| texture.alpha_level(l))
        .collect();
    assert_eq!(
        sizes,
        [(5, 3, &[90u8; 15][..]), (2, 1, &[90; 2]), (1, 1, &[90])]
    );
}

#[test]
fn new_alpha_remakes_the_mips() {
    let mut texture = Texture::from_alpha(8, 8, vec![0; 64]);
    texture.set_alpha(&[200; 64]);
    assert_eq!(texture.alpha_level(3), (1, 1, &[200u8][..]));
}

#[test]
fn back_faces_are_drawn_only_if_double_sided() {
    let mut shape = Shape::default().rectangle(Vec2::splat(-1.0), Vec2::splat(1.0), 0.0);
    shape.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert_eq!(
        coverage(&scene(&shape, &opaque(), &[]), &camera(), GRID4).area(),
        0.0
    );
    let both = [Material {
        double_sided: true,
        ..opaque()[0]
    }];
    let scene = scene(&shape, &both, &[]);
    assert_eq!(coverage(&scene, &camera(), GRID4).area(), 4.0);
    // The normal of a back face is turned towards the eye.
    let picture = draw(&scene, &camera(), GRID4).shade(&scene, &camera(), GRID4, Light::Unlit);
    assert!(picture.normal.contains(&Vec3::NEG_Z));
}

#[test]
fn a_card_edge_on_to_the_eye_covers_nothing_and_next_to_that_next_to_nothing() {
    let both = [Material {
        double_sided: true,
        ..opaque()[0]
    }];
    let shape = Shape::default().rectangle(Vec2::splat(-3.0), Vec2::splat(3.0), 0.0);
    let scene = scene(&shape, &both, &[]);
    for tilt in [0.0, 1e-7, 1e-3, 0.1] {
        let tilt: f32 = tilt;
        let forward = Vec3::new(-tilt.cos(), 0.0, -tilt.sin());
        // Beside the grid of samples, so that what is narrower than their distance falls between them.
        let target = Vec3::new(0.0, 0.0, 0.01);
        let orthographic = Camera::orthographic(forward, Vec3::Y, target, 1.0, 8, 8);
        let eye = -forward * 9.0;
        let perspective = Camera::perspective(eye, Vec3::ZERO, Vec3::Y, 1.0, 8, 8);
        for camera in [orthographic, perspective] {
            let area = coverage(&scene, &camera, GRID4).area();
            let picture = draw(&scene, &camera, GRID4).shade(&scene, &camera, GRID4, Light::Unlit);
            assert!(picture.normal.iter().all(|n| n.is_finite()), "{tilt}");
            // Six times six units, turned away; one column of samples is a quarter of eight pixels.
            let most = 36.0 * f64::from(tilt.sin()) + 2.0;
            assert!(area <= most, "{tilt}: {area}");
            assert!(tilt > 0.0 || area == 0.0, "{area}");
            // A tenth of a radian shows six times .6 units: it is not merely left out.
            assert!(tilt < 0.1 || area > 1.0, "{area}");
        }
    }
}

/// A closed ball of triangles of very different sizes, turned so that no edge is straight.
fn ball(rings: u32, sectors: u32) -> Shape {
    let mut shape = Shape::default();
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, 0.2);
    let at = |ring: u32, sector: u32| ring * sectors + sector % sectors;
    for ring in 0..=rings {
        let (sin, cos) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
        for sector in 0..sectors {
            let (s, c) = (std::f32::consts::TAU * sector as f32 / sectors as f32).sin_cos();
            let p = turn * Vec3::new(sin * c, cos, sin * s);
            shape.positions.push(p);
            shape.normals.push(p);
            shape.uvs.push(Vec2::ZERO);
        }
    }
    for ring in 0..rings {
        for sector in 0..sectors {
            let (a, b) = (at(ring, sector), at(ring, sector + 1));
            let (c, d) = (at(ring + 1, sector), at(ring + 1, sector + 1));
            shape.triangles.push([a, b, c]);
            shape.triangles.push([b, d, c]);
        }
    }
    shape
}

#[test]
fn a_closed_mesh_has_no_hole_and_no_double_hit() {
    for (rings, sectors, pixels) in [(6, 9, 90.0), (40, 60, 77.0), (200, 333, 60.0)] {
        let shape = ball(rings, sectors);
        let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, pixels, 256, 256);
        let sampling = Sampling::CLIENT;
        let (mask, stats) = coverage_with_stats(&scene(&shape, &opaque(), &[]), &camera, sampling);
        // Front faces of a convex body hit every sample of its outline exactly once.
        assert_eq!(stats.fragments, stats.covered, "{rings} x {sectors}");
        for row in mask.samples.chunks(256) {
            let hits = row.iter().filter(|&&s| s == 1).count();
            let first = row.iter().position(|&s| s == 1).unwrap_or(0);
            assert!(
                row[first..first + hits].iter().all(|&s| s == 1),
                "{rings} x {sectors}"
            );
        }
    }
}

#[test]
fn large_and_small_triangles_follow_the_same_rule() {
    // A long row is solved, a short one stepped: cutting a square into strips changes nothing.
    let (low, high) = (Vec2::new(-3.37, -2.9), Vec2::new(3.61, 3.3));
    let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 9.7, 80, 80);
    let whole = Shape::default().rectangle(low, high, 0.0);
    let mut strips = Shape::default();
    for i in 0..37 {
        let x = |i: i32| low.x + (high.x - low.x) * i as f32 / 37.0;
        strips = strips.rectangle(Vec2::new(x(i), low.y), Vec2::new(x(i + 1), high.y), 0.0);
    }
    let mask = |shape: &Shape| coverage(&scene(shape, &opaque(), &[]), &camera, GRID4);
    assert_eq!(mask(&whole).samples, mask(&strips).samples);
}

#[test]
fn a_shifted_camera_equals_shifted_samples() {
    let shape = ball(20, 31);
    let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 20.0, 64, 64);
    let material = opaque();
    let scene = scene(&shape, &material, &[]);
    let moved = coverage(&scene, &camera.shifted(0.5, 0.0), GRID4).coverage();
    assert_eq!(
        moved,
        coverage(&scene, &camera, GRID4).coverage_shifted(2, 0)
    );
    let moved = coverage(&scene, &camera.shifted(0.0, 0.5), GRID4).coverage();
    assert_eq!(
        moved,
        coverage(&scene, &camera, GRID4).coverage_shifted(0, 2)
    );
}

#[test]
fn the_nearest_triangle_is_seen_and_holes_let_through() {
    let shape = Shape::default()
        .rectangle(Vec2::splat(-2.0), Vec2::splat(2.0), 0.0)
        .rectangle(Vec2::splat(-1.0), Vec2::splat(1.0), 1.0);
    let material = opaque();
    let scene1 = scene(&shape, &material, &[]);
    let items = draw(&scene1, &camera(), Sampling::CLIENT);
    let count = |ids: [u32; 2]| items.triangle.iter().filter(|t| ids.contains(t)).count();
    assert_eq!(
        (count([0, 1]), count([2, 3]), count([EMPTY; 2])),
        (12, 4, 48)
    );
    assert_eq!(items.near[3 * 8 + 3], 1.0);
    assert_eq!(items.mask(), coverage(&scene1, &camera(), Sampling::CLIENT));
    let texture = [Texture::from_alpha(1, 1, vec![100])];
    let items = draw(
        &scene(&shape, &cut(), &texture),
        &camera(),
        Sampling::CLIENT,
    );
    assert!(items.triangle.iter().all(|&t| t == EMPTY));
}

#[test]
fn triangles_behind_or_far_outside_are_left_out() {
    let mut shape = Shape::default().rectangle(Vec2::splat(-1.0), Vec2::splat(1.0), 5.0);
    shape.positions[1] = Vec3::splat(1e30); // only the first triangle uses it
    let eye = Vec3::new(0.0, 0.0, 2.0);
    let behind = Camera::perspective(eye, Vec3::ZERO, Vec3::Y, 1.0, 16, 16);
    assert_eq!(
        coverage(&scene(&shape, &opaque(), &[]), &behind, GRID4).area(),
        0.0
    );
    // Half of four pixels, less half of the eight samples on the diagonal: they belonged to the other half.
    assert_eq!(
        coverage(&scene(&shape, &opaque(), &[]), &camera(), GRID4).area(),
        1.75
    );
}

#[test]
fn multisampling_smooths_edges_and_tests_alpha_once_a_pixel() {
    let shape = Shape::default().rectangle(Vec2::new(-2.0, -2.0), Vec2::new(0.5, 2.0), 0.0);
    let cover = coverage_multisampled(&scene(&shape, &opaque(), &[]), &camera());
    // Two of the four samples lie in the left half of the pixel at the edge.
    assert_eq!(
        cover.fraction[24..32],
        [0.0, 0.0, 1.0, 1.0, 0.5, 0.0, 0.0, 0.0]
    );
    // Alpha that ends at the middle of a pixel keeps or drops all of its samples.
    let texture = [Texture::from_alpha(
        8,
        1,
        vec![255, 255, 255, 255, 0, 0, 0, 0],
    )];
    let shape = Shape::default().rectangle(Vec2::splat(-4.25), Vec2::splat(3.75), 0.0);
    let cover = coverage_multisampled(&scene(&shape, &cut(), &texture), &camera());
    assert_eq!(
        cover.fraction[24..32],
        [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]
    );
}

#[test]
#[ignore = "prints a rate; run with --ignored --nocapture"]
fn tiny_triangles_a_second() {
    let shape = ball(500, 1000);
    let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 100.0, 256, 256);
    let texture = [Texture::from_alpha(256, 256, vec![255; 65536])];
    for (name, materials) in [("opaque", opaque()), ("alpha", cut())] {
        let both = [Material {
            double_sided: true,
            ..materials[0]
        }];
        let scene = scene(&shape, &both, &texture);
        for sampling in [Sampling::REFERENCE, Sampling::CLIENT] {
            let start = std::time::Instant::now();
            for _ in 0..5 {
                std::hint::black_box(coverage(&scene, &camera, sampling).area());
            }
            let rate = 5.0 * shape.triangles.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
            let start = std::time::Instant::now();
            std::hint::black_box(draw(&scene, &camera, sampling));
            let full = shape.triangles.len() as f64 / start.elapsed().as_secs_f64() / 1e6;
            println!("{name} {sampling:?}: coverage {rate:.1} M/s, depth {full:.1} M/s");
        }
    }
}
