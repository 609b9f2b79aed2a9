//! The files that a scene is made of, as one number that tells scenes apart.

use roxmltree::{Document, ParsingOptions};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use vpt::host::session::SceneFile;

/// Hash of the scene's file and of all files that it names: meshes, textures, volumes, included scenes and what
/// those name. Where they lie does not matter.
pub fn hash(scene: &SceneFile) -> io::Result<u64> {
    let mut walk = Walk {
        folders: vec![folder_of(&scene.path)],
        values: scene.defines.clone(),
        seen: BTreeSet::new(),
        hash: Hash::default(),
    };
    walk.visit(&scene.path)?;
    Ok(walk.hash.0)
}

/// [Fowler, Noll & Vo], 64 bits
pub struct Hash(pub u64);

impl Default for Hash {
    fn default() -> Self {
        Hash(0xcbf2_9ce4_8422_2325)
    }
}

impl Hash {
    pub fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }

    /// The file's bytes and their number, so that two files are not one long one.
    pub fn add_file(&mut self, path: &Path) -> io::Result<()> {
        let mut file = BufReader::with_capacity(1 << 16, File::open(path)?);
        let mut length = 0u64;
        loop {
            let bytes = file.fill_buf()?;
            if bytes.is_empty() {
                break;
            }
            self.add(bytes);
            let count = bytes.len();
            length += count as u64;
            file.consume(count);
        }
        self.add(&length.to_le_bytes());
        Ok(())
    }
}

struct Walk {
    /// Where names are looked up: the scene's folder and those of its `<path>` elements.
    folders: Vec<PathBuf>,
    /// Values of `$name`.
    values: Vec<(String, String)>,
    seen: BTreeSet<PathBuf>,
    hash: Hash,
}

impl Walk {
    fn visit(&mut self, path: &Path) -> io::Result<()> {
        if !self.seen.insert(path.canonicalize()?) {
            return Ok(());
        }
        self.hash.add_file(path)?;
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xml")) {
            self.visit_named(&std::fs::read_to_string(path)?, &folder_of(path))?;
        }
        Ok(())
    }

    /// Visits what an XML text names. Whether it is well-formed is for Mitsuba to say.
    fn visit_named(&mut self, text: &str, folder: &Path) -> io::Result<()> {
        let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
        let Ok(document) = Document::parse_with_options(text, options) else { return Ok(()) };
        for element in document.descendants().filter(|node| node.is_element()) {
            if let ("default", Some(name), Some(value)) =
                (element.tag_name().name(), element.attribute("name"), element.attribute("value"))
            {
                self.values.push((name.to_owned(), value.to_owned()));
            }
            for attribute in element.attributes() {
                let value = self.substitute(attribute.value());
                if element.tag_name().name() == "path" {
                    self.folders.push(folder.join(&value));
                } else if let Some(path) = self.find(&value, folder) {
                    self.visit(&path)?;
                }
            }
        }
        Ok(())
    }

    /// Puts values where `$name` stands; what the command line defines comes before defaults.
    fn substitute(&self, text: &str) -> String {
        let mut values: Vec<_> = self.values.iter().collect();
        values.sort_by_key(|(name, _)| std::cmp::Reverse(name.len()));
        values
            .iter()
            .fold(text.to_owned(), |text, (name, value)| text.replace(&format!("${name}"), value))
    }

    fn find(&self, name: &str, folder: &Path) -> Option<PathBuf> {
        let folders = std::iter::once(folder).chain(self.folders.iter().map(PathBuf::as_path));
        folders.map(|folder| folder.join(name)).find(|path| path.is_file())
    }
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn hash_is_that_of_the_published_vectors() {
        let of = |bytes: &[u8]| {
            let mut hash = Hash::default();
            hash.add(bytes);
            hash.0
        };
        assert_eq!(of(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn every_file_that_is_named_counts_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("parts")).unwrap();
        let scene =
            "<scene version=\"3.0.0\"><default name=\"which\" value=\"b\"/><path value=\"parts\"/>\
            <include filename=\"parts/more.xml\"/><shape type=\"ply\"><string name=\"filename\" \
            value=\"$which.ply\"/></shape></scene>";
        let more = "<scene version=\"3.0.0\"><spectrum name=\"x\" filename=\"d65.spd\"/></scene>";
        for (name, text) in [
            ("scene.xml", scene),
            ("parts/more.xml", more),
            ("parts/d65.spd", "1"),
            ("parts/b.ply", "2"),
            ("c.ply", "3"),
        ] {
            fs::write(path(name), text).unwrap();
        }
        let file = SceneFile { path: path("scene.xml"), ..SceneFile::default() };
        let other = SceneFile { defines: vec![("which".into(), "c".into())], ..file.clone() };
        let hashes = || (hash(&file).unwrap(), hash(&other).unwrap());
        let (first, first_other) = hashes();
        assert_ne!(first, first_other);
        fs::write(path("c.ply"), "4").unwrap();
        let (second, second_other) = hashes();
        assert!(second == first && second_other != first_other);
        for name in ["parts/b.ply", "parts/d65.spd", "parts/more.xml", "scene.xml"] {
            let (before, text) = (hash(&file).unwrap(), fs::read_to_string(path(name)).unwrap());
            fs::write(path(name), text + " ").unwrap();
            assert_ne!(hash(&file).unwrap(), before, "{name}");
        }
    }

    #[test]
    fn scenes_that_include_each_other_have_an_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.xml");
        fs::write(&path, "<scene version=\"3.0.0\"><include filename=\"a.xml\"/></scene>").unwrap();
        hash(&SceneFile { path, ..SceneFile::default() }).unwrap();
    }
}
