//! `vpt reproduce` as its user meets it, with tiny pictures and budgets, and without the network.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

const METHODS: [&str; 6] = ["ppt", "ppbt", "ppt_metro", "ppbt_metro", "apa", "ppb"];

/// A pyramid, far from the origin.
const PYRAMID: &str =
    "v 10 5 0\nv 14 5 0\nv 14 5 4\nv 10 5 4\nv 12 8 2\nf 1 2 3 4\nf 2 1 5\nf 3 2 5\n\
    f 4 3 5\nf 1 4 5\n";

/// Thin fog between a lamp and a wall. Small radii make photons cheap.
const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="vpt">
        <integer name="max_depth" value="3"/>
        <float name="medium_radius" value="0.01"/>
        <float name="surface_radius" value="0.01"/>
    </integrator>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film>
    </sensor>
    <medium type="homogeneous" id="fog"><float name="sigma_t" value="0.4"/></medium>
    <shape type="cube"><bsdf type="null"/><ref name="interior" id="fog"/></shape>
    <shape type="rectangle"><transform name="to_world"><translate z="-2"/></transform></shape>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="90"/><translate y="2"/></transform>
        <emitter type="area"/>
    </shape>
</scene>"#;

fn reproduce(folder: &Path, words: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vpt"));
    command.arg("reproduce").args(words.split(' ')).current_dir(folder).stdin(Stdio::null());
    // Without npm nothing is fetched.
    command.env("PATH", "").env("XDG_CACHE_HOME", folder.join("cache")).output().unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(path: &Path) -> Value {
    let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap()
}

/// Measures one scene as fast as that goes, and checks what it leaves.
fn check_scene(scene: &str, own: &str) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("pyramid.obj"), PYRAMID).unwrap();
    let words = format!(
        "{scene} --budget 3s --seeds 1 --no-memory -D resx=32 -D resy=24 -D max_depth=6 -o out{own}"
    );
    let output = reproduce(folder.path(), &words);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let out = folder.path().join("out");
    for file in ["report.html", "rmse.svg", "rmse.png", "results.csv", "images/reference.exr"] {
        assert!(out.join(scene).join(file).is_file(), "{file}");
    }
    let results = json(&out.join(scene).join("results.json"));
    assert_eq!(results["film_size"], serde_json::json!([32, 24]));
    let names: Vec<_> = results["methods"].as_array().unwrap().iter().map(|m| &m["name"]).collect();
    assert_eq!(names, METHODS);
    assert!(results["reference"]["mean"].as_f64().unwrap() > 0.01, "{results}");
    check_claims(&out, &String::from_utf8_lossy(&output.stdout));
}

/// One seed decides nothing, and that is said of all claims.
fn check_claims(out: &Path, table: &str) {
    let claims = json(&out.join("claims.json"));
    let ids: Vec<_> = claims["claims"].as_array().unwrap().iter().map(|c| &c["id"]).collect();
    assert_eq!(ids, ["a", "b", "c", "d", "e"]);
    for claim in claims["claims"].as_array().unwrap() {
        assert_eq!(claim["verdict"], "not_decided", "{claim}");
    }
    let markdown = fs::read_to_string(out.join("claims.md")).unwrap();
    assert!(markdown.contains("**not decided**") && markdown.contains("32 x 24 pixels"));
    assert!(table.contains("(a) not decided") && table.contains("claims.md"), "{table}");
}

#[test]
fn dragon_smokes_is_measured_with_a_mesh_of_the_users_own() {
    check_scene("dragon_smokes", " --dragon pyramid.obj");
}

#[test]
fn breakfast_hall_is_measured() {
    check_scene("breakfast_hall", "");
}

#[test]
fn kitchen_is_measured() {
    check_scene("kitchen", "");
}

#[test]
fn scene_of_the_users_own_takes_the_place_of_the_projects_and_its_memory_is_measured() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lamp.xml"), SCENE).unwrap();
    let words = "dragon_smokes --scene lamp.xml --budget 6s --seeds 2 -o out";
    let output = reproduce(folder.path(), words);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let out = folder.path().join("out/dragon_smokes");
    assert!(!out.join("scene.xml").exists());
    let results = json(&out.join("results.json"));
    assert!(results["scene"].as_str().unwrap().ends_with("lamp.xml"));
    let memory = json(&out.join("memory.json"));
    let bytes = |name: &str| {
        let all = memory.as_array().unwrap();
        let growth = all.iter().find(|growth| growth["method"] == name).unwrap();
        let bytes = growth["bytes_per_photon"].as_array().unwrap();
        bytes.iter().map(|b| b.as_f64().unwrap()).sum::<f64>() / bytes.len() as f64
    };
    assert!(bytes("apa") > 3.0 * bytes("ppt"), "{memory}");
}

#[test]
fn scenes_are_prepared_where_the_user_wants_them() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("pyramid.obj"), PYRAMID).unwrap();
    let output = reproduce(folder.path(), "all --prepare --dragon pyramid.obj -o scenes");
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let paths: Vec<String> =
        String::from_utf8(output.stdout).unwrap().lines().map(str::to_owned).collect();
    let names = ["dragon_smokes", "breakfast_hall", "kitchen"];
    assert_eq!(paths, names.map(|name| format!("scenes/{name}/scene.xml")));
    for name in names {
        let written = fs::read(folder.path().join(format!("scenes/{name}/scene.xml"))).unwrap();
        let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("mitsuba_scenes").join(name);
        assert_eq!(written, fs::read(kept.join("scene.xml")).unwrap(), "{name}");
        assert!(!folder.path().join(format!("scenes/{name}/report.html")).exists());
    }
}

#[test]
fn mistakes_are_refused_before_any_rendering() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    fs::write(folder.path().join("points.obj"), "v 1 2 3\n").unwrap();
    for (words, code, parts) in [
        ("attic", 2, &["attic", "kitchen"][..]),
        ("kitchen --budget 5", 2, &["--budget", "such as 90s, 5m or 2h"]),
        ("kitchen --seeds 0", 2, &["--seeds"]),
        ("kitchen --dragon file", 2, &["--dragon is for dragon_smokes"]),
        ("all --scene file", 2, &["--scene is for one scene"]),
        ("kitchen --scene none.xml", 2, &["none.xml", "Mitsuba XML"]),
        ("kitchen --scene file", 2, &["file"]),
        ("kitchen --reference none.exr", 2, &["none.exr", "EXR"]),
        ("kitchen -D colour=3 --seeds 1", 2, &["colour"]),
        ("kitchen -o file", 2, &["\"file\" is no folder"]),
        ("dragon_smokes --dragon points.obj", 1, &["points.obj", "no triangles"]),
        ("dragon_smokes", 1, &["npm", "install it", "--dragon FILE"]),
    ] {
        let output = reproduce(folder.path(), words);
        let message = said(&output);
        assert_eq!(output.status.code(), Some(code), "{words}: {message}");
        assert!(!message.contains("comparing"), "{words}: {message}");
        for part in parts {
            assert!(message.contains(part), "{words}: no {part:?} in: {message}");
        }
    }
}
