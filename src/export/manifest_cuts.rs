//! What a manifest gives to the run time: hierarchies that cuts are made through, and what was measured.

use glam::Vec3;

use super::manifest::{Manifest, Own, Subtree};
use super::manifest_tiles::{Tile, Tiles};
use crate::error::{Error, Result};
use crate::runtime::{self, Hierarchy, Measured, OwnLeaves};

impl Manifest {
    /// The sub-trees in the form that cuts are made through: they switch at their optimal distances.
    ///
    /// # Errors
    /// [`Error::Internal`]: what [`Manifest::from_ron`] has read has no flaw.
    pub fn hierarchy(&self) -> Result<Hierarchy> {
        let own = |o: &Own| OwnLeaves {
            center: Vec3::from_array(o.center),
            radius: o.radius_m,
            switch_distance: o.optimal_distance_m,
        };
        let subtree = |s: &Subtree| runtime::Subtree {
            parent: s.parent,
            center: Vec3::from_array(s.center),
            radius: s.radius_m,
            leaves: s.leaves,
            switch_distance: s.optimal_distance_m,
            branch: Vec3::from_array(s.branch),
            density: s.density,
            own: s.own.as_ref().map(own),
        };
        let list: Vec<runtime::Subtree> = self.subtrees.iter().map(subtree).collect();
        Hierarchy::new(&list).map_err(|flaw| Error::Internal {
            step: "order sub-trees",
            what: flaw.to_string(),
        })
    }

    /// What was measured of every sub-tree, by its index; `None` where nothing was.
    ///
    /// # Errors
    /// [`Error::Internal`]: what [`Manifest::from_ron`] has read has no flaw.
    pub fn measured(&self) -> Result<Option<Measured>> {
        let Some(visibility) = &self.visibility else {
            return Ok(None);
        };
        let measured = visibility.measured(self.subtrees.len());
        measured.map(Some).map_err(|what| Error::Internal {
            step: "read visibility",
            what,
        })
    }
}

impl Tiles {
    /// The tiles in the form that cuts are made through, with branch directions and densities of
    /// `subtrees`: node `i` of a cut's list stands for the tile in [`Hierarchy::origins`].
    ///
    /// # Errors
    /// [`Error::Internal`]: what [`Manifest::from_ron`] has read has no flaw.
    pub fn hierarchy(&self, manifest: &Manifest) -> Result<Hierarchy> {
        let subtree = |t: &Tile| {
            let of = &manifest.subtrees[t.subtree as usize];
            runtime::Subtree {
                parent: t.parent,
                center: Vec3::from_array(t.center),
                radius: t.radius_m,
                leaves: t.leaves,
                switch_distance: t.switch_distance_m,
                branch: Vec3::from_array(of.branch),
                density: of.density,
                own: None,
            }
        };
        let list: Vec<_> = self.list.iter().map(subtree).collect();
        Hierarchy::new(&list).map_err(|flaw| Error::Internal {
            step: "order tiles",
            what: flaw.to_string(),
        })
    }
}
