//! What was measured so far, on disk as soon as it is measured, so that nothing but the run under way is lost with the
//! process.

use super::folder::Folder;
use super::schedule::Watch;
use anyhow::Result;
use vpt::report::html::Pictures;
use vpt::report::picture::Picture;
use vpt::report::results::{Comparison, Run};

/// The results of a comparison that is under way, and the folder that they are kept in.
pub struct Ledger<'a> {
    folder: &'a Folder,
    pub results: Comparison,
    reference: Picture,
    /// The last picture of each method's first seed.
    pictures: Vec<Option<Picture>>,
    /// Is told the seconds that the present seed has used.
    tell: Box<dyn FnMut(f64) + 'a>,
}

impl<'a> Ledger<'a> {
    /// `blank` holds no runs; those of `earlier` that were complete are taken over.
    pub fn open(
        folder: &'a Folder,
        blank: Comparison,
        reference: Picture,
        earlier: Option<Comparison>,
    ) -> Result<Self> {
        let mut pictures = vec![None; blank.methods.len()];
        let mut results = blank;
        if let Some(earlier) = earlier {
            results.peak_memory_bytes = results.peak_memory_bytes.max(earlier.peak_memory_bytes);
            for (index, method) in earlier.methods.into_iter().enumerate() {
                let runs = method.runs.into_iter().filter(|run| run.complete);
                for run in runs {
                    let picture = last_picture(folder, &run);
                    if run.seed > 0 || picture.is_some() {
                        pictures[index] = pictures[index].take().or(picture);
                        results.methods[index].runs.push(run);
                    }
                }
            }
        }
        let ledger = Ledger { folder, results, reference, pictures, tell: Box::new(|_| ()) };
        ledger.folder.save(&ledger.results)?;
        Ok(ledger)
    }

    /// Tells the seconds that a seed has used to `tell` from now on.
    pub fn tell_progress(&mut self, tell: impl FnMut(f64) + 'a) {
        self.tell = Box::new(tell);
    }

    /// Whether a method needs not run with a seed any more.
    pub fn holds(&self, method: usize, seed: u32) -> bool {
        self.results.methods[method].runs.iter().any(|run| run.seed == seed && run.complete)
    }

    /// Runs that are complete, of all methods.
    pub fn complete_runs(&self) -> usize {
        let runs = self.results.methods.iter().flat_map(|method| &method.runs);
        runs.filter(|run| run.complete).count()
    }

    pub fn is_blank(&self) -> bool {
        self.results.methods.iter().all(|method| method.runs.is_empty())
    }

    /// Writes the report of what was measured.
    pub fn report(&self) -> Result<()> {
        let (reference, methods) = (self.reference.clone(), self.pictures.clone());
        self.folder.fill(&self.results, &Pictures { reference, methods })
    }

    /// Where a picture is kept: all of the first seed, the last of the others.
    fn image(&self, method: usize, run: &Run) -> String {
        let folder = format!("images/{}", self.results.methods[method].name);
        match run.seed {
            0 => format!("{folder}/seed0-{:02}.exr", run.snapshots.len()),
            seed => format!("{folder}/seed{seed}.exr"),
        }
    }
}

impl Watch for Ledger<'_> {
    fn used(&mut self, seconds: f64) {
        (self.tell)(seconds);
    }

    fn judged(&mut self, method: usize, run: &Run, picture: &Picture) -> Result<()> {
        let image = self.image(method, run);
        if run.snapshots.len() == 1 {
            self.folder.forget_pictures(&self.results.methods[method].name, run.seed)?;
        }
        self.folder.save_picture(&image, picture)?;
        let runs = &mut self.results.methods[method].runs;
        let former = runs.iter().position(|other| other.seed == run.seed);
        let former = former.map(|index| runs.remove(index)).filter(|_| run.snapshots.len() > 1);
        let mut run = run.clone();
        for (shot, kept) in run.snapshots.iter_mut().zip(former.iter().flat_map(|r| &r.snapshots)) {
            shot.image = kept.image.clone().filter(|_| run.seed == 0);
        }
        run.snapshots.last_mut().expect("it was judged").image = Some(image);
        if run.seed == 0 {
            self.pictures[method] = Some(picture.clone());
        }
        let peak = &mut self.results.peak_memory_bytes;
        *peak = (*peak).max(run.peak_memory_bytes);
        runs.push(run);
        runs.sort_by_key(|run| run.seed);
        self.folder.save(&self.results)
    }
}

/// The picture that a run of the first seed ended with.
fn last_picture(folder: &Folder, run: &Run) -> Option<Picture> {
    let image = run.snapshots.last()?.image.as_ref().filter(|_| run.seed == 0)?;
    Picture::read_exr(&folder.path().join(image)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use vpt::report::metrics::Judge;
    use vpt::report::results::{Method, Reference, Snapshot};

    fn grey(value: f32) -> Picture {
        Picture::from_fn(2, 2, |_, _| [value; 3])
    }

    fn blank() -> Comparison {
        let method = |name: &str| Method {
            name: name.into(),
            variant: "scalar_rgb".into(),
            ours: true,
            flaw: None,
            shares_reference: false,
            runs: Vec::new(),
        };
        Comparison {
            version: "0".into(),
            scene: "scene.xml".into(),
            variant: "scalar_rgb".into(),
            film_size: [2, 2],
            seconds: 2.0,
            seeds: 2,
            settings: BTreeMap::new(),
            interrupted: true,
            peak_memory_bytes: None,
            reference: Reference {
                origin: "a file".into(),
                mean: 1.0,
                noise: None,
                bias: None,
                estimator: None,
            },
            methods: vec![method("ppt"), method("apa")],
            notes: Vec::new(),
        }
    }

    /// Records a run with so many snapshots.
    fn record(ledger: &mut Ledger, method: usize, seed: u32, count: usize, complete: bool) {
        let judge = Judge::new(grey(1.0));
        let mut run = Run { seed, ..Run::default() };
        for index in 0..count {
            let picture = grey(2.0 + index as f32);
            let (seconds, errors) = (1.0 + index as f64, judge.errors(&picture));
            run.snapshots.push(Snapshot { seconds, work: 1, errors, image: None });
            run.complete = complete && index + 1 == count;
            ledger.judged(method, &run, &picture).unwrap();
        }
    }

    #[test]
    fn complete_runs_are_taken_over_from_disk_and_no_others() {
        let scratch = tempfile::tempdir().unwrap();
        let folder = Folder::check(scratch.path().join("out")).unwrap();
        folder.make().unwrap();
        let mut ledger = Ledger::open(&folder, blank(), grey(1.0), None).unwrap();
        record(&mut ledger, 0, 0, 3, true);
        record(&mut ledger, 0, 1, 2, true);
        record(&mut ledger, 1, 0, 2, false);
        drop(ledger);

        let earlier = folder.load().unwrap();
        let mut ledger = Ledger::open(&folder, blank(), grey(1.0), Some(earlier)).unwrap();
        assert!(ledger.holds(0, 0) && ledger.holds(0, 1) && !ledger.holds(1, 0));
        assert_eq!(ledger.complete_runs(), 2);
        assert_eq!(ledger.pictures, [Some(grey(4.0)), None]);
        let images = |run: &Run| -> Vec<bool> {
            let there = |image: &String| folder.path().join(image).is_file();
            run.snapshots.iter().map(|shot| shot.image.as_ref().is_some_and(there)).collect()
        };
        let runs = &ledger.results.methods[0].runs;
        assert_eq!((images(&runs[0]), images(&runs[1])), (vec![true; 3], vec![false, true]));
        // What a run that begins again had left does not stay.
        record(&mut ledger, 1, 0, 1, true);
        let left = std::fs::read_dir(folder.path().join("images/apa")).unwrap().count();
        assert_eq!(left, 1);
    }

    #[test]
    fn first_run_without_its_picture_is_not_taken_over() {
        let scratch = tempfile::tempdir().unwrap();
        let folder = Folder::check(scratch.path().join("out")).unwrap();
        folder.make().unwrap();
        let mut ledger = Ledger::open(&folder, blank(), grey(1.0), None).unwrap();
        record(&mut ledger, 0, 0, 2, true);
        drop(ledger);
        std::fs::remove_file(folder.path().join("images/ppt/seed0-02.exr")).unwrap();
        let earlier = folder.load().unwrap();
        let ledger = Ledger::open(&folder, blank(), grey(1.0), Some(earlier)).unwrap();
        assert!(ledger.is_blank());
    }
}
