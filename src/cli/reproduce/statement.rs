//! The verdicts in words: for the terminal, as `claims.md` and `claims.json`.

use super::claims::Claim;
use super::evidence::AllEvidence;
use anyhow::{Context, Result};
use serde::Serialize;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use vpt::report::results::Comparison;

/// What `claims.json` holds.
#[derive(Serialize)]
struct Statement<'a> {
    version: &'static str,
    measured: Vec<Measured>,
    claims: &'a [Claim],
}

/// What was measured of a scene.
#[derive(Serialize)]
struct Measured {
    scene: &'static str,
    file: String,
    variant: String,
    film_size: [u32; 2],
    seconds_per_method: f64,
    seeds: u32,
    interrupted: bool,
    reference: String,
}

/// Writes both files.
pub fn write(output: &Path, all: &AllEvidence, claims: &[Claim]) -> Result<()> {
    let measured = all.iter().map(|(scene, evidence)| measured(scene.name(), &evidence.comparison));
    let version = env!("CARGO_PKG_VERSION");
    let statement = Statement { version, measured: measured.collect(), claims };
    let json = serde_json::to_string_pretty(&statement)? + "\n";
    for (name, text) in [("claims.json", json), ("claims.md", markdown(&statement))] {
        let path = output.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write \"{}\"", path.display()))?;
    }
    Ok(())
}

fn measured(scene: &'static str, comparison: &Comparison) -> Measured {
    Measured {
        scene,
        file: comparison.scene.clone(),
        variant: comparison.variant.clone(),
        film_size: comparison.film_size,
        seconds_per_method: comparison.seconds,
        seeds: comparison.seeds,
        interrupted: comparison.interrupted,
        reference: comparison.reference.origin.clone(),
    }
}

fn markdown(statement: &Statement) -> String {
    let mut text = String::from("# The paper's claims\n");
    for claim in statement.claims {
        let Claim { id, claim, criterion, verdict, findings } = claim;
        let _ = write!(
            text,
            "\n## ({id}) {claim}\n\n**{}** — counts as supported if {criterion}.\n\n",
            verdict.text()
        );
        for finding in findings {
            let verdict = finding.verdict.text();
            let _ = writeln!(text, "- {}: {} — {verdict}", finding.scene, finding.numbers);
        }
    }
    text += "\nBrackets are 95 % confidence intervals over the seeds [Welch 1947]; errors are without the part that \
             the reference's noise has in them. The worst part decides a claim.\n\n## What was measured\n\n";
    for measured in &statement.measured {
        let Measured { scene, file, variant, film_size: [width, height], .. } = measured;
        let _ = writeln!(
            text,
            "- {scene}: `{file}`, {width} x {height} pixels, {variant}, {:.3} s for each method and seed, seeds: {}; \
             reference: {}{}",
            measured.seconds_per_method,
            measured.seeds,
            measured.reference,
            if measured.interrupted { "; interrupted" } else { "" }
        );
    }
    text
}

/// The verdicts with the finding that decided each.
pub fn summary(claims: &[Claim]) -> String {
    let mut lines = vec!["claims of the paper, and what the measurements say:".to_owned()];
    for Claim { id, claim, verdict, findings, .. } in claims {
        lines.push(format!("({id}) {}: {claim}", verdict.text()));
        let deciding = findings.iter().filter(|finding| finding.verdict == *verdict);
        let mut told: Vec<String> =
            deciding.map(|finding| format!("    {}: {}", finding.scene, finding.numbers)).collect();
        // What was not measured need not be said for each of its parts.
        told.dedup();
        lines.extend(told);
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::super::claims::Finding;
    use super::super::verdict::Verdict;
    use super::*;

    fn claim() -> Claim {
        let finding = |verdict, numbers: &str| Finding {
            scene: "kitchen".into(),
            verdict,
            numbers: numbers.into(),
        };
        Claim {
            id: "c".into(),
            claim: "It is ahead.".into(),
            criterion: "it is".into(),
            verdict: Verdict::NotDecided,
            findings: vec![finding(Verdict::Supported, "0.5"), finding(Verdict::NotDecided, "0.9")],
        }
    }

    #[test]
    fn terminal_shows_what_decided() {
        let text = summary(&[claim()]);
        assert!(text.contains("(c) not decided: It is ahead.\n    kitchen: 0.9"), "{text}");
        assert!(!text.contains("0.5"));
    }

    #[test]
    fn files_hold_everything() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &AllEvidence::new(), &[claim()]).unwrap();
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let text = read("claims.md");
        assert!(text.contains("**not decided** — counts as supported if it is."), "{text}");
        assert!(text.contains("- kitchen: 0.5 — supported"), "{text}");
        let json: serde_json::Value = serde_json::from_str(&read("claims.json")).unwrap();
        assert_eq!(json["claims"][0]["verdict"], "not_decided");
    }
}
