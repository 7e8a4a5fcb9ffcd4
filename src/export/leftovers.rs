//! What runs that were killed have left beside a package's folder.

use std::ffi::OsStr;
use std::path::Path;

/// Ending of the folder of an old package while it is being replaced.
pub const OLD: &str = "-old";

/// Name of the folder in which this run writes the package called `name`.
pub fn draft_name(name: &OsStr) -> String {
    format!("{}{}", prefix(name), std::process::id())
}

fn prefix(name: &OsStr) -> String {
    format!(".{}.pleach-", name.to_string_lossy())
}

/// Removes drafts for the folder `output` whose runs are gone, and puts an old package back that was
/// being replaced. Runs that are still at work keep theirs. What can't be removed is left: it harms
/// nobody.
pub fn clear(output: &Path) {
    let Some((parent, name)) = output.parent().zip(output.file_name()) else {
        return;
    };
    let Ok(entries) = std::fs::read_dir(parent) else {
        return;
    };
    let prefix = prefix(name);
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some(rest) = name.to_str().and_then(|n| n.strip_prefix(&prefix)) else {
            continue;
        };
        let pid = rest.strip_suffix(OLD).unwrap_or(rest);
        let folder = entry.file_type().is_ok_and(|t| t.is_dir());
        if !folder || pid.parse::<u32>().is_err() || may_run(pid) {
            continue;
        }
        if rest.ends_with(OLD) && !output.exists() {
            let _ = std::fs::rename(entry.path(), output);
        } else {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
}

/// Whether the process may still be there; yes where the system does not tell.
fn may_run(pid: &str) -> bool {
    let processes = Path::new("/proc");
    !processes.join("self").exists() || processes.join(pid).exists()
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// No process has this number: the kernel's are below 2^22.
    const GONE: u32 = 4_194_305;

    #[test]
    fn drafts_of_the_dead_go_and_those_of_the_living_stay() {
        let home = tempfile::tempdir().unwrap();
        let at = |name: String| home.path().join(name);
        let (dead, alive, other) = (
            at(format!(".oak.pleach-{GONE}")),
            at(draft_name(OsStr::new("oak"))),
            at(format!(".oak.pleach-{GONE}x")),
        );
        for folder in [&dead, &alive, &other] {
            std::fs::create_dir(folder).unwrap();
        }
        clear(&home.path().join("oak"));
        assert!(!dead.exists() && alive.exists() && other.exists());
    }

    #[test]
    fn a_package_that_was_being_replaced_comes_back_unless_the_new_one_is_there() {
        let home = tempfile::tempdir().unwrap();
        let output = home.path().join("oak");
        let old = home.path().join(format!(".oak.pleach-{GONE}{OLD}"));
        std::fs::create_dir(&old).unwrap();
        std::fs::write(old.join("x"), b"1").unwrap();
        clear(&output);
        assert!(output.join("x").is_file() && !old.exists());
        std::fs::create_dir(&old).unwrap();
        clear(&output);
        assert!(output.join("x").is_file() && !old.exists());
    }
}
