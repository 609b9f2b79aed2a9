//! Random scenes, rendered by every method and by Mitsuba's own path tracer.

#[allow(dead_code)]
#[path = "../support/image.rs"]
mod image;
#[allow(dead_code)]
#[path = "../support/stats.rs"]
mod stats;

mod generator;
mod judge;
mod scene;
mod xml;

use std::path::{Path, PathBuf};
use std::time::Instant;

use judge::{Judge, Levels, Ruling};
use vpt::host::session::Session;
use vpt::method::Method;

fn output_folder() -> PathBuf {
    let target =
        Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("target/tmp lies in target");
    target.join("differential")
}

fn run(first: u64, scenes: u64) {
    let session = Session::start(Some("scalar_rgb"), None, 0).unwrap();
    let levels = Levels::new(scenes as usize * Method::ALL.len());
    for seed in first..first + scenes {
        let scene = generator::generate(seed);
        let folder = output_folder().join(seed.to_string());
        xml::write(&scene, &folder).unwrap();
        let start = Instant::now();
        let path = folder.join("scene.xml");
        let judge = match Judge::new(&session, &path, &scene, levels) {
            Ok(judge) => judge,
            Err(error) => {
                println!("{seed:6} reference: {error}");
                continue;
            }
        };
        print!("{seed:6} ref {:4.1}s", start.elapsed().as_secs_f64());
        for method in Method::ALL {
            let t = Instant::now();
            let judgement = judge.judge(method.name());
            print!(" {:.1}s", t.elapsed().as_secs_f64());
            match judgement {
                Ok(j) => print!(
                    " | {} {:+6.2} {:3} {}",
                    method.name(),
                    100.0 * j.deviation,
                    j.seeds,
                    match &j.ruling {
                        Ruling::Agrees => "ok".to_owned(),
                        Ruling::Undecided => "undecided".to_owned(),
                        Ruling::Disagrees(why) => format!("DISAGREES {why}"),
                    }
                ),
                Err(error) => print!(" | {}: {error}", method.name()),
            }
        }
        println!(" | {:5.1}s", start.elapsed().as_secs_f64());
    }
}

#[test]
#[ignore = "long: just fuzz"]
fn many() {
    let number = |name: &str, default: u64| {
        std::env::var(name).map_or(default, |value| value.parse().expect("a whole number"))
    };
    run(number("VPT_FUZZ_SEED", 1), number("VPT_FUZZ_SCENES", 200));
}
