//! The documents say what the program does: every parameter has its row, every link leads somewhere.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The parameters that the program lists where it is given one that it does not have.
fn parameters() -> BTreeSet<String> {
    let output = Command::new(env!("CARGO_BIN_EXE_vpt"))
        .args(["render", "mitsuba_scenes/cornell_fog/scene.xml", "--set", "colour_of_wind=1"])
        .current_dir(root())
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let (_, names) = message.split_once("it has: ").unwrap_or_else(|| panic!("{message}"));
    names.lines().next().unwrap().split(", ").map(str::to_owned).collect()
}

/// Names at the beginning of rows of five columns.
fn rows(guide: &str) -> BTreeSet<String> {
    let rows =
        guide.lines().filter(|line| line.starts_with("| `") && line.matches('|').count() == 6);
    let names = rows.flat_map(|row| row.split('|').nth(1).unwrap().split(','));
    names.map(|name| name.trim().trim_matches('`').to_owned()).collect()
}

#[test]
fn every_parameter_has_its_row_in_the_guide() {
    let guide = fs::read_to_string(root().join("docs/GUIDE.md")).unwrap();
    assert_eq!(rows(&guide), parameters());
}

#[test]
fn every_link_of_the_documents_leads_to_a_file() {
    let mut documents = vec![root().join("README.md"), root().join("CONTRIBUTING.md")];
    documents.extend(files(&root().join("docs")));
    documents.extend(files(&root().join("mitsuba_scenes")));
    documents.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    assert!(documents.len() > 8, "{documents:?}");
    for document in documents {
        let text = fs::read_to_string(&document).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap();
            let is_web = link.starts_with("https://");
            let exists = file.is_empty() || document.parent().unwrap().join(file).exists();
            assert!(is_web || exists, "{}: {link}", document.display());
        }
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}
