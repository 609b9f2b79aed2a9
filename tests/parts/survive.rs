//! Renders that are killed, stopped, or whose disk is full.

use crate::desk::{Desk, Said};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::fs;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use vpt::part::Part;

const PASSES: u32 = 1500;

/// Kills the render so many times, then lets it end. After each kill the checkpoint is whole and has not lost what it had, and in
/// the end the picture is that of the render that was left alone.
fn kill_and_resume(kills: u32, seed: u64) {
    let desk = Desk::new();
    let line = format!("render scene.xml --set photons=500 --passes {PASSES} -q");
    desk.must(&format!("{line} -o whole.exr"));
    let line = format!("{line} -o killed.exr --checkpoint kept.exr --every 20ms --resume");
    let mut dice = Pcg64Mcg::seed_from_u64(seed);
    let (mut passes, mut killed, mut ended) = (0, 0, 0);
    while killed < kills {
        let mut child =
            desk.command(&line).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(dice.random_range(0..1200)));
        if child.try_wait().unwrap().is_some() {
            // It was over; begin anew, so that every kill hits a render at work.
            ended += 1;
            assert!(ended < 3 * kills, "renders end before they are killed");
            fs::remove_file(desk.path("kept.exr")).unwrap();
            passes = 0;
            continue;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        killed += 1;
        if desk.path("kept.exr").exists() {
            let part = Part::read(&desk.path("kept.exr")).expect("the checkpoint is whole");
            assert!(part.passes.count() >= passes, "{} < {passes}", part.passes.count());
            passes = part.passes.count();
        } else {
            assert_eq!(passes, 0, "the checkpoint is gone");
        }
    }
    desk.must(&line);
    assert!(desk.bits("killed.exr") == desk.bits("whole.exr"));
    desk.must("merge kept.exr -o merged.exr");
    assert!(desk.bits("merged.exr") == desk.bits("whole.exr"));
    let names = fs::read_dir(desk.path("")).unwrap().map(|e| e.unwrap().file_name());
    let aside = names.filter(|name| name.to_string_lossy().starts_with(".kept")).count();
    assert!(aside <= 1, "kills leave {aside} files aside");
}

#[test]
fn a_killed_render_goes_on() {
    kill_and_resume(10, 1);
}

/// `just survive`
#[test]
#[ignore = "takes some minutes"]
fn a_render_survives_two_hundred_kills() {
    kill_and_resume(200, 2);
}

#[test]
fn checkpoints_are_told_apart() {
    let desk = Desk::new();
    let said = desk.must("render scene.xml --passes 2 --checkpoint kept.exr --resume -o a.exr");
    assert!(said.err.contains("no checkpoint \"kept.exr\" yet; beginning anew"), "{}", said.err);
    desk.refused(
        "render scene.xml --passes 4 --checkpoint kept.exr -o a.exr",
        &["kept.exr\" exists", "--resume"],
    );
    let resume = "--checkpoint kept.exr --resume -o a.exr";
    desk.refused(
        &format!("render scene.xml --seed 1 {resume}"),
        &["\"kept.exr\" is of another picture", "seed is 0 there and 1 here"],
    );
    desk.refused(
        &format!("render scene.xml --set alpha=0.5 {resume}"),
        &["parameters.alpha", "0.5 here"],
    );
    desk.refused(
        &format!("render scene.xml --passes 1 {resume}"),
        &["holds 2 passes", "the 1 asked for"],
    );
    desk.refused(
        "render scene.xml --passes 1..4 --checkpoint kept.exr --resume -o b.exr",
        &["holds the passes 0..2", "begin at 1"],
    );
    desk.refused(
        "render scene.xml --checkpoint a.exr --resume -o b.exr",
        &["\"a.exr\" is a picture but no part"],
    );
    // More passes than were thought of at first, and none that are left.
    desk.must("render scene.xml --passes 4 -o whole.exr -q");
    for _ in 0..2 {
        desk.must(&format!("render scene.xml --passes 4 {resume}"));
        assert!(desk.bits("a.exr") == desk.bits("whole.exr"));
    }
}

/// A program whose stderr is read line by line.
struct Running {
    child: Child,
    lines: std::io::Lines<BufReader<std::process::ChildStderr>>,
}

impl Running {
    fn start(mut command: Command) -> Self {
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        Running { child, lines }
    }

    /// Reads on to a line that holds this, and gives all that came before it.
    fn wait_for(&mut self, part: &str) -> Vec<String> {
        let mut seen = Vec::new();
        for line in self.lines.by_ref() {
            let line = line.unwrap();
            if line.contains(part) {
                return seen;
            }
            seen.push(line);
        }
        panic!("the program ended without a line with {part:?}: {seen:?}");
    }

    fn interrupt(mut self) -> (Option<i32>, String) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let rest: Vec<_> = self.lines.map(Result::unwrap).collect();
        (self.child.wait().unwrap().code(), rest.join("\n"))
    }
}

fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let clock = Instant::now();
    while !is_so() {
        assert!(clock.elapsed() < Duration::from_secs(60), "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn ctrl_c_then_resume() {
    let desk = Desk::new();
    let endless = "render scene.xml --set photons=500 --passes 10000000 -o a.exr --checkpoint kept.exr --every 1h";
    let mut running = Running::start(desk.command(endless));
    running.wait_for("rendering ");
    std::thread::sleep(Duration::from_secs(1));
    let (code, rest) = running.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("note: stopped by Ctrl-C after"), "{rest}");
    let passes = Part::read(&desk.path("kept.exr")).unwrap().passes.count();
    let picture = desk.bits("a.exr");
    desk.must("merge kept.exr -o merged.exr");
    assert!(desk.bits("merged.exr") == picture);
    let asked = passes + 5;
    let said = desk.must(&format!(
        "render scene.xml --set photons=500 --passes {asked} -o a.exr --checkpoint kept.exr --resume"
    ));
    assert!(said.err.contains(&format!("going on after {passes} passes")), "{}", said.err);
    desk.must(&format!("render scene.xml --set photons=500 --passes {asked} -o whole.exr -q"));
    assert!(desk.bits("a.exr") == desk.bits("whole.exr"));
}

/// The folder of the checkpoint goes away and comes back.
#[test]
fn an_unwritable_folder_is_told_once_and_the_render_goes_on() {
    let desk = Desk::new();
    fs::create_dir(desk.path("kept")).unwrap();
    let line = "render scene.xml --set photons=500 --passes 10000000 -o a.exr --checkpoint kept/c.exr --every 20ms";
    let mut running = Running::start(desk.command(line));
    wait_until("a first checkpoint", || desk.path("kept/c.exr").exists());
    fs::rename(desk.path("kept"), desk.path("gone")).unwrap();
    running.wait_for("warning: cannot write the checkpoint \"kept/c.exr\"; the render goes on");
    std::thread::sleep(Duration::from_millis(300));
    Part::read(&desk.path("gone/c.exr")).expect("what was written stays whole");
    fs::rename(desk.path("gone"), desk.path("kept")).unwrap();
    let between = running.wait_for("note: the checkpoint \"kept/c.exr\" is written again");
    assert!(between.iter().all(|line| !line.contains("cannot write")), "{between:?}");
    let (code, rest) = running.interrupt();
    assert_eq!(code, Some(0), "{rest}");
    Part::read(&desk.path("kept/c.exr")).unwrap();
}

/// A limit on the size of files stands in for a disk that is full: the checkpoint does not fit, the picture does.
#[test]
fn a_full_disk_is_told_once_and_the_render_goes_on() {
    let desk = Desk::new();
    let program = env!("CARGO_BIN_EXE_vpt");
    let line =
        "render scene.xml --set photons=500 --passes 60 -o a.exr --checkpoint c.exr --every 1ms";
    let script = format!("trap '' XFSZ; ulimit -f 8; exec '{program}' {line}");
    let output = Command::new("bash").args(["-c", &script]).current_dir(desk.path("")).output();
    let said = Said::of(output.unwrap());
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert_eq!(said.err.matches("cannot write the checkpoint").count(), 1, "{}", said.err);
    assert!(!desk.path("c.exr").exists() && !desk.path(".c.exr.new").exists());
    desk.must("render scene.xml --set photons=500 --passes 60 -o whole.exr -q");
    assert!(desk.bits("a.exr") == desk.bits("whole.exr"));
}
