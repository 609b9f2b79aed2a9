//! What a picture's file says of its making.

use super::job::RenderJob;
use std::ffi::OsStr;
use vpt::host::session::Session;
use vpt::method::Stats;
use vpt::picture::Metadata;

/// What metadata takes from the render, besides the job.
pub struct Making<'a> {
    pub session: &'a Session,
    pub stats: &'a Stats,
    /// None where a file of the scene could not be read again.
    pub scene_hash: Option<u64>,
}

/// Everything that it takes to render the picture again, and how accurate it is; nothing that differs between two renders of the
/// same command.
pub fn metadata(job: &RenderJob, making: &Making) -> Metadata {
    let Making { session, stats, scene_hash } = making;
    let (version, mitsuba) = (env!("CARGO_PKG_VERSION"), session.mitsuba_version());
    let mut own = Metadata::default();
    own.text("generatedBy", format!("vpt {version} with Mitsuba {mitsuba}"));
    own.text("vpt.version", version);
    own.text("vpt.mitsuba", mitsuba);
    own.text("vpt.variant", session.variant());
    own.text("vpt.command", command_line(std::env::args_os()));
    own.text("vpt.scene", job.scene.path.display().to_string());
    if let Some(hash) = scene_hash {
        own.text("vpt.scene_hash", format!("{hash:016x}"));
    }
    own.text("vpt.method", stats.parameters.method.name());
    // Numbers and names alone: they always become JSON.
    own.text("vpt.parameters", serde_json::to_string(&stats.parameters).unwrap_or_default());
    own.integer("vpt.passes", stats.passes.into());
    own.integer("vpt.seed", job.seed.into());
    own.integer("vpt.sensor", job.sensor as u64);
    let (first, next) = (stats.initial_radii, stats.final_radii);
    own.number("vpt.surface_radius.first", first.surface);
    own.number("vpt.surface_radius.last", next.surface);
    own.number("vpt.medium_radius.first", first.medium);
    own.number("vpt.medium_radius.last", next.medium);
    if let Some(error) = &stats.estimated_error {
        own.number("vpt.error", error.relative);
        own.number("vpt.error.noise", error.noise);
        own.number("vpt.error.bias", error.bias);
    }
    own
}

/// A command as a shell would read it.
fn command_line(words: impl Iterator<Item = impl AsRef<OsStr>>) -> String {
    words.map(|word| quoted(&word.as_ref().to_string_lossy())).collect::<Vec<_>>().join(" ")
}

fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_is_what_a_shell_reads() {
        let words = ["vpt", "render", "a b.xml", "-o", "it's.exr", "--set", "alpha=0.5", ""];
        let expected = r"vpt render 'a b.xml' -o 'it'\''s.exr' --set alpha=0.5 ''";
        assert_eq!(command_line(words.iter()), expected);
    }
}
