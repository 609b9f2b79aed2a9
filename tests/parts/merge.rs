//! `vpt render --passes A..B` and `vpt merge`, as users meet them.

use crate::desk::{Desk, SCENE};
use std::fs;
use vpt::part::Part;

#[test]
fn merged_parts_are_the_whole_bit_by_bit() {
    let desk = Desk::new();
    for (name, options) in [
        ("ppt", "--method ppt --layers"),
        ("ppbt", "--method ppbt --set error_image=true"),
        ("apa", "--method apa"),
        ("ppb", "--method ppb --set photons=2000 --set jitter_every=2"),
        ("paper", "--set preset=paper --set photons=3000 --set jitter_every=2"),
        ("spectral", "--variant scalar_spectral --layers"),
    ] {
        desk.must(&format!("render scene.xml {options} --seed 3 -o whole.exr -q"));
        for range in ["0..2", "2..4", "4.."] {
            desk.must(&format!(
                "render scene.xml {options} --seed 3 --passes {range} -o {range}.exr -q"
            ));
        }
        let said = desk.must("merge 4...exr 0..2.exr 2..4.exr -o merged.exr");
        assert!(said.out.starts_with("wrote \"merged.exr\": 6 passes of 3 parts"), "{}", said.out);
        assert_eq!(said.err, "");
        let (merged, mut whole) = (desk.bits("merged.exr"), desk.bits("whole.exr"));
        assert!(whole.contains_key("R"), "{name}");
        // Estimated errors are sums in plain f64, which may differ by their grouping.
        whole.retain(|channel, _| !channel.starts_with("error."));
        for (channel, bits) in whole {
            assert!(merged[&channel] == bits, "{name}: the channel {channel} differs");
        }
    }
}

#[test]
fn parts_of_parts_and_gaps() {
    let desk = Desk::new();
    for range in ["0..1", "1..3", "4..6"] {
        desk.must(&format!("render scene.xml --passes {range} -o {range}.exr -q"));
    }
    let said = desk.must("merge 4..6.exr 0..1.exr -o some.exr --part");
    assert!(said.err.contains("the passes 1..4 are missing"), "{}", said.err);
    assert_eq!(Part::read(&desk.path("some.exr")).unwrap().passes.to_string(), "0..1, 4..6");
    let said = desk.must("merge some.exr 1..3.exr -o merged.png");
    assert!(said.err.contains("the passes 3..4 are missing"), "{}", said.err);
    assert_eq!(fs::read(desk.path("merged.png")).unwrap()[..4], *b"\x89PNG");
    desk.refused(
        "merge some.exr 4..6.exr -o merged.exr",
        &["some.exr", "4..6.exr", "passes 4..6", "twice"],
    );
    desk.refused("merge 0..1.exr 0..1.exr -o merged.exr", &["passes 0..1", "leave one"]);
}

#[test]
fn parts_of_other_pictures_are_refused_with_the_difference() {
    let desk = Desk::new();
    desk.must("render scene.xml --passes 0..1 -o a.exr -q");
    for (options, parts) in [
        ("--seed 1", &["seed is 0 in the first and 1 in the second"][..]),
        ("--set alpha=0.5", &["parameters.alpha is ", " and 0.5 in the second"]),
        ("--method ppbt", &["parameters.method is \"ppt\"", "\"ppbt\""]),
        ("-D reflectance=0.25", &["defines.reflectance is not given", "\"0.25\""]),
        (
            "--set photons=77",
            &["parameters.photons is", "and 77 in", "different kinds of machines"],
        ),
        ("--layers", &["parameters.layers is false"]),
    ] {
        desk.must(&format!("render scene.xml --passes 1..2 {options} -o b.exr -q"));
        desk.refused("merge a.exr b.exr -o c.exr", &[&["\"a.exr\" and \"b.exr\""], parts].concat());
    }
    fs::write(desk.path("scene.xml"), SCENE.replace("value=\"4\"", "value=\"5\"")).unwrap();
    desk.must("render scene.xml --passes 1..2 -o b.exr -q");
    desk.refused("merge a.exr b.exr -o c.exr", &["scene_hash is"]);
    // Another version: the ground is told apart by it as by everything else.
    let part = Part::read(&desk.path("a.exr")).unwrap();
    let mut other = part.clone();
    other.ground.vpt = "9.9.9".to_owned();
    other.ground.variant = "llvm_ad_rgb".to_owned();
    let differences = part.ground.differences(&other.ground);
    let names: Vec<_> = differences.iter().map(|d| d.what.as_str()).collect();
    assert_eq!(names, ["variant", "vpt"]);
    assert_eq!(differences[1].values[1], "\"9.9.9\"");
}

#[test]
fn what_is_no_part_is_refused_by_name() {
    let desk = Desk::new();
    desk.must("render scene.xml --passes 1 -o picture.exr -q");
    desk.must("render scene.xml --passes 0..1 -o part.exr -q");
    desk.refused("merge picture.exr -o c.exr", &["\"picture.exr\" is a picture but no part"]);
    desk.refused("merge none.exr -o c.exr", &["\"none.exr\""]);
    desk.refused("merge scene.xml -o c.exr", &["\"scene.xml\" is no whole EXR file"]);
    desk.refused("merge part.exr -o c.hdr", &["c.hdr", "exr, png"]);
    desk.refused("merge part.exr -o c.png --part", &["c.png", ".exr"]);
    assert!(desk.run("merge -o c.exr").err.contains("<PART>"));
    // By content, not by name; and half of it is not enough.
    fs::rename(desk.path("part.exr"), desk.path("anything")).unwrap();
    desk.must("merge anything -o c.exr");
    let bytes = fs::read(desk.path("anything")).unwrap();
    fs::write(desk.path("half.exr"), &bytes[..bytes.len() / 2]).unwrap();
    desk.refused("merge half.exr -o c.exr", &["\"half.exr\"", "no whole EXR file"]);
}

#[test]
fn ranges_that_make_no_sense_are_refused() {
    let desk = Desk::new();
    desk.refused("render scene.xml --passes 0..2", &["-o"]);
    desk.refused("render scene.xml --passes 9.. -o p.exr", &["asks for 6", "--passes 9..B"]);
    desk.refused(
        "render scene.xml --method ppt_metro --passes 6..8 -o p.exr",
        &["begin at 6", "jitter_every", "begin at 4 or 8"],
    );
    let said = desk.must("render scene.xml --passes 4..6 -o p.exr --stats s.json");
    assert!(said.out.contains("passes 4..6 of"), "{}", said.out);
    assert!(said.err.contains("passes 4..6"), "{}", said.err);
    let stats: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(desk.path("s.json")).unwrap()).unwrap();
    assert_eq!((&stats["passes"], &stats["parameters"]["first_pass"]), (&2.into(), &4.into()));
}
