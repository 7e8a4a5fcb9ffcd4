//! The files of a species' package: levels of all trees, and images that they share.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::botany::model::Image;
use crate::error::{Error, Result};
use crate::export::combined::{Packed, Stand, write_species};
use crate::export::gltf::write_linked;
use crate::export::manifest::SUFFIX;
use crate::export::maps::first_of_page;
use crate::export::package::Package;
use crate::export::png::encode_png;
use crate::export::shipped::{Role, roles, to_dds};
use crate::levels::Levels;
use crate::prepared::Prepared;
use crate::report::species::SpeciesReport;
use crate::scene::{Mips, Scene};
use crate::space::sha256::sha256;

/// What was written so far.
pub struct Files<'a> {
    package: &'a Package,
    species: &'a str,
    scene: &'a Scene,
    /// Names in the order in which they were written.
    pub names: Vec<String>,
    /// The file of each image, by its SHA-256.
    images: BTreeMap<String, String>,
    /// How many of them are of no page.
    plain: usize,
    /// Images of each level, by its name.
    uris: BTreeMap<String, Vec<String>>,
}

/// The name of a tree's manifest.
pub fn manifest_of(tree: &str) -> String {
    tree.to_owned() + SUFFIX
}

/// The report as text.
///
/// # Errors
/// [`Error::Internal`].
pub fn to_json(report: &SpeciesReport) -> Result<String> {
    serde_json::to_string_pretty(report).map_err(|error| Error::Internal {
        step: "report",
        what: error.to_string(),
    })
}

impl<'a> Files<'a> {
    /// None yet.
    pub fn new(package: &'a Package, species: &'a str, scene: &'a Scene) -> Self {
        Self {
            package,
            species,
            scene,
            names: Vec::new(),
            images: BTreeMap::new(),
            plain: 0,
            uris: BTreeMap::new(),
        }
    }

    fn put(&mut self, name: String, bytes: &[u8]) -> Result<()> {
        self.package.write(&name, bytes)?;
        self.names.push(name);
        Ok(())
    }

    /// Writes the contact sheet of a page.
    pub fn sheet(&mut self, page: usize, png: &[u8]) -> Result<()> {
        self.put(format!("{}_page{page}_sharing.png", self.species), png)
    }

    /// Writes images of levels, each content once, and drops their pixels: all levels wait for the last one.
    /// `page` is the number of the page whose images come last, if they share one.
    pub fn images(&mut self, page: Option<usize>, mut levels: Vec<&mut Packed>) -> Result<()> {
        // Those of a page are the same pixels in all levels: encoded once.
        let mut known: Vec<(Image, String)> = Vec::new();
        levels.retain(|level| level.shown);
        for level in &mut levels {
            let roles = roles(&level.scene);
            let first = first_of_page(&level.scene.images);
            let mut uris = Vec::with_capacity(level.scene.images.len());
            for (i, image) in level.scene.images.iter().enumerate() {
                let same = |(other, _): &&(Image, String)| Arc::ptr_eq(&other.rgba, &image.rgba);
                let uri = match known.iter().find(same) {
                    Some((_, uri)) => uri.clone(),
                    None => {
                        let of_page = page.filter(|_| first.is_some_and(|first| i >= first));
                        let uri = self.image(of_page, image, roles[i])?;
                        known.push((image.clone(), uri.clone()));
                        uri
                    }
                };
                uris.push(uri);
            }
            self.uris.insert(level.name.clone(), uris);
        }
        for level in levels {
            for image in &mut level.scene.images {
                image.rgba = Arc::default();
            }
        }
        Ok(())
    }

    /// The file of an image, written if no other holds the same.
    fn image(&mut self, page: Option<usize>, image: &Image, role: Role) -> Result<String> {
        let png = encode_png(image)?;
        let digest = sha256(&png);
        if let Some(uri) = self.images.get(&digest) {
            return Ok(uri.clone());
        }
        let uri = match page {
            Some(page) => format!("{}_page{page}_{}.png", self.species, image.name),
            None => {
                self.plain += 1;
                format!("{}_image{}.png", self.species, self.plain)
            }
        };
        self.put(uri.clone(), &png)?;
        if self.scene.mips == Mips::Shipped {
            let file = uri.trim_end_matches("png").to_owned() + "dds";
            self.put(file, &to_dds(image, role, self.scene.texture_format)?)?;
        }
        self.images.insert(digest, uri.clone());
        Ok(uri)
    }

    /// Writes every level that is shown alone, and all of them in one file with a scene for each tree.
    pub fn write(&mut self, trees: &[Prepared], levels: &[Levels]) -> Result<()> {
        let mut stands = Vec::with_capacity(trees.len());
        for (tree, levels) in trees.iter().zip(levels) {
            let frame = &tree.tree.model.frame;
            let uris: Vec<Vec<String>> = levels
                .packed
                .iter()
                .map(|l| self.uris.get(&l.name).cloned().unwrap_or_default())
                .collect();
            let shown = levels.packed.iter().zip(&uris).filter(|(l, _)| l.shown);
            for (level, uris) in shown {
                let bytes = write_linked(&level.name, &level.scene, uris, frame, &level.extras)?;
                self.put(format!("{}.glb", level.name), &bytes)?;
            }
            stands.push(Stand {
                name: &tree.tree.model.name,
                frame,
                levels: &levels.packed,
                uris,
            });
        }
        self.put(format!("{}.glb", self.species), &write_species(&stands)?)
    }
}
