//! `vpt plugin-dir`: a folder in which the stock Mitsuba finds the plugin.

use super::arguments::PluginDirArguments;
use super::cache;
use super::failure::Failure;
use super::print_result;
use super::target::Target;
use anyhow::{anyhow, Context};
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Name of the folder when none is given.
const FOLDER: &str = "vpt-plugins";

/// Fills the folder with the plugin that was built with this program, and prints its path.
pub fn run(arguments: &PluginDirArguments) -> Result<(), Failure> {
    let folder = fill(arguments).map_err(Failure::failed)?;
    print_result(&folder.display().to_string())
}

fn fill(arguments: &PluginDirArguments) -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe().context("cannot find the folder of this program")?;
    let beside = program.parent().context("this program lies in no folder")?;
    fill_from(beside, arguments)
}

fn fill_from(beside: &Path, arguments: &PluginDirArguments) -> anyhow::Result<PathBuf> {
    if let Some(plugin) = installed(beside) {
        return match &arguments.dir {
            Some(folder) => install(&plugin, folder),
            None => Ok(beside.canonicalize()?),
        };
    }
    let library = find_library(beside)?;
    match &arguments.dir {
        Some(folder) => install(&library, folder),
        None => install(&library, &beside.join(FOLDER))
            .or_else(|error| install(&library, &cache::folder().ok_or(error)?.join(FOLDER))),
    }
}

/// The plugin in a folder that serves already, as the Python package has it.
fn installed(beside: &Path) -> Option<PathBuf> {
    Some(beside.join("plugins").join(format!("vpt{DLL_SUFFIX}"))).filter(|path| path.is_file())
}

/// The newest library next to the program or in `deps`, where Cargo leaves it at times.
fn find_library(beside: &Path) -> anyhow::Result<PathBuf> {
    let name = format!("{DLL_PREFIX}vpt{DLL_SUFFIX}");
    let built = |path: &PathBuf| -> Option<SystemTime> { fs::metadata(path).ok()?.modified().ok() };
    [beside.join(&name), beside.join("deps").join(&name)]
        .into_iter()
        .filter(|path| path.is_file())
        .max_by_key(built)
        .ok_or_else(|| {
            anyhow!(
                "{name}, which holds the plugin, is not in \"{}\" beside this program; build both \
                 with `cargo build --release` and run target/release/vpt",
                beside.display()
            )
        })
}

/// Copies the library to where Mitsuba looks for plugins in `folder`, whose full path it returns.
fn install(library: &Path, folder: &Path) -> anyhow::Result<PathBuf> {
    let plugins = folder.join("plugins");
    fs::create_dir_all(&plugins).with_context(|| {
        format!("cannot make the folder \"{}\"; give one that can be written", plugins.display())
    })?;
    Target::check(plugins.join(format!("vpt{DLL_SUFFIX}")))?
        .replace(|aside| Ok(fs::copy(library, aside).map(drop)?))?;
    Ok(folder.canonicalize()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newest_library_is_installed() {
        let folder = tempfile::tempdir().unwrap();
        let name = format!("{DLL_PREFIX}vpt{DLL_SUFFIX}");
        assert!(find_library(folder.path()).unwrap_err().to_string().contains("cargo build"));

        fs::create_dir(folder.path().join("deps")).unwrap();
        fs::write(folder.path().join(&name), "old").unwrap();
        let newer = folder.path().join("deps").join(&name);
        fs::write(&newer, "new").unwrap();
        let later = SystemTime::now() + std::time::Duration::from_secs(10);
        fs::File::open(&newer).unwrap().set_modified(later).unwrap();
        let library = find_library(folder.path()).unwrap();
        assert_eq!(library, newer);

        for _ in 0..2 {
            let filled = install(&library, &folder.path().join("a/b")).unwrap();
            let plugin = filled.join("plugins").join(format!("vpt{DLL_SUFFIX}"));
            assert!(plugin.is_absolute());
            assert_eq!(fs::read_to_string(plugin).unwrap(), "new");
        }
    }

    #[test]
    fn folder_that_serves_already_is_named_or_copied_from() {
        let folder = tempfile::tempdir().unwrap();
        let beside = install_text(folder.path(), "package");
        let filled = fill_from(&beside, &PluginDirArguments { dir: None }).unwrap();
        assert_eq!(filled, beside.canonicalize().unwrap());

        let elsewhere = PluginDirArguments { dir: Some(folder.path().join("elsewhere")) };
        let plugin = installed(&fill_from(&beside, &elsewhere).unwrap()).unwrap();
        assert_eq!(fs::read_to_string(plugin).unwrap(), "plugin");
    }

    fn install_text(folder: &Path, name: &str) -> PathBuf {
        let library = folder.join("library");
        fs::write(&library, "plugin").unwrap();
        install(&library, &folder.join(name)).unwrap()
    }
}
