//! The paper's claims, and what the measurements say of them.

use super::evidence::{AllEvidence, Evidence};
use super::growth::Growth;
use super::scenes::PaperScene;
use super::verdict::{Interval, Verdict};
use serde::{Deserialize, Serialize};
use vpt::report::results::Method;

/// Errors within this factor of each other are as good as each other.
const AS_GOOD: f64 = 1.1;
/// "In the beginning" is after this share of the time: half an hour of the paper's ten.
const BEGINNING: f64 = 0.05;
/// Memory is flat if it grows by less than this share of what storing the photons takes.
const FLAT: f64 = 0.2;
/// Trees are cheap if they take less than this share of the time.
const CHEAP: f64 = 0.1;

/// Methods of the paper that store no photons, and the baseline with the same kind of photons that does.
const OURS: [(&str, &str); 4] =
    [("ppt", "apa"), ("ppt_metro", "apa"), ("ppbt", "ppb"), ("ppbt_metro", "ppb")];

/// A claim and its verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    pub id: String,
    /// What the paper says.
    pub claim: String,
    /// When it counts as supported.
    pub criterion: String,
    pub verdict: Verdict,
    /// The verdict's parts, of which the worst decides.
    pub findings: Vec<Finding>,
}

/// A measured quantity, and what it says of the claim.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub scene: String,
    pub verdict: Verdict,
    pub numbers: String,
}

impl Finding {
    fn new(scene: PaperScene, verdict: Verdict, numbers: impl Into<String>) -> Self {
        Finding { scene: scene.name().to_owned(), verdict, numbers: numbers.into() }
    }

    /// Without a measurement nothing is decided.
    fn missing(scene: PaperScene, why: impl Into<String>) -> Self {
        Finding::new(scene, Verdict::NotDecided, why)
    }
}

impl Claim {
    fn new(id: &str, claim: &str, criterion: String, findings: Vec<Finding>) -> Self {
        let worst = findings.iter().map(|finding| finding.verdict).min();
        Claim {
            id: id.to_owned(),
            claim: claim.to_owned(),
            criterion,
            verdict: worst.unwrap_or(Verdict::NotDecided),
            findings,
        }
    }
}

/// Judges all claims.
pub fn judge(all: &AllEvidence) -> Vec<Claim> {
    vec![simple_light(all), overtaking(all), ahead_of_baselines(all), flat_memory(all), trees(all)]
}

fn simple_light(all: &AllEvidence) -> Claim {
    let scene = PaperScene::DragonSmokes;
    let findings =
        ["apa", "ppb"].map(|other| ratio_at_most(all, scene, "ppt", other, AS_GOOD.ln()));
    Claim::new(
        "a",
        "On simple light (dragon_smokes) PPT is as good as APA and PPB.",
        format!("the RMSE of ppt in the end is at most {AS_GOOD} times theirs"),
        findings.into(),
    )
}

fn overtaking(all: &AllEvidence) -> Claim {
    let scene = PaperScene::BreakfastHall;
    let end = ratio_at_most(all, scene, "ppt_metro", "ppt", 0.0);
    Claim::new(
        "b",
        "On breakfast_hall PPT_metro is behind PPT or equal to it in the beginning, and gets ahead of it.",
        format!(
            "the RMSE of ppt_metro over that of ppt is at least 1 / {AS_GOOD} after {:.0} % of the time, and at \
             most 1 in the end",
            100.0 * BEGINNING
        ),
        vec![beginning(all, scene), end],
    )
}

/// The first half of claim b.
fn beginning(all: &AllEvidence, scene: PaperScene) -> Finding {
    let Some(evidence) = all.get(&scene) else { return unmeasured(scene) };
    let Some(first) = evidence.first_common(&["ppt", "ppt_metro"]) else {
        return unmeasured(scene);
    };
    let total = evidence.comparison.seconds;
    let seconds = first.max(BEGINNING * total);
    if seconds > 0.5 * total {
        let why =
            format!("the first pictures are there after {first:.3} s of {total:.3} s: too late");
        return Finding::missing(scene, why);
    }
    match evidence.ratio_at("ppt_metro", "ppt", seconds) {
        Ok(ratio) => {
            let verdict = ratio.log.at_least(-AS_GOOD.ln());
            Finding::new(scene, verdict, format!("{} after {seconds:.3} s", ratio.tell()))
        }
        Err(why) => Finding::missing(scene, why),
    }
}

fn ahead_of_baselines(all: &AllEvidence) -> Claim {
    let pairs = [PaperScene::BreakfastHall, PaperScene::Kitchen]
        .into_iter()
        .flat_map(|scene| ["apa", "ppb"].map(|other| (scene, other)));
    let findings =
        pairs.map(|(scene, other)| ratio_at_most(all, scene, "ppt_metro", other, 0.0)).collect();
    Claim::new(
        "c",
        "On breakfast_hall and kitchen PPT_metro is ahead of APA and PPB.",
        "the RMSE of ppt_metro in the end is at most theirs".to_owned(),
        findings,
    )
}

/// Whether one method's error in the end is at most another's times a factor, of which the logarithm is given.
fn ratio_at_most(
    all: &AllEvidence,
    scene: PaperScene,
    of: &str,
    to: &str,
    log_factor: f64,
) -> Finding {
    let Some(evidence) = all.get(&scene) else { return unmeasured(scene) };
    match evidence.ratio(of, to) {
        Ok(ratio) => {
            let numbers = format!("{} after {:.3} s", ratio.tell(), ratio.seconds);
            Finding::new(scene, ratio.log.at_most(log_factor), numbers)
        }
        Err(why) => Finding::missing(scene, why),
    }
}

fn unmeasured(scene: PaperScene) -> Finding {
    Finding::missing(scene, "it was not measured")
}

fn flat_memory(all: &AllEvidence) -> Claim {
    let one = |(&scene, evidence): (&PaperScene, &Evidence)| {
        OURS.map(|(ours, baseline)| flat(scene, evidence, ours, baseline))
    };
    Claim::new(
        "d",
        "The memory of PPT, PPBT and their Metropolis variants does not grow with the photons of a pass.",
        format!("each further walk takes at most {FLAT} of the bytes that it takes in the baseline with photon maps"),
        all.iter().flat_map(one).collect(),
    )
}

fn flat(scene: PaperScene, evidence: &Evidence, ours: &str, baseline: &str) -> Finding {
    let find = |name: &str| evidence.growth.iter().find(|growth| growth.method == name);
    let (Some(own), Some(stored)) = (find(ours), find(baseline)) else {
        return Finding::missing(scene, format!("the memory of {ours} was not measured"));
    };
    let allowed: Vec<f64> = stored.bytes_per_photon.iter().map(|bytes| FLAT * bytes).collect();
    let Some(excess) = Interval::difference(&own.bytes_per_photon, &allowed) else {
        return Finding::missing(scene, "fewer than two seeds tell nothing of the uncertainty");
    };
    let mean = |growth: &Growth| {
        growth.bytes_per_photon.iter().sum::<f64>() / growth.bytes_per_photon.len() as f64
    };
    let numbers = format!(
        "{ours} takes {:.1} bytes for each further walk, {baseline} {:.1}",
        mean(own),
        mean(stored)
    );
    Finding::new(scene, excess.at_most(0.0), numbers)
}

fn trees(all: &AllEvidence) -> Claim {
    let one = |(&scene, evidence): (&PaperScene, &Evidence)| {
        OURS.map(|(name, _)| match evidence.method(name) {
            Some(method) => tree_share(scene, method),
            None => Finding::missing(scene, format!("{name} was not measured")),
        })
    };
    Claim::new(
        "e",
        "Building the trees over the view takes a small part of the time (the paper gives no number).",
        format!("it takes at most {:.0} % of the time", 100.0 * CHEAP),
        all.iter().flat_map(one).collect(),
    )
}

fn tree_share(scene: PaperScene, method: &Method) -> Finding {
    let share = |run: &vpt::report::results::Run| {
        let total: f64 = run.phases.iter().map(|phase| phase.seconds).sum();
        let trees = run.phases.iter().find(|phase| phase.name == "trees")?;
        (total > 0.0).then_some(trees.seconds / total)
    };
    let shares: Vec<f64> = method.runs.iter().filter_map(share).collect();
    let name = &method.name;
    match Interval::mean(&shares) {
        Some(interval) => {
            let numbers = format!("{:.1} % of the time of {name}", 100.0 * interval.mean);
            Finding::new(scene, interval.at_most(CHEAP), numbers)
        }
        None => Finding::missing(scene, "fewer than two seeds tell nothing of the uncertainty"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vpt::report::metrics::Errors;
    use vpt::report::results::{Comparison, Noise, Phase, Reference, Run, Snapshot};

    /// A run of 100 s whose RMSE is the given ones after 5 s and after 100 s.
    fn run(seed: u32, early: f64, late: f64, tree_share: f64) -> Run {
        let shot = |seconds: f64, rmse: f64| Snapshot {
            seconds,
            work: 1,
            errors: Errors { rmse, relative_mse: rmse * rmse, flip: 0.1 },
            image: None,
        };
        let phase = |name: &str, seconds| Phase { name: name.into(), seconds };
        let phases = vec![phase("trees", tree_share), phase("photons", 1.0 - tree_share)];
        let snapshots = vec![shot(5.0, early), shot(100.0, late)];
        Run { seed, work: 1, snapshots, phases, complete: true, peak_memory_bytes: None }
    }

    /// Three seeds whose errors differ from each other by the given share.
    fn method(name: &str, early: f64, late: f64, spread: f64) -> Method {
        let runs = [1.0 - spread, 1.0, 1.0 + spread];
        let runs = runs.into_iter().enumerate();
        let run = |(seed, factor): (usize, f64)| {
            run(seed as u32, early * factor, late * factor, 0.04 * factor)
        };
        Method {
            name: name.into(),
            variant: "scalar_rgb".into(),
            ours: true,
            flaw: None,
            shares_reference: false,
            runs: runs.map(run).collect(),
        }
    }

    fn growth(name: &str, bytes: f64) -> Growth {
        let bytes_per_photon = vec![bytes - 0.5, bytes, bytes + 0.5];
        Growth { method: name.into(), photons: [1000, 10_000], bytes_per_photon }
    }

    /// Everything as the paper has it, seeds apart by `spread`.
    fn evidence(spread: f64) -> Evidence {
        let comparison = Comparison {
            version: "0".into(),
            scene: "scene.xml".into(),
            variant: "scalar_rgb".into(),
            film_size: [8, 8],
            seconds: 100.0,
            seeds: 3,
            settings: Default::default(),
            interrupted: false,
            peak_memory_bytes: None,
            reference: Reference {
                origin: "a file".into(),
                mean: 1.0,
                noise: Some(Noise { rmse: 1e-3, relative_mse: 1e-6 }),
                bias: None,
                estimator: None,
            },
            methods: vec![
                method("ppt", 1.0, 0.2, spread),
                method("ppbt", 1.0, 0.2, spread),
                method("ppt_metro", 1.1, 0.1, spread),
                method("ppbt_metro", 1.1, 0.1, spread),
                method("apa", 1.2, 0.21, spread),
                method("ppb", 1.2, 0.21, spread),
            ],
            notes: Vec::new(),
        };
        let bytes = [("ppt", 1.0), ("ppbt", 1.0), ("ppt_metro", 1.0), ("ppbt_metro", 1.0)];
        let mut growths: Vec<Growth> = bytes.map(|(name, bytes)| growth(name, bytes)).into();
        growths.extend(["apa", "ppb"].map(|name| growth(name, 80.0)));
        Evidence { comparison, growth: growths }
    }

    fn all(evidence: &Evidence) -> AllEvidence {
        PaperScene::ALL.into_iter().map(|scene| (scene, evidence.clone())).collect()
    }

    fn verdicts(evidence: &Evidence) -> Vec<Verdict> {
        judge(&all(evidence)).iter().map(|claim| claim.verdict).collect()
    }

    #[test]
    fn results_like_the_papers_support_all_claims() {
        assert_eq!(verdicts(&evidence(0.01)), [Verdict::Supported; 5]);
    }

    #[test]
    fn seeds_far_apart_decide_nothing_about_errors() {
        let undecided = verdicts(&evidence(0.9));
        assert_eq!(undecided[..3], [Verdict::NotDecided; 3]);
        assert_eq!(undecided[3..], [Verdict::Supported, Verdict::NotDecided]);
    }

    #[test]
    fn results_against_the_paper_support_nothing() {
        let mut evidence = evidence(0.01);
        for name in ["ppt", "ppt_metro"] {
            let index = evidence.comparison.methods.iter().position(|m| m.name == name).unwrap();
            let mut worse = method(name, 0.5, if name == "ppt" { 0.3 } else { 0.4 }, 0.01);
            worse.runs.iter_mut().for_each(|run| run.phases[0].seconds = 1.0);
            evidence.comparison.methods[index] = worse;
        }
        evidence.growth[0] = growth("ppt", 60.0);
        assert_eq!(verdicts(&evidence), [Verdict::NotSupported; 5]);
    }

    #[test]
    fn head_start_speaks_against_the_second_claim() {
        let mut evidence = evidence(0.01);
        evidence.comparison.methods[2] = method("ppt_metro", 0.2, 0.1, 0.01);
        let claim = overtaking(&all(&evidence));
        let parts: Vec<Verdict> = claim.findings.iter().map(|f| f.verdict).collect();
        assert_eq!(parts, [Verdict::NotSupported, Verdict::Supported]);
        assert_eq!(claim.verdict, Verdict::NotSupported);
    }

    #[test]
    fn what_was_not_measured_is_not_decided() {
        let mut evidence = evidence(0.01);
        assert_eq!(judge(&AllEvidence::new()).len(), 5);
        assert!(judge(&AllEvidence::new()).iter().all(|c| c.verdict == Verdict::NotDecided));
        evidence.comparison.reference.noise = Some(Noise { rmse: 0.15, relative_mse: 0.02 });
        evidence.growth.clear();
        let claims = judge(&all(&evidence));
        assert!(claims[..4].iter().all(|claim| claim.verdict == Verdict::NotDecided));
        assert!(claims[0].findings[0].numbers.contains("noise of the reference"));
        evidence.comparison.reference.noise = None;
        evidence.comparison.reference.bias = Some(0.3);
        let told = &judge(&all(&evidence))[0].findings[0].numbers;
        assert!(told.contains("bias of the reference"), "{told}");
        evidence.comparison.methods.iter_mut().for_each(|method| method.runs.truncate(1));
        let told = &judge(&all(&evidence))[4].findings[0].numbers;
        assert!(told.contains("fewer than two seeds"), "{told}");
    }

    #[test]
    fn noise_of_the_reference_is_taken_out_of_the_errors() {
        let mut evidence = evidence(0.0);
        evidence.comparison.reference.noise = Some(Noise { rmse: 0.1, relative_mse: 0.01 });
        let ratio = evidence.ratio("apa", "ppt").unwrap();
        let expected = (0.21f64.powi(2) - 0.01).sqrt() / (0.2f64.powi(2) - 0.01).sqrt();
        assert!((ratio.log.mean.exp() - expected).abs() < 1e-9);
    }
}
