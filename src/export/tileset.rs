//! The hierarchy as 3D Tiles 1.1 (OGC 22-025r4): engines that read it refine by themselves.
//!
//! A client refines a tile where its geometric error, projected on the screen, exceeds a number of
//! pixels; the loaders' defaults are [`CLIENT_PX`]. A tile is to take over at its switch distance, so
//! its error is stated as what is that many pixels there. The error of the whole tileset says from
//! where nothing is drawn at all.

use serde_json::{Value, json};

use super::gltf::reference;
use super::manifest_tiles::Tile;

/// Pixels of error that Cesium and 3d-tiles-renderer allow by default.
pub const CLIENT_PX: f64 = 16.0;

/// Where a tree has no distance at which it vanishes: farther than any scene.
const NEVER: f64 = 1e12;

/// The tileset of tiles for a camera of so many pixels of focal length; nothing is drawn from
/// `vanish_m` on.
pub fn tileset(tiles: &[Tile], focal_px: f64, vanish_m: f64) -> Value {
    let vanish = (CLIENT_PX * vanish_m / focal_px).min(NEVER);
    let vanish = vanish.max(error(&tiles[0], focal_px));
    // Not all clients look at the tileset's own error: a tile without content says it again.
    let mut root = json!({
        "boundingVolume": volume(&tiles[0]),
        "geometricError": vanish,
        "refine": "REPLACE",
    });
    root["children"] = json!([tile(tiles, focal_px, 0)]);
    json!({
        "asset": { "version": "1.1", "generator": concat!("pleach ", env!("CARGO_PKG_VERSION")) },
        "geometricError": vanish,
        "root": root,
    })
}

/// Geometric error of a tile's billboards; as its switch distance it is no smaller than that of its
/// parts, and nothing where it has none.
fn error(tile: &Tile, focal_px: f64) -> f64 {
    CLIENT_PX * f64::from(tile.switch_distance_m) / focal_px
}

fn tile(tiles: &[Tile], focal_px: f64, index: u32) -> Value {
    let tile_at = &tiles[index as usize];
    let children = tile_at.children.iter();
    let mut below: Vec<Value> = children.map(|&c| tile(tiles, focal_px, c)).collect();
    let volume = volume(tile_at);
    let content = |file: &str| json!({ "uri": reference(file) });
    let mut out = json!({ "boundingVolume": volume, "geometricError": error(tile_at, focal_px) });
    match (&tile_at.billboards, &tile_at.geometry) {
        (Some(billboards), geometry) => {
            out["content"] = content(&billboards.file);
            below.extend(geometry.iter().map(|g| {
                json!({
                    "boundingVolume": volume,
                    "geometricError": 0.0,
                    "content": content(&g.file),
                })
            }));
        }
        (None, Some(geometry)) => out["content"] = content(&geometry.file),
        (None, None) => {}
    }
    if !below.is_empty() {
        out["children"] = json!(below);
    }
    out
}

/// Volumes are z-up, contents stay y-up.
fn volume(tile: &Tile) -> Value {
    let [x, y, z] = tile.center;
    json!({ "sphere": [x, -z, y, tile.radius_m] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::manifest_tiles::{Billboards, Geometry};

    fn tip(parent: u32, switch_distance_m: f32) -> Tile {
        Tile {
            parent: Some(parent),
            center: [1.0, 2.0, 3.0],
            radius_m: 0.5,
            billboards: (switch_distance_m > 0.0).then(|| Billboards {
                file: "far.glb".into(),
                ..Billboards::default()
            }),
            geometry: Some(Geometry {
                file: "near.glb".into(),
                ..Geometry::default()
            }),
            switch_distance_m,
            ..Tile::default()
        }
    }

    #[test]
    fn a_client_refines_where_a_billboard_is_a_pixel_off() {
        let whole = Tile {
            children: vec![1, 2],
            radius_m: 2.0,
            switch_distance_m: 20.0,
            billboards: Some(Billboards {
                file: "whole.glb".into(),
                ..Billboards::default()
            }),
            ..Tile::default()
        };
        let tiles = [whole, tip(0, 4.0), tip(0, 20.0)];
        let set = tileset(&tiles, 1000.0, 500.0);
        // 16 px x 20 m / 1000 px; at 20 m that is 16 px on the screen.
        let whole = &set["root"]["children"][0];
        assert_eq!(whole["geometricError"], 16.0 * 20.0 / 1000.0);
        // From 500 m on nothing is drawn: the root without content says so as well.
        assert_eq!(
            (&set["geometricError"], &set["root"]["geometricError"]),
            (&json!(8.0), &json!(8.0))
        );
        assert_eq!(
            (&set["root"]["refine"], set["root"].get("content")),
            (&json!("REPLACE"), None)
        );
        let children = whole["children"].as_array().unwrap();
        assert_eq!(children[0]["geometricError"], 16.0 * 4.0 / 1000.0);
        assert_eq!(
            children[0]["boundingVolume"]["sphere"],
            json!([1.0, -3.0, 2.0, 0.5])
        );
        let near = &children[0]["children"][0];
        assert_eq!(
            (&near["geometricError"], &near["content"]["uri"]),
            (&json!(0.0), &json!("near.glb"))
        );
    }

    #[test]
    fn a_tip_without_billboards_is_geometry_at_once() {
        let whole = Tile {
            children: vec![1],
            billboards: Some(Billboards::default()),
            switch_distance_m: 10.0,
            ..Tile::default()
        };
        let set = tileset(&[whole, tip(0, 0.0)], 1000.0, f64::INFINITY);
        let child = &set["root"]["children"][0]["children"][0];
        assert_eq!(
            (&child["geometricError"], &child["content"]["uri"]),
            (&json!(0.0), &json!("near.glb"))
        );
        assert!(child.get("children").is_none());
        assert_eq!(set["geometricError"], NEVER);
    }
}
