//! The program `vpt` as its user meets it: what it writes, what it says, and with which exit code.

use std::fs;
use std::io::{BufRead, BufReader, Lines};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Output, Stdio};
use std::time::Duration;
use tempfile::TempDir;

const SENSOR: &str = r#"
    <sensor type="perspective">
        <float name="fov" value="45"/>
        <transform name="to_world"><lookat origin="0,-5,1" target="0,0,1" up="0,0,1"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="16"/>
            <integer name="height" value="12"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="3"/></sampler>
    </sensor>"#;

const EMITTER: &str = r#"
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="180"/><translate z="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="4"/></emitter>
    </shape>"#;

/// A floor and a ball of fog, seen by the given sensors under the given emitters.
fn scene(sensors: &str, emitters: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
    <integrator type="vpt"><integer name="photons" value="2000"/></integrator>{sensors}{emitters}
    <default name="reflectance" value="0.5"/>
    <shape type="rectangle">
        <bsdf type="diffuse"><rgb name="reflectance" value="$reflectance"/></bsdf>
    </shape>
    <shape type="sphere">
        <point name="center" x="0" y="0" z="1"/>
        <float name="radius" value="0.5"/>
        <bsdf type="null"/>
        <medium name="interior" type="homogeneous">
            <rgb name="sigma_t" value="1"/>
            <rgb name="albedo" value="0.8"/>
        </medium>
    </shape>
</scene>
"#
    )
}

/// A folder of its own that holds `scene.xml`, in which the program runs.
struct Desk {
    folder: TempDir,
}

impl Desk {
    fn new() -> Self {
        Desk::with(&scene(SENSOR, EMITTER))
    }

    fn with(scene: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.xml"), scene).unwrap();
        Desk { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vpt"));
        command.args(words).current_dir(self.folder.path()).stdin(Stdio::null());
        command
    }

    fn run(&self, words: &[&str]) -> Said {
        Said::from(self.command(words).output().unwrap())
    }

    fn start(&self, words: &[&str]) -> Running {
        let mut command = self.command(words);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        Running { child, lines }
    }
}

/// What a finished program said.
struct Said {
    code: Option<i32>,
    out: String,
    err: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Said {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// A program whose stderr is read line by line.
struct Running {
    child: Child,
    lines: Lines<BufReader<ChildStderr>>,
}

impl Running {
    /// Reads on to the line that starts like this.
    fn wait_for(&mut self, start: &str) {
        let found = self.lines.by_ref().any(|line| line.unwrap().starts_with(start));
        assert!(found, "the program ended without a line {start:?}");
    }

    fn interrupt(&self) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    }

    /// The exit code, and what was not read yet.
    fn finish(mut self) -> (Option<i32>, String) {
        let rest: Vec<_> = self.lines.map(Result::unwrap).collect();
        (self.child.wait().unwrap().code(), rest.join("\n"))
    }
}

/// Asserts that the run was refused with one message that holds all the parts, and left no file.
fn assert_refused(desk: &Desk, words: &[&str], parts: &[&str]) {
    let before = desk.files();
    let said = desk.run(words);
    assert_eq!(said.code, Some(2), "{words:?}: {}", said.err);
    assert_eq!(said.out, "", "{words:?}");
    assert_eq!(said.err.matches("error: ").count(), 1, "{words:?}: {}", said.err);
    assert!(!said.err.contains("rendering"), "{words:?}: {}", said.err);
    for part in parts {
        assert!(said.err.contains(part), "{words:?}: no {part:?} in: {}", said.err);
    }
    assert_eq!(desk.files(), before, "{words:?}");
}

fn magic(path: &Path) -> Vec<u8> {
    fs::read(path).unwrap()[..4].to_vec()
}

#[test]
fn bad_input_is_refused_with_its_mend() {
    let desk = Desk::new();
    fs::create_dir(desk.path("folder.exr")).unwrap();
    for (words, parts) in [
        (&["--method", "mlt"][..], &["unknown method \"mlt\"", "ppt"][..]),
        (&["--set", "surface_radius=-1"], &["surface_radius", "-1", ">= 0"]),
        (&["--set", "medium_radius=nan"], &["medium_radius", ">= 0"]),
        (&["--set", "alpha=0"], &["alpha is 0", "between 0 and 1"]),
        (&["--set", "alpha=1"], &["alpha is 1", "between 0 and 1"]),
        (&["--set", "alpha=1.5"], &["alpha is 1.5", "between 0 and 1"]),
        (&["--set", "photons=-1"], &["photons", "at least 0"]),
        (&["--set", "preset=quick"], &["preset", "fast", "paper"]),
        (&["--set", "connections=perhaps"], &["connections", "true, false or auto"]),
        (&["--set", "photons=many"], &["photons", "many"]),
        (&["--set", "shooting=chains"], &["unknown shooting \"chains\"", "metropolis"]),
        (
            &["--method", "apa", "--set", "shooting=auto"],
            &["shooting is auto", "\"apa\"", "\"ppt_metro\""],
        ),
        (
            &["--method", "ppt", "--set", "shooting=metropolis"],
            &["shooting is metropolis", "\"ppt_metro\""],
        ),
        (&["--set", "chains=-1"], &["chains is -1", "at least 0"]),
        (&["--set", "chains=4294967296"], &["chains is 4294967296", "at most 1048576"]),
        (&["--set", "photon_beams=wide"], &["unknown photon_beams \"wide\"", "short"]),
        (&["--set", "surface_radios=1"], &["surface_radios", "surface_radius"]),
        (&["--passes", "0"], &["--passes", "0"]),
        (&["--passes", "-4"], &["--passes", "-4"]),
        (&["--timeout", "-1"], &["--timeout", "above 0"]),
        (&["-D", "reflectance"], &["-D", "reflectance", "NAME=VALUE"]),
        (&["-D", "=0.5"], &["-D", "NAME=VALUE"]),
        (
            &["--variant", "scalar_rgb_double"],
            &["scalar_rgb_double", "single precision", "scalar_rgb"],
        ),
        (&["--variant", "scalar_mono"], &["unknown variant", "scalar_mono", "llvm_ad_mono"]),
        (&["--variant", "llvm_ad_spectral_polarized"], &["no polarized light", "llvm_ad_spectral"]),
        (&["--variant", "gpu"], &["unknown variant \"gpu\"", "cuda_ad_rgb"]),
        (&["--sensor", "1"], &["--sensor is 1", "last sensor is 0"]),
        (&["-o", "none/picture.exr"], &["\"none\" does not exist", "make it"]),
        (&["-o", "scene.xml/picture.exr"], &["\"scene.xml\"", "does not exist"]),
        (&["-o", "folder.exr"], &["\"folder.exr\" is a folder", "name a file"]),
        (&["-o", "picture.gif"], &["picture.gif", "exr, png"]),
        (&["--stats", "none/stats.json"], &["--stats", "\"none\" does not exist"]),
        (&["--stats", "scene.xml"], &["--stats", "name another file"]),
        (&["--colour"], &["--colour"]),
    ] {
        let words = [&["render", "scene.xml"], words].concat();
        assert_refused(&desk, &words, parts);
    }
    assert_refused(&desk, &["render", "none.xml"], &["\"none.xml\"", "give the path"]);
    assert_refused(&desk, &["paint", "scene.xml"], &["paint"]);
}

#[test]
fn scene_that_cannot_be_rendered_is_refused() {
    for (scene, parts) in [
        (scene(SENSOR, ""), &["no emitter", "add"][..]),
        (scene("", EMITTER), &["no sensor", "add"]),
        ("<scene version=\"3.0.0\">\n<shape".to_owned(), &["scene.xml"]),
        (scene("<sensor type=\"camera_obscura\"/>", EMITTER), &["camera_obscura"]),
    ] {
        assert_refused(&Desk::with(&scene), &["render", "scene.xml"], parts);
    }
}

#[test]
fn picture_is_named_after_the_scene_and_lies_in_the_current_folder() {
    let desk = Desk::new();
    fs::create_dir(desk.path("sub")).unwrap();
    fs::rename(desk.path("scene.xml"), desk.path("sub/room.xml")).unwrap();
    let said = desk.run(&["render", "sub/room.xml"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert_eq!(desk.files(), ["room.exr", "sub"]);
    assert_eq!(magic(&desk.path("room.exr")), [0x76, 0x2f, 0x31, 0x01]);
    assert_eq!(said.out.lines().count(), 1);
    assert!(said.out.starts_with("wrote \"room.exr\": 3 passes of 2.00 k photons in "));
    for part in ["rendering \"sub/room.xml\" to \"room.exr\", 16 x 12 pixels", "pass 3 of 3"] {
        assert!(said.err.contains(part), "no {part:?} in: {}", said.err);
    }
}

#[test]
fn format_follows_the_extension() {
    let desk = Desk::new();
    let said = desk.run(&["render", "scene.xml", "-o", "picture.png", "--passes", "1"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert_eq!(magic(&desk.path("picture.png")), *b"\x89PNG");
}

#[test]
fn quiet_says_nothing() {
    let desk = Desk::new();
    let said = desk.run(&["render", "scene.xml", "-q", "-o", "picture.exr"]);
    assert_eq!((said.code, said.out.as_str(), said.err.as_str()), (Some(0), "", ""));
    assert_eq!(desk.files(), ["picture.exr", "scene.xml"]);
}

#[test]
fn statistics_tell_how_to_repeat_the_render() {
    let desk = Desk::new();
    let options = "--stats stats.json -D reflectance=0.25 --set alpha=0.5 --passes 2 --seed 7";
    let words: Vec<_> = "render scene.xml".split(' ').chain(options.split(' ')).collect();
    let said = desk.run(&words);
    assert_eq!(said.code, Some(0), "{}", said.err);
    let text = fs::read_to_string(desk.path("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(stats["version"], env!("CARGO_PKG_VERSION"));
    assert!(stats["variant"].as_str().unwrap().ends_with("_rgb"));
    assert_eq!(stats["scene"], "scene.xml");
    assert_eq!(stats["picture"], "scene.exr");
    assert_eq!(stats["film_size"], serde_json::json!([16, 12]));
    assert_eq!(stats["seed"], 7);
    assert_eq!(stats["defines"]["reflectance"], "0.25");
    assert_eq!(stats["ending"], "complete");
    assert_eq!(stats["passes"], 2);
    assert_eq!(stats["parameters"]["alpha"], 0.5);
    assert_eq!(stats["parameters"]["max_depth"], -1);
    assert!(stats["initial_radii"]["surface"].as_f64().unwrap() > 0.0);
    if cfg!(target_os = "linux") {
        assert!(stats["peak_memory_bytes"].as_u64().unwrap() > 1 << 20);
    }
}

#[test]
fn timeout_ends_the_render_with_a_picture() {
    let desk = Desk::new();
    let said = desk.run(&["render", "scene.xml", "--passes", "10000000", "--timeout", "2"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(said.err.contains("note: stopped by the timeout after "), "{}", said.err);
    assert_eq!(desk.files(), ["scene.exr", "scene.xml"]);
}

#[test]
fn ctrl_c_ends_the_render_with_a_picture() {
    let desk = Desk::new();
    let words = ["render", "scene.xml", "--passes", "10000000", "--timeout", "30"];
    let mut running = desk.start(&words);
    running.wait_for("pass ");
    running.interrupt();
    let (code, rest) = running.finish();
    assert_eq!(code, Some(0), "{rest}");
    assert!(rest.contains("note: stopped by Ctrl-C after "), "{rest}");
    assert_eq!(desk.files(), ["scene.exr", "scene.xml"]);
}

#[test]
fn second_ctrl_c_aborts_at_once() {
    let desk = Desk::new();
    let mut running = desk.start(&["render", "scene.xml", "--set", "photons=1000000000"]);
    running.wait_for("rendering ");
    // Into the first pass, which takes minutes; before it, the first Ctrl-C would do.
    std::thread::sleep(Duration::from_secs(1));
    running.interrupt();
    running.wait_for("stopping after this pass");
    running.interrupt();
    assert_eq!(running.finish(), (Some(130), String::new()));
    assert_eq!(desk.files(), ["scene.xml"]);
}

#[test]
fn plugin_dir_prints_a_folder_that_holds_the_plugin() {
    let desk = Desk::new();
    for _ in 0..2 {
        let said = desk.run(&["plugin-dir", "for mitsuba"]);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
        let folder = PathBuf::from(said.out.strip_suffix('\n').unwrap());
        assert_eq!(folder, desk.path("for mitsuba").canonicalize().unwrap());
        let plugins: Vec<_> = fs::read_dir(folder.join("plugins")).unwrap().collect();
        assert_eq!(plugins.len(), 1);
        let plugin = plugins[0].as_ref().unwrap();
        let name = format!("vpt{}", std::env::consts::DLL_SUFFIX);
        assert_eq!(plugin.file_name().to_str(), Some(name.as_str()));
        assert!(plugin.metadata().unwrap().len() > 0);
    }
}

#[test]
fn plugin_dir_that_cannot_be_filled_fails() {
    let desk = Desk::new();
    let said = desk.run(&["plugin-dir", "scene.xml"]);
    assert_eq!((said.code, said.out.as_str()), (Some(1), ""));
    assert_eq!(said.err.lines().count(), 1);
    assert!(said.err.contains("scene.xml") && said.err.contains("give one that can be written"));
}

#[test]
fn inspect_says_what_the_scene_calls_for() {
    let desk = Desk::new();
    let said = desk.run(&["inspect", "scene.xml"]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
    let line = |effect: &str| {
        let found = said.out.lines().find(|line| line.split_whitespace().nth(1) == Some(effect));
        found.unwrap_or_else(|| panic!("no {effect} in\n{}", said.out))
    };
    assert!(line("view_beams").starts_with("  on "), "{}", said.out);
    let tables = line("transmittance_tables");
    assert!(tables.starts_with("  off ") && tables.contains("no medium varies"), "{tables}");
    assert!(tables.contains("forced: "), "{tables}");

    let said = desk.run(&["inspect", "scene.xml", "--json", "--effects", "transmittance_tables"]);
    assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
    let report: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    let effects = report["effects"].as_array().unwrap();
    let of = |name: &str| effects.iter().find(|effect| effect["effect"] == name).unwrap();
    assert_eq!(of("transmittance_tables")["forced"], true);
    assert_eq!(of("visible_points")["on"], true);
    assert!(of("visible_points")["cost"]["per_jitter"].as_f64().unwrap() > 0.0);
    assert_eq!(desk.files(), ["scene.xml"]);

    let said = desk.run(&["inspect", "scene.xml", "--effects", "fog"]);
    assert_eq!((said.code, said.out.as_str()), (Some(2), ""));
    assert!(said.err.contains("\"fog\"") && said.err.contains("view_beams"), "{}", said.err);
}

#[test]
fn help_and_version_succeed() {
    let desk = Desk::new();
    for (words, part) in [
        (&["--help"][..], "plugin-dir"),
        (&["render", "--help"], "--passes"),
        (&["--version"], env!("CARGO_PKG_VERSION")),
    ] {
        let said = desk.run(words);
        assert_eq!((said.code, said.err.as_str()), (Some(0), ""));
        assert!(said.out.contains(part), "{}", said.out);
    }
}
