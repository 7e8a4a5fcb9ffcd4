//! The known answer beside a grown tree: its skeleton and the branch that every leaf hangs on.

use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// The skeleton that a tree was grown from. All lengths are metres in the file's world, y up.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrueSkeleton {
    /// Branches; a parent comes before its children.
    pub chains: Vec<TrueChain>,
    /// Leaves, in the order of the file's geometry.
    pub leaves: Vec<TrueLeaf>,
}

/// A branch from its base to its tip.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrueChain {
    /// The chain that carries it; `None` for the trunk.
    pub parent: Option<u32>,
    /// Number of chains between it and the ground: 0 for the trunk.
    pub order: u32,
    /// Centre line, metres. The first point lies on the parent's centre line.
    pub points: Vec<[f32; 3]>,
    /// Radius at each point, metres.
    pub radii: Vec<f32>,
}

/// A leaf: one quad, pair of crossed quads or polygon.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TrueLeaf {
    /// The chain that it hangs on.
    pub chain: u32,
    /// Area-weighted centre of its triangles, metres.
    pub center: [f32; 3],
}

impl TrueSkeleton {
    /// Where the skeleton of `tree.glb` lies: `tree.skeleton.ron`.
    pub fn path_beside(glb: &Path) -> PathBuf {
        glb.with_extension("skeleton.ron")
    }

    /// The skeleton as RON text, one line a chain and one a leaf.
    pub fn to_ron(&self) -> String {
        use std::fmt::Write as _;
        let mut out = String::from("(\n    chains: [\n");
        for chain in &self.chains {
            let TrueChain { parent, order, .. } = chain;
            let points = comma(chain.points.iter().map(point));
            let radii = comma(chain.radii.iter().map(|r| format!("{r}")));
            let _ = writeln!(
                out,
                "        (parent: {parent:?}, order: {order}, points: [{points}], radii: [{radii}]),"
            );
        }
        out.push_str("    ],\n    leaves: [\n");
        for leaf in &self.leaves {
            let center = point(&leaf.center);
            let _ = writeln!(out, "        (chain: {}, center: {center}),", leaf.chain);
        }
        out.push_str("    ],\n)\n");
        out
    }

    /// Reads what [`to_ron`](Self::to_ron) wrote.
    ///
    /// # Errors
    /// Where the text is not such a skeleton, with line and column.
    pub fn from_ron(text: &str) -> std::result::Result<Self, ron::error::SpannedError> {
        ron::from_str(text)
    }

    /// Reads a skeleton file.
    ///
    /// # Errors
    /// Where it can't be opened or is not a skeleton.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, "open", e))?;
        Self::from_ron(&text).map_err(|e| {
            Error::input(
                path,
                format!("line {}, column {}", e.span.end.line, e.span.end.col),
                e.code.to_string(),
                "write the file anew with `pleach grow`",
            )
        })
    }

    /// Writes a skeleton file.
    ///
    /// # Errors
    /// Where the file can't be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        std::fs::write(path, self.to_ron()).map_err(|e| Error::io(path, "write", e))
    }
}

/// RON has no `[f32; 3]`: serde reads it as a tuple.
fn point(p: &[f32; 3]) -> String {
    format!("({}, {}, {})", p[0], p[1], p[2])
}

fn comma(items: impl Iterator<Item = String>) -> String {
    items.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_back() {
        let truth = TrueSkeleton {
            chains: vec![
                TrueChain {
                    parent: None,
                    order: 0,
                    points: vec![[0.0, 0.0, 0.0], [0.1, 3.000_000_2, -1.0e-7]],
                    radii: vec![0.3, 0.1],
                },
                TrueChain {
                    parent: Some(0),
                    order: 1,
                    points: vec![[0.1, 2.0, 0.0]],
                    radii: vec![0.05],
                },
            ],
            leaves: vec![TrueLeaf {
                chain: 1,
                center: [1.0, 2.5, 3.0],
            }],
        };
        assert_eq!(TrueSkeleton::from_ron(&truth.to_ron()).unwrap(), truth);
        // serde's own writer and ours are read alike.
        let serde = ron::to_string(&truth).unwrap();
        assert_eq!(TrueSkeleton::from_ron(&serde).unwrap(), truth);
        assert_eq!(
            TrueSkeleton::path_beside(Path::new("a/oak.glb")),
            Path::new("a/oak.skeleton.ron")
        );
    }
}
