//! A small tree for the bakers' tests.

use pleach::botany::Model;
use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;

/// A palm of 200 leaves.
pub fn palm() -> Model {
    let options = Options {
        leaves: Some(200),
        ..Options::default()
    };
    let species = Species::named("palm").expect("a built-in species");
    let grown = grow(&species, &options).expect("a palm");
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("palm.glb");
    std::fs::write(&file, grown.glb).expect("a written file");
    load(&file).expect("a loaded palm")
}
