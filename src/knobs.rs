//! Reads recipe and scene files: whatever is wrong in them is said with key, line and column.

use std::path::Path;

use serde::de::{DeserializeOwned, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// A knob's range, checked after reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Name of the key.
    pub key: &'static str,
    /// Its value.
    pub value: f64,
    /// Least value that is accepted.
    pub least: f64,
    /// Greatest value that is accepted.
    pub most: f64,
}

impl Range {
    /// Of a key with this value.
    pub fn of(key: &'static str, value: impl Into<f64>, least: f64, most: f64) -> Self {
        Self {
            key,
            value: value.into(),
            least,
            most,
        }
    }
}

/// A set of knobs that can be read from a file.
pub trait Knobs: Serialize + DeserializeOwned {
    /// "recipe" or "scene", for messages.
    const KIND: &'static str;

    /// Every number with its range.
    fn ranges(&self) -> Vec<Range>;
}

/// Reads a RON file; keys that it leaves out keep the value that they have in `base`.
///
/// # Errors
/// [`Error::Io`] where it can't be read; [`Error::Input`] with key, line, column and the nearest
/// valid key where it can't be used.
pub fn read<T: Knobs>(file: &Path, base: &T) -> Result<T> {
    let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, "read", e))?;
    parse(&text, file, base)
}

/// As [`read`], from text; `file` is for messages.
///
/// # Errors
/// As [`read`].
pub fn parse<T: Knobs>(text: &str, file: &Path, base: &T) -> Result<T> {
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let read: T = options
        .from_str(text)
        .map_err(|e| explain(e, file, T::KIND))?;
    let given: Keys = options
        .from_str(text)
        .map_err(|e| explain(e, file, T::KIND))?;
    match outside(&read) {
        None => overlay(base, &read, &given.0),
        Some(range) => Err(Error::input(
            file,
            place_of(text, range.key),
            describe(&range),
            format!("give {} a value in this range", range.key),
        )),
    }
}

/// Checks ranges of knobs that came from no file.
///
/// # Errors
/// [`Error::Usage`] with the first key that is out of range.
pub fn check<T: Knobs>(knobs: &T) -> Result<()> {
    match outside(knobs) {
        None => Ok(()),
        Some(range) => Err(Error::usage(
            format!("{}: {}", T::KIND, describe(&range)),
            format!("give {} a value in this range", range.key),
        )),
    }
}

fn outside<T: Knobs>(knobs: &T) -> Option<Range> {
    let inside = |r: &Range| r.value >= r.least && r.value <= r.most;
    knobs.ranges().into_iter().find(|r| !inside(r))
}

fn describe(range: &Range) -> String {
    let Range {
        key,
        value,
        least,
        most,
    } = range;
    format!("{key} is {value}, but must be from {least} to {most}")
}

/// `base` with the values that `read` has for the keys in `given`.
fn overlay<T: Knobs>(base: &T, read: &T, given: &[String]) -> Result<T> {
    let fail = |error: serde_json::Error| Error::Internal {
        step: "read settings",
        what: error.to_string(),
    };
    let mut all = serde_json::to_value(base).map_err(fail)?;
    let read = serde_json::to_value(read).map_err(fail)?;
    for key in given {
        all[key] = read[key].clone();
    }
    serde_json::from_value(all).map_err(fail)
}

/// The keys of the outermost struct, in order.
struct Keys(Vec<String>);

impl<'de> Deserialize<'de> for Keys {
    fn deserialize<D: Deserializer<'de>>(source: D) -> std::result::Result<Self, D::Error> {
        struct Names;
        impl<'de> Visitor<'de> for Names {
            type Value = Keys;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a struct")
            }
            fn visit_map<A: MapAccess<'de>>(
                self,
                mut map: A,
            ) -> std::result::Result<Keys, A::Error> {
                let mut keys = Keys(Vec::new());
                while let Some((key, IgnoredAny)) = map.next_entry::<String, IgnoredAny>()? {
                    keys.0.push(key);
                }
                Ok(keys)
            }
        }
        source.deserialize_struct("", &[], Names)
    }
}

fn explain(error: ron::error::SpannedError, file: &Path, kind: &str) -> Error {
    let start = error.span.start;
    let place = format!("line {}, column {}", start.line, start.col);
    let (what, help) = match &error.code {
        ron::Error::NoSuchStructField {
            expected, found, ..
        } => (
            format!("a {kind} has no key {found:?}"),
            suggest(found, expected, "key"),
        ),
        ron::Error::NoSuchEnumVariant {
            expected, found, ..
        } => (
            format!("{found:?} is not a value of this key"),
            suggest(found, expected, "value"),
        ),
        ron::Error::DuplicateStructField { field, .. } => (
            format!("the key {field:?} is given twice"),
            "keep one of them".into(),
        ),
        code => (
            code.to_string(),
            format!("a {kind} is written as (key: value, ...); README.md lists the keys"),
        ),
    };
    Error::input(file, place, what, help)
}

fn suggest(found: &str, expected: &[&str], noun: &str) -> String {
    let nearest = expected.iter().min_by_key(|name| edits(found, name));
    match nearest {
        Some(name) => format!(
            "did you mean {name:?}? The {noun}s are: {}",
            expected.join(", ")
        ),
        None => format!("leave the {noun} out"),
    }
}

/// Levenshtein's distance in characters.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, &y) in b.iter().enumerate() {
            let replaced = corner + usize::from(x != y);
            corner = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}

/// "line 3, column 5" of a key that is known to be in `text`; comments are skipped.
fn place_of(text: &str, key: &str) -> String {
    for (number, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        for (at, _) in code.match_indices(key) {
            let before = code[..at].chars().next_back();
            let word = |c: char| c.is_alphanumeric() || c == '_';
            let after = code[at + key.len()..].trim_start();
            if !before.is_some_and(word) && after.starts_with(':') {
                let column = code[..at].chars().count() + 1;
                return format!("line {}, column {column}", number + 1);
            }
        }
    }
    key.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::Recipe;

    fn wrong(text: &str) -> String {
        parse(text, Path::new("r.ron"), &Recipe::balanced())
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn keys_left_out_keep_the_preset() {
        let draft = Recipe::draft();
        let read = parse("(samples: 7)", Path::new("r.ron"), &draft).unwrap();
        assert_eq!(
            read,
            Recipe {
                samples: 7,
                ..draft
            }
        );
    }

    #[test]
    fn a_misspelt_key_is_named_with_its_place_and_the_nearest() {
        let message = wrong("(\n    locality: 0.1,\n    sample: 3,\n)");
        assert!(message.contains("line 3"), "{message}");
        assert!(
            message.contains("\"sample\"") && message.contains("did you mean \"samples\""),
            "{message}"
        );
    }

    #[test]
    fn a_value_out_of_range_is_named_with_its_place() {
        let message = wrong("(\n  // samples: 4\n  samples: 99)");
        assert!(message.contains("line 3, column 3"), "{message}");
        assert!(
            message.contains("samples is 99, but must be from 1 to 8"),
            "{message}"
        );
        assert!(wrong("(locality: NaN)").contains("locality"));
    }

    #[test]
    fn broken_files_are_errors_with_a_place() {
        for text in [
            "",
            "(",
            "(samples: \"x\")",
            "(samples: 1, samples: 2)",
            "[1]",
            "(samples: -1)",
        ] {
            assert!(wrong(text).contains("line 1"), "{text}: {}", wrong(text));
        }
    }

    #[test]
    fn edits_worked_by_hand() {
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("", "abc"), 3);
        assert_eq!(edits("same", "same"), 0);
    }
}
