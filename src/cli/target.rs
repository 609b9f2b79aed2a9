//! Files to write: checked before the work, replaced in one stroke after it.

use anyhow::Context;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// A file that can be written.
#[derive(Debug)]
pub struct Target {
    path: PathBuf,
}

/// Why a file cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TargetError {
    #[error("\"{}\" is a folder; name a file", .0.display())]
    IsFolder(PathBuf),
    #[error("\"{}\" is write-protected; name another file, or make it writable", .0.display())]
    ReadOnly(PathBuf),
    #[error("the folder \"{}\" does not exist; make it first", .0.display())]
    NoFolder(PathBuf),
    #[error("the folder \"{}\" is not writable; name a file in another", .folder.display())]
    FolderNotWritable { folder: PathBuf, source: io::Error },
}

impl Target {
    /// Checks that the file can be created or replaced, without touching it.
    pub fn check(path: PathBuf) -> Result<Self, TargetError> {
        if path.is_dir() || path.file_name().is_none() {
            return Err(TargetError::IsFolder(path));
        }
        if fs::metadata(&path).is_ok_and(|file| file.permissions().readonly()) {
            return Err(TargetError::ReadOnly(path));
        }
        let target = Target { path };
        let folder = target.folder().to_owned();
        if !folder.is_dir() {
            return Err(TargetError::NoFolder(folder));
        }
        match target.file_aside() {
            Ok(_) => Ok(target),
            Err(source) => Err(TargetError::FolderNotWritable { folder, source }),
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether its name says that it is an OpenEXR file.
    pub fn is_exr(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
    }

    /// Has a file written aside, with the same extension, and moves it to its place: whoever looks
    /// sees the old file or the whole of the new one.
    pub fn replace(&self, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
        self.write_aside(write).with_context(|| format!("cannot write \"{}\"", self.path.display()))
    }

    fn write_aside(&self, write: impl FnOnce(&Path) -> anyhow::Result<()>) -> anyhow::Result<()> {
        let file = self.file_aside()?;
        write(file.path())?;
        file.persist(&self.path).map_err(|e| e.error)?;
        Ok(())
    }

    /// A new file in the same folder, which goes when dropped.
    fn file_aside(&self) -> io::Result<NamedTempFile> {
        let suffix = match self.path.extension() {
            Some(extension) => format!(".{}", extension.to_string_lossy()),
            None => String::new(),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".vpt-").suffix(&suffix);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(self.folder())
    }

    fn folder(&self) -> &Path {
        match self.path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn check_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        Target::check(folder.path().join("a.exr")).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn check_refuses_what_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file.exr");
        fs::write(&file, "").unwrap();
        let refused = |path: PathBuf| Target::check(path).unwrap_err();
        assert!(matches!(refused(folder.path().to_owned()), TargetError::IsFolder(_)));
        assert!(matches!(refused(folder.path().join("no/a.exr")), TargetError::NoFolder(_)));
        assert!(matches!(refused(file.join("a.exr")), TargetError::NoFolder(_)));
        let mut permissions = fs::metadata(&file).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&file, permissions).unwrap();
        assert!(matches!(refused(file), TargetError::ReadOnly(_)));
    }

    #[test]
    fn replace_keeps_the_old_file_when_writing_fails() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        fs::write(&path, "old").unwrap();
        let target = Target::check(path.clone()).unwrap();
        let error = target.replace(|_| anyhow::bail!("the ink is out")).unwrap_err();
        assert!(format!("{error:#}").contains("the ink is out"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        target
            .replace(|aside| {
                assert_eq!(aside.extension().unwrap(), "exr");
                Ok(fs::write(aside, "new")?)
            })
            .unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
