//! Pictures against references: levels, faults, and the table of all scenes and methods.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::time::Instant;

use super::cases::{Case, Method, Power, MOST_SEEDS};
use super::image::Image;
use super::pictures;
use super::stats::{Comparison, Reference, Verdict, BLOCK};
use super::{agreement_folder, output_folder, reference_folder, reference_scenes};

const IMAGE_BOUND: f64 = 0.005;
const BLOCK_BOUND: f64 = 0.02;
const FALSE_ALARM: f64 = 1e-3;

/// The levels at which one test rejects, such that all of a run together keep `FALSE_ALARM`.
struct Levels {
    image: f64,
    block: f64,
}

impl Levels {
    /// For so many pictures of 64 blocks and three colours.
    fn new(pictures: usize) -> Self {
        Levels {
            image: 0.5 * FALSE_ALARM / (3 * pictures) as f64,
            block: 0.5 * FALSE_ALARM / (3 * 64 * pictures) as f64,
        }
    }
}

/// What is said about one scene and method.
struct Entry {
    /// Of the least believable colour's mean; none where there is no picture to judge.
    deviation: Option<f64>,
    rejected: bool,
    noisy: bool,
    faults: Vec<String>,
}

/// Scenes by methods: the deviation of the mean, and what is wrong with it.
pub struct Table {
    title: String,
    methods: Vec<&'static str>,
    rows: Vec<(&'static str, Vec<Entry>)>,
}

impl Table {
    /// In Markdown, columns aligned.
    pub fn markdown(&self) -> String {
        let mut text = format!("{}\n\n| {:20} |", self.title, "scene");
        let line = |text: &mut String, cells: &mut dyn Iterator<Item = String>| {
            cells.for_each(|cell| write!(text, " {cell:>12} |").expect("write to a string"));
            text.push('\n');
        };
        line(&mut text, &mut self.methods.iter().map(|method| method.to_string()));
        write!(text, "| :{:-<19} |", "").expect("write to a string");
        line(&mut text, &mut self.methods.iter().map(|_| "-----------:".to_owned()));
        for (scene, entries) in &self.rows {
            write!(text, "| {scene:20} |").expect("write to a string");
            line(&mut text, &mut entries.iter().map(Entry::cell));
        }
        text
    }

    pub fn faults(&self) -> Vec<String> {
        let row = |(scene, entries): &(&'static str, Vec<Entry>)| -> Vec<String> {
            let named = entries.iter().zip(&self.methods);
            named
                .filter(|(entry, _)| !entry.faults.is_empty())
                .map(|(entry, method)| format!("{scene}, {method}: {}", entry.faults.join("; ")))
                .collect()
        };
        self.rows.iter().flat_map(row).collect()
    }
}

impl Entry {
    fn cell(&self) -> String {
        let marks = [(self.rejected, "rejected"), (self.noisy, "noisy")];
        let mut words: Vec<&str> = marks.iter().filter(|mark| mark.0).map(|mark| mark.1).collect();
        let deviation = self.deviation.map(|d| format!("{:+.2}", 100.0 * d));
        words.insert(0, deviation.as_deref().unwrap_or("failed"));
        words.join(" ")
    }
}

/// Render and judge `cases` with all `methods`, printing as it goes.
pub fn judge(variant: &str, cases: &[&'static Case], methods: &[&'static Method]) -> Table {
    assert!(!cases.is_empty() && !methods.is_empty(), "no such scene or method");
    let levels = Levels::new(cases.len() * methods.len());
    let title = format!(
        "{variant}, up to {MOST_SEEDS} seeds, mitsuba {}: deviation of the mean in %",
        env!("VPT_MITSUBA_VERSION")
    );
    println!(
        "\n{variant}\n{:20} {:10} {:>5} {:>7} {:>7} {:>6} {:>6} | {:>8} {:>6} {:>6} | {:>7}",
        "scene",
        "method",
        "seeds",
        "mean",
        "dev %",
        "z",
        "sees %",
        "block %",
        "z",
        "sees %",
        "seconds"
    );
    let entry = |case: &&'static Case, method: &&'static Method| {
        judge_one(case, method, variant, &levels).unwrap_or_else(|fault| Entry {
            deviation: None,
            rejected: false,
            noisy: false,
            faults: vec![fault],
        })
    };
    let row = |case: &&'static Case| {
        (case.scene, methods.iter().map(|method| entry(case, method)).collect())
    };
    Table {
        title,
        methods: methods.iter().map(|method| method.name).collect(),
        rows: cases.iter().map(row).collect(),
    }
}

fn judge_one(
    case: &Case,
    method: &Method,
    variant: &str,
    levels: &Levels,
) -> Result<Entry, String> {
    let start = Instant::now();
    let folder = output_folder().join(case.scene).join(method.name).join(variant);
    let reference = read_reference(case.scene, variant)?;
    let session = pictures::session(variant)?;
    let size = |image: &Image| (image.width, image.height);
    let verdict_of = |runs: &[Image]| Verdict::new(runs, &reference, IMAGE_BOUND, BLOCK_BOUND);
    // Looks at the spread alone, so that it does not choose when to stop by what it would find.
    let are_enough = |runs: &[Image]| {
        size(&runs[0]) != size(&reference.mean)
            || !is_noisy(&verdict_of(runs), levels, &method.power)
    };
    let runs = pictures::render(&session, case, method, &folder, are_enough)?;
    if let Some(run) = runs.iter().find(|run| size(run) != size(&reference.mean)) {
        return Err(format!("the size of the image is {:?}", size(run)));
    }
    let verdict = verdict_of(&runs);
    print_row(case, method, runs.len(), &verdict, levels, start.elapsed().as_secs_f64());

    let biases = biases(&verdict, levels, reference.mean.width / BLOCK);
    let mut entry = Entry {
        deviation: Some(Verdict::worst(&verdict.image).deviation),
        rejected: !biases.is_empty(),
        noisy: is_noisy(&verdict, levels, &method.power),
        faults: biases,
    };
    if entry.noisy {
        entry.faults.push("too noisy to judge: it takes more photons".into());
    }
    if entry.faults.is_empty() {
        fs::remove_dir_all(&folder).map_err(|e| e.to_string())?;
    } else {
        write_evidence(&folder, &runs, &reference.mean)?;
        entry.faults.push(format!("see {}", folder.display()));
    }
    Ok(entry)
}

/// Whether a bias that must be seen could hide.
fn is_noisy(verdict: &Verdict, levels: &Levels, power: &Power) -> bool {
    verdict.detectable_in_image(levels.image) > power.image
        || verdict.detectable_in_median_block(levels.block) > power.block
}

/// The least believable colour of the image and the least believable block, each with its z-score
/// and with the bias that the noise would let one see.
fn print_row(
    case: &Case,
    method: &Method,
    seeds: usize,
    verdict: &Verdict,
    levels: &Levels,
    seconds: f64,
) {
    let image = Verdict::worst(&verdict.image);
    let block = Verdict::worst(&verdict.blocks);
    println!(
        "{:20} {:10} {seeds:>5} {:7.4} {:7.2} {:6.1} {:6.2} | {:8.2} {:6.1} {:6.1} | {seconds:7.1}",
        case.scene,
        method.name,
        image.ratio,
        100.0 * image.deviation,
        image.z(),
        100.0 * verdict.detectable_in_image(levels.image),
        100.0 * block.deviation,
        block.z(),
        100.0 * verdict.detectable_in_median_block(levels.block),
    );
}

/// What is rejected, in sentences.
fn biases(verdict: &Verdict, levels: &Levels, columns: usize) -> Vec<String> {
    let mut faults = Vec::new();
    if verdict.image.iter().any(|c| c.rejected(levels.image)) {
        let worst = Verdict::worst(&verdict.image);
        faults.push(format!("the mean is off by {:.2} %", 100.0 * worst.deviation));
    }
    let places: BTreeSet<(usize, usize)> = (0..verdict.blocks.len())
        .filter(|&i| verdict.blocks[i].rejected(levels.block))
        .map(|i| (i / 3 % columns, i / 3 / columns))
        .collect();
    if !places.is_empty() {
        let worst = 100.0 * Verdict::worst(&verdict.blocks).deviation;
        faults.push(format!("blocks (column, row) {places:?} are off, the worst by {worst:.1} %"));
    }
    faults
}

fn read_reference(scene: &str, variant: &str) -> Result<Reference, String> {
    let folder = agreement_folder(reference_folder(variant));
    let path = folder.join(format!("{scene}.exr"));
    let index = fs::read_to_string(folder.join("references.json")).map_err(|e| e.to_string())?;
    let index: serde_json::Value = serde_json::from_str(&index).map_err(|e| e.to_string())?;
    let seeds =
        index[scene]["seeds"].as_f64().ok_or(format!("references.json does not know {scene}"))?;
    Ok(Reference {
        mean: Image::read_exr(&path, "")?,
        variance: Image::read_exr(&path, "var.")?,
        freedom: seeds - 1.0,
    })
}

/// Expected, actual and difference, as EXR with the values and as PNG to look at. In the PNG of the
/// difference grey is none, black and white are a fifth of the white of the other two.
fn write_evidence(folder: &Path, runs: &[Image], expected: &Image) -> Result<(), String> {
    let each = |pixel: &dyn Fn(usize, usize) -> f32| {
        Image::from_fn(expected.width, expected.height, |x, y| {
            [0, 1, 2].map(|c| pixel(y * expected.width + x, c))
        })
    };
    let actual =
        each(&|i, c| runs.iter().map(|run| run.pixels[i][c]).sum::<f32>() / runs.len() as f32);
    let difference = each(&|i, c| actual.pixels[i][c] - expected.pixels[i][c]);
    let white = 3.0 * expected.mean().into_iter().fold(0.0, f64::max) as f32;
    let shown_difference = each(&|i, c| 0.5 * white + 2.5 * difference.pixels[i][c]);
    expected.write_exr(&folder.join("expected.exr"))?;
    actual.write_exr(&folder.join("actual.exr"))?;
    difference.write_exr(&folder.join("difference.exr"))?;
    expected.write_png(&folder.join("expected.png"), white)?;
    actual.write_png(&folder.join("actual.png"), white)?;
    shown_difference.write_png(&folder.join("difference.png"), white)
}

/// The references are precise enough for the bounds: one standard error is at most 0.1 % for the
/// image and 0.5 % for each block. Compared with copies of itself, which have no variance, a
/// reference shows its own error.
#[test]
fn references_are_precise() {
    let of = |variant| reference_scenes(variant).into_iter().map(move |scene| (variant, scene));
    for (variant, scene) in
        ["scalar_rgb", "scalar_spectral", "llvm_ad_mono"].into_iter().flat_map(of)
    {
        let reference = read_reference(&scene, variant).unwrap();
        let verdict =
            Verdict::new(&[reference.mean.clone(), reference.mean.clone()], &reference, 0.0, 0.0);
        let worst = |list: &[Comparison]| list.iter().map(|c| c.error).fold(0.0, f64::max);
        let (image, block) = (worst(&verdict.image), worst(&verdict.blocks));
        assert!(
            image <= 0.001 && block <= 0.005,
            "{scene} in {variant}: image {image}, block {block}"
        );
    }
}

/// Two methods, one of them all right, one rejected and noisy, and one that gave no picture.
#[test]
fn a_table_marks_what_is_wrong() {
    let entry = |deviation, rejected, noisy, faults: &[&str]| Entry {
        deviation,
        rejected,
        noisy,
        faults: faults.iter().map(|fault| fault.to_string()).collect(),
    };
    let table = Table {
        title: "title".into(),
        methods: vec!["ppt", "apa"],
        rows: vec![
            (
                "fog",
                vec![entry(Some(0.00123), false, false, &[]), entry(None, false, false, &["no"])],
            ),
            (
                "sky",
                vec![
                    entry(Some(-0.05), true, false, &["a", "b"]),
                    entry(Some(0.0), false, true, &["c"]),
                ],
            ),
        ],
    };
    let expected = "\
title

| scene                |          ppt |          apa |
| :------------------- | -----------: | -----------: |
| fog                  |        +0.12 |       failed |
| sky                  | -5.00 rejected |  +0.00 noisy |
";
    assert_eq!(table.markdown(), expected);
    assert_eq!(table.faults(), ["fog, apa: no", "sky, ppt: a; b", "sky, apa: c"]);
}
