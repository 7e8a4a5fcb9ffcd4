//! The files that a manifest lists, without the rest of it: a large tree's takes a second to read.

use std::cell::Cell;
use std::fmt;
use std::path::Path;

use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, MapAccess, Visitor};

use super::manifest::FORMAT;

/// The files that a manifest of any version lists; `None` where it is none of ours.
pub fn files_of(manifest: &Path) -> Option<Vec<String>> {
    let text = std::fs::read_to_string(manifest).ok()?;
    let listed = Cell::new(None);
    let mut reader = ron::Deserializer::from_str(&text).ok()?;
    // What comes after the list is not read, which is an error of its own.
    let _ = reader.deserialize_struct("Manifest", &["format", "files"], Head(&listed));
    // A name is a file in this folder, never a path out of it.
    let plain = |n: &String| !n.contains(['/', '\\']) && n != "..";
    let files: Vec<String> = listed.take()?;
    Some(files.into_iter().filter(plain).collect())
}

/// Where the list goes once it is found beside our format.
struct Head<'a>(&'a Cell<Option<Vec<String>>>);

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum Field {
    Format,
    Files,
    #[serde(other)]
    Other,
}

impl<'de> Visitor<'de> for Head<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a manifest")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let (mut ours, mut files) = (false, None);
        while let Some(field) = map.next_key()? {
            match field {
                Field::Format => ours = map.next_value::<String>()? == FORMAT,
                Field::Files => files = Some(map.next_value()?),
                Field::Other => drop(map.next_value::<IgnoredAny>()?),
            }
            if ours && files.is_some() {
                self.0.set(files);
                break;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<Vec<String>> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("oak.pleach.ron");
        std::fs::write(&file, text).unwrap();
        files_of(&file)
    }

    #[test]
    fn the_list_is_found_in_any_version_of_ours_and_nowhere_else() {
        let found = Some(vec!["oak.glb".into(), "oak.pleach.ron".into()]);
        let head =
            r#"format: "pleach", version: 99, provenance: (input: "oak.glb", references: []),"#;
        let files = r#"files: ["oak.glb", "../other", "..", "oak.pleach.ron"],"#;
        assert_eq!(read(&format!("({head} {files} later: [1, 2],)")), found);
        assert_eq!(read(&format!("({files} later: Some(1.0), {head})")), found);
        // The rest is not looked at.
        assert_eq!(read(&format!("({head} {files} later: [1,")), found);
        assert_eq!(read(&format!("({head})")), None);
        assert_eq!(read(&format!("(format: \"other\", {files})")), None);
        assert_eq!(read("not RON"), None);
        assert_eq!(read(""), None);
        assert_eq!(files_of(Path::new("no/such.pleach.ron")), None);
    }
}
