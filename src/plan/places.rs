//! Where the trees of a plan stand.

use std::path::Path;

use glam::{DMat3, DMat4, Mat3, Vec3};

use crate::botany::load::{self, Limits};
use crate::error::{Error, Result};

/// A tree's foot and its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Metres.
    pub foot: Vec3,
    /// Uniform.
    pub scale: f32,
    /// From the scene's directions to the tree's own; `None`: it may be turned any way around its trunk.
    pub turn: Option<Mat3>,
}

/// Reads a file of places: text, or a .glb or .gltf whose mesh nodes and instances are trees.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] with the line; those of loading.
pub fn read(file: &Path) -> Result<Vec<Spot>> {
    let ending = file.extension().unwrap_or_default().to_ascii_lowercase();
    if ending == "glb" || ending == "gltf" {
        return of_meshes(load::places(file, &Limits::default())?, file);
    }
    let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, "read", e))?;
    parse(&text, file)
}

/// A tree for each place; wood and leaves that are meshes of their own at one place are one tree.
fn of_meshes(transforms: Vec<DMat4>, file: &Path) -> Result<Vec<Spot>> {
    let mut out: Vec<Spot> = Vec::with_capacity(transforms.len());
    let mut known = std::collections::BTreeSet::new();
    for (index, transform) in transforms.into_iter().enumerate() {
        let foot = transform.w_axis.truncate().as_vec3();
        // Scales that differ from axis to axis count as the uniform one of the same volume.
        let scale = transform.determinant().abs().cbrt() as f32;
        if !(foot.is_finite() && scale > 0.0 && scale.is_finite()) {
            return Err(Error::input(
                file,
                format!("mesh node {index}"),
                format!("a tree can't stand at {foot} with the scale {scale}"),
                "give the node a transform that can be undone",
            ));
        }
        if known.insert([foot.x, foot.y, foot.z, scale].map(f32::to_bits)) {
            let turn = DMat3::from_mat4(transform).inverse().as_mat3();
            out.push(Spot {
                foot,
                scale,
                turn: turn.is_finite().then_some(turn),
            });
        }
    }
    match out.is_empty() {
        true => Err(Error::input(
            file,
            "the file",
            "no node of its scene has a mesh",
            "place a mesh, of whatever shape, for each tree",
        )),
        false => Ok(out),
    }
}

fn parse(text: &str, file: &Path) -> Result<Vec<Spot>> {
    let mut out = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.trim();
        let head = number == 0 && line.starts_with(|c: char| c.is_ascii_alphabetic());
        if line.is_empty() || line.starts_with('#') || head {
            continue;
        }
        let fault = |what: String| {
            Error::input(
                file,
                format!("line {}", number + 1),
                what,
                "write \"x, y, z\", \"x, y, z, scale\" or \"x, y, z, scale, turn\" in metres and degrees",
            )
        };
        let number = |field: &str| match field.trim().parse::<f32>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(fault(format!("{:?} is not a number", field.trim()))),
        };
        let fields: Vec<f32> = line.split([',', ';']).map(number).collect::<Result<_>>()?;
        let (&[x, y, z], more) = fields
            .split_first_chunk()
            .filter(|(_, more)| more.len() <= 2)
            .ok_or_else(|| fault(format!("{} numbers", fields.len())))?;
        let scale = more.first().copied().unwrap_or(1.0);
        if scale <= 0.0 {
            return Err(fault(format!("a tree can't have the scale {scale}")));
        }
        out.push(Spot {
            foot: Vec3::new(x, y, z),
            scale,
            turn: more
                .get(1)
                .map(|deg| Mat3::from_rotation_y(-deg.to_radians())),
        });
    }
    match out.is_empty() {
        true => Err(Error::input(
            file,
            "the file",
            "there is no place in it",
            "write a line for each tree",
        )),
        false => Ok(out),
    }
}

/// So many trees, evenly strewn over a square around the origin; another `species` gets other
/// places. The R2 sequence (Roberts 2018): each next point falls where there is most room.
pub fn strewn(count: u32, region_m: f64, species: usize) -> Vec<Spot> {
    // One over the plastic number, and one over its square.
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let along = |i: u32, axis: usize| {
        let start = 0.5 + species as f64 * 0.618_033_988_749_895;
        ((start + STEPS[axis] * f64::from(i + 1)).fract() - 0.5) * region_m
    };
    (0..count)
        .map(|i| Spot {
            foot: Vec3::new(along(i, 0) as f32, 0.0, along(i, 1) as f32),
            scale: 1.0,
            turn: None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_faults_named_by_line() {
        let file = Path::new("birch.csv");
        let text = "x,y,z,scale\n1, 2, 3\n\n# west\n-4;0;5.5;0.5\n0,0,0,2,90\n";
        let spots = parse(text, file).unwrap();
        assert_eq!(spots.len(), 3);
        assert!(spots[0].turn.is_none() && spots[1].turn.is_none());
        // Turned by 90 degrees, its own z looks along the scene's x.
        let own = spots[2].turn.unwrap() * Vec3::X;
        assert!(own.abs_diff_eq(Vec3::Z, 1e-6), "{own}");
        assert_eq!(spots[1].foot, Vec3::new(-4.0, 0.0, 5.5));
        assert_eq!((spots[0].scale, spots[1].scale), (1.0, 0.5));
        for (text, place) in [
            ("1,2,3\n1,2", "line 2"),
            ("1,2,3\n1,2,inf", "line 2"),
            ("1,2,3,-1", "line 1"),
            ("1,2,3,1,0,0", "6 numbers"),
            ("1,2,3\nx,y,z", "line 2"),
            ("# nothing", "no place"),
        ] {
            let error = parse(text, file).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(place), "{error}");
        }
    }

    #[test]
    fn strewn_trees_fill_their_region_evenly() {
        let spots = strewn(1600, 100.0, 2);
        let mut cells = [0u32; 16];
        for spot in &spots {
            assert!(spot.foot.x.abs() <= 50.0 && spot.foot.z.abs() <= 50.0);
            let cell = |v: f32| ((v + 50.0) / 25.0).clamp(0.0, 3.0) as usize;
            cells[cell(spot.foot.x) * 4 + cell(spot.foot.z)] += 1;
        }
        assert!(cells.iter().all(|&n| (90..=110).contains(&n)), "{cells:?}");
        assert_ne!(strewn(1, 100.0, 0), strewn(1, 100.0, 1));
    }

    #[test]
    fn nodes_with_a_mesh_are_trees_once_for_each_place() {
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("forest.gltf");
        let write = |nodes: &str, roots: &str| {
            let text = format!(
                r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [{roots}]}}],
                "nodes": [{nodes}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}]}}"#
            );
            std::fs::write(&file, text).unwrap();
        };
        // Leaves and wood of one tree, another below a moved and scaled parent, an empty node.
        write(
            r#"{"mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2]},
            {"mesh": 0, "translation": [1, 2, 3], "scale": [2, 2, 2]},
            {"children": [3], "translation": [10, 0, 0], "scale": [3, 3, 3]},
            {"mesh": 0, "translation": [0, 0, -1]}, {}"#,
            "0, 1, 2, 4",
        );
        let found = read(&file).unwrap();
        let told: Vec<([f32; 3], f32)> = found
            .iter()
            .map(|s| (s.foot.to_array(), (s.scale * 1e4).round() / 1e4))
            .collect();
        assert_eq!(told, [([1.0, 2.0, 3.0], 2.0), ([10.0, 0.0, -3.0], 3.0)]);
        write("{}", "0");
        let error = read(&file).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(
            error
                .to_string()
                .contains("no node of its scene has a mesh"),
            "{error}"
        );
        write(r#"{"mesh": 0, "scale": [0, 1, 1]}"#, "0");
        assert!(read(&file).unwrap_err().to_string().contains("mesh node 0"));
    }
}
