//! Where tests of jobs lay out what the arguments name.

use tempfile::TempDir;

/// A folder with a file `scene.xml`.
pub struct Bench {
    pub folder: TempDir,
}

impl Bench {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("scene.xml"), "<scene version=\"3.0.0\"/>").unwrap();
        Bench { folder }
    }

    pub fn path(&self, name: &str) -> String {
        self.folder.path().join(name).to_str().unwrap().to_owned()
    }
}
