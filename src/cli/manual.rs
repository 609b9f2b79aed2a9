//! `vpt completions` and `vpt man`: what the table of [`super::arguments`] says, for shells and for `man`.

use super::arguments::{Arguments, CompletionsArguments, ManArguments};
use super::failure::Failure;
use anyhow::Context;
use clap::CommandFactory;
use std::io::Write;

/// Prints the script that completes commands and options.
pub fn print_completions(arguments: &CompletionsArguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut Arguments::command(), "vpt", &mut script);
    std::io::stdout().write_all(&script).context("cannot write to stdout").map_err(Failure::failed)
}

/// Writes a page for the program and one for each command that is not hidden.
pub fn write_pages(arguments: &ManArguments) -> Result<(), Failure> {
    let folder = &arguments.dir;
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Arguments::command(), folder))
        .with_context(|| format!("cannot write manual pages to \"{}\"", folder.display()))
        .map_err(Failure::failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_its_page() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("man1");
        write_pages(&ManArguments { dir: dir.clone() }).unwrap();
        for command in Arguments::command().get_subcommands() {
            let page = dir.join(format!("vpt-{}.1", command.get_name()));
            assert_ne!(page.is_file(), command.is_hide_set(), "{}", page.display());
        }
        let page = std::fs::read_to_string(dir.join("vpt-render.1")).unwrap();
        assert!(page.contains("target") && page.contains("error"), "{page}");
    }
}
