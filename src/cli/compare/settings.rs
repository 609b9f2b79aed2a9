//! What a comparison was asked for. One that was interrupted can go on with the same, and with nothing else.

use super::error::CompareError;
use super::job::CompareJob;
use super::per_pass::PerPass;
use super::scene_files::Hash;
use std::collections::BTreeMap;
use std::io;
use vpt::host::session::VARIANTS;
use vpt::report::results::Comparison;

/// Stands for the scene's files among the settings.
const SCENE: &str = "scene";

/// The settings, by the names of their options. `scene_hash` is that of [`super::scene_files::hash`].
pub fn of(job: &CompareJob, scene_hash: u64) -> io::Result<BTreeMap<String, String>> {
    let methods: Vec<&str> = job.entrants.iter().map(|entrant| entrant.name.as_str()).collect();
    let mut all = vec![
        (SCENE, format!("{scene_hash:016x}")),
        ("vpt", env!("CARGO_PKG_VERSION").to_owned()),
        ("--methods", methods.join(",")),
        ("--time", job.time.to_string()),
        ("--seeds", job.seeds.to_string()),
        ("--variant", job.variant.as_deref().unwrap_or(VARIANTS[0]).to_owned()),
        ("--sensor", job.sensor.to_string()),
        ("--set", pairs(&job.scene.settings)),
        ("-D", pairs(&job.scene.defines)),
    ];
    if let Some(PerPass { photons, beams }) = job.per_pass {
        all.push(("walks per pass", format!("{photons} of photons, {beams} of beams")));
    }
    match &job.reference {
        Some((path, _)) => {
            let mut hash = Hash::default();
            hash.add_file(path)?;
            all.push(("--reference", format!("a file with the hash {:016x}", hash.0)));
        }
        None => {
            let method = job.reference_method.as_deref().unwrap_or("auto");
            all.push(("--reference-method", method.to_owned()));
            all.push(("--reference-time", job.reference_time.to_string()));
        }
    }
    Ok(all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect())
}

fn pairs(pairs: &[(String, String)]) -> String {
    pairs.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join(" ")
}

/// An interrupted comparison in the job's folder, to go on with; refuses one with other settings.
pub fn interrupted(
    job: &CompareJob,
    settings: &BTreeMap<String, String>,
) -> Result<Option<Comparison>, CompareError> {
    let earlier = job.folder.load().filter(|earlier| earlier.interrupted && !job.restart);
    let Some(earlier) = earlier else { return Ok(None) };
    let differences = differences(&earlier.settings, settings);
    if differences.is_empty() {
        return Ok(Some(earlier));
    }
    let folder = job.folder.path().to_owned();
    Err(CompareError::OtherSettings { folder, differences })
}

/// What differs between the settings of then and now, in words; empty where nothing does.
fn differences(then: &BTreeMap<String, String>, now: &BTreeMap<String, String>) -> Vec<String> {
    let mut names: Vec<&String> = then.keys().chain(now.keys()).collect();
    names.sort();
    names.dedup();
    let shown = |value: Option<&String>| match value.map(String::as_str) {
        None | Some("") => "not given".to_owned(),
        Some(value) => value.to_owned(),
    };
    let differing = names.into_iter().filter(|name| then.get(*name) != now.get(*name));
    differing
        .map(|name| match name.as_str() {
            SCENE => "the scene's files have changed".to_owned(),
            name => format!("{name} was {}, is {}", shown(then.get(name)), shown(now.get(name))),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(pairs: &[(&str, &str)]) -> BTreeMap<String, String> {
        pairs.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect()
    }

    #[test]
    fn differences_are_named() {
        let then = settings(&[("--time", "60"), ("scene", "1"), ("-D", "")]);
        assert!(differences(&then, &then).is_empty());
        let now =
            settings(&[("--time", "30"), ("scene", "2"), ("-D", "a=1"), ("--reference", "x")]);
        assert_eq!(
            differences(&then, &now),
            [
                "--reference was not given, is x",
                "--time was 60, is 30",
                "-D was not given, is a=1",
                "the scene's files have changed"
            ]
        );
    }
}
