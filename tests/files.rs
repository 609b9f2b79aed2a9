//! What a picture's file holds: the bits that Mitsuba's own film would write, layers that add up to the picture, and what is known
//! of its making. And the bytes that a viewer gets.

use exr::prelude::{read_first_flat_layer_from_file, FlatSamples};
use std::collections::BTreeMap;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use vpt::host::session::{SceneFile, Session};
use vpt::method::Silent;
use vpt::picture::{develop, LayeredPicture, Metadata};

#[path = "support/llvm.rs"]
mod llvm;

/// A room of fog with a lamp in view, a mirror and a glass ball, seen through a window of the film.
const ROOM: &str = r#"<scene version="3.0.0">
    <default name="pixel_format" value="rgb"/>
    <default name="component_format" value="float32"/>
    <default name="method" value="ppt"/>
    <default name="albedo" value="0.9"/>
    <default name="sigma_t" value="0.5"/>
    <default name="wall" value="0.5"/>
    <integrator type="vpt">
        <string name="method" value="$method"/>
        <integer name="max_depth" value="6"/>
        <integer name="photons" value="4000"/>
    </integrator>
    <medium type="homogeneous" id="fog">
        <float name="sigma_t" value="$sigma_t"/>
        <rgb name="albedo" value="$albedo"/>
    </medium>
    <sensor type="perspective">
        <transform name="to_world"><lookat origin="0, 0, -0.9" target="0, 0, 0" up="0, 1, 0"/></transform>
        <float name="fov" value="90"/>
        <ref name="medium" id="fog"/>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="40"/><integer name="height" value="30"/>
            <integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
            <integer name="crop_width" value="24"/><integer name="crop_height" value="20"/>
            <string name="component_format" value="$component_format"/>
            <string name="pixel_format" value="$pixel_format"/>
        </film>
    </sensor>
    <shape type="cube">
        <boolean name="flip_normals" value="true"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="$wall"/></bsdf>
        <ref name="interior" id="fog"/>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="0.4"/><rotate y="1" angle="-40"/><translate x="0.4" y="-0.3" z="0.5"/>
        </transform>
        <bsdf type="twosided"><bsdf type="conductor"/></bsdf>
        <ref name="interior" id="fog"/><ref name="exterior" id="fog"/>
    </shape>
    <shape type="rectangle">
        <transform name="to_world"><scale value="0.3"/><rotate x="1" angle="90"/><translate y="0.8" z="0.2"/></transform>
        <bsdf type="diffuse"/>
        <ref name="interior" id="fog"/><ref name="exterior" id="fog"/>
        <emitter type="area"><rgb name="radiance" value="3, 2, 1"/></emitter>
    </shape>
</scene>"#;

const LAYERS: [&str; 3] = ["surfaces", "media", "emission"];

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        std::fs::write(folder.path("scene.xml"), ROOM).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, picture: &str, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_vpt"))
            .arg("render")
            .arg(self.path("scene.xml"))
            .args(["-q", "--stats"])
            .arg(self.path("stats.json"))
            .arg("-o")
            .arg(self.path(picture))
            .args(arguments)
            .output()
            .unwrap()
    }

    fn render(&self, arguments: &[&str]) -> (LayeredPicture, Metadata) {
        let output = self.run("picture.exr", arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        LayeredPicture::read(&self.path("picture.exr")).unwrap()
    }
}

/// Channels by name, in the bits of the file.
fn channels(path: &Path) -> BTreeMap<String, FlatSamples> {
    let image = read_first_flat_layer_from_file(path).unwrap();
    let list = image.layer_data.channel_data.list.into_iter();
    list.map(|channel| (channel.name.to_string(), channel.sample_data)).collect()
}

/// All formats of `hdrfilm` but integers, which Mitsuba writes itself; layers and errors with every other one.
#[test]
fn files_have_the_bits_of_mitsubas_film() {
    let folder = Folder::new();
    let session = Session::start(Some("scalar_rgb"), Some(1), 0).unwrap();
    let pixel_formats = ["luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza"];
    for (index, pixel_format) in pixel_formats.into_iter().enumerate() {
        for component_format in ["float16", "float32"] {
            let mut settings = Vec::new();
            if index % 2 == 0 {
                settings.push(("layers".to_owned(), "true".to_owned()));
            }
            let file = SceneFile {
                path: folder.path("scene.xml"),
                defines: vec![
                    ("pixel_format".to_owned(), pixel_format.to_owned()),
                    ("component_format".to_owned(), component_format.to_owned()),
                ],
                settings,
                ..SceneFile::default()
            };
            let mut scene = session.load(&file).unwrap();
            scene.render(0, 1, Some(4), &mut Silent).unwrap();
            let [theirs, ours] = ["theirs.exr", "ours.exr"].map(|name| folder.path(name));
            scene.write(&theirs).unwrap();
            let format = scene.film_format().unwrap().unwrap();
            develop(&scene.film().unwrap(), format)
                .write(&ours, format, &Metadata::default())
                .unwrap();
            let (theirs, ours) = (channels(&theirs), channels(&ours));
            let names = |of: &BTreeMap<String, FlatSamples>| of.keys().cloned().collect::<Vec<_>>();
            assert_eq!(names(&theirs), names(&ours), "{pixel_format} {component_format}");
            for (name, samples) in &theirs {
                assert!(
                    samples == &ours[name],
                    "{pixel_format} {component_format}: {name} differs"
                );
            }
        }
    }
}

/// Up to what single precision takes: film blocks are f32, and a pixel under a Gaussian filter of radius 2 is a sum of up to 25 samples, so
/// that the picture and its layers are off by 25 x 2^-24 of their values each.
fn assert_layers_add_up(picture: &LayeredPicture, what: &str) {
    for colour in ["R", "G", "B"] {
        let whole = picture.channel(colour).unwrap();
        let layers = LAYERS.map(|layer| picture.channel(&format!("{layer}.{colour}")).unwrap());
        let largest = whole.iter().copied().fold(0.0, f32::max);
        for (pixel, &value) in whole.iter().enumerate() {
            let sum: f32 = layers.iter().map(|layer| layer[pixel]).sum();
            assert!(
                (sum - value).abs() <= 3e-6 * largest,
                "{what}: pixel {pixel} is {value} in {colour}, but its layers add up to {sum}"
            );
        }
    }
}

#[test]
fn integers_are_left_to_mitsuba() {
    let folder = Folder::new();
    let (picture, metadata) = folder.render(&["-D", "component_format=uint32", "--layers"]);
    assert_eq!(picture.channels.len(), 16);
    assert_eq!(metadata.get_text("generatedBy"), Some("Mitsuba version 3.9.1"));
}

#[test]
fn layers_add_up_to_the_picture_and_leave_it_as_it_is() {
    for method in ["ppt", "ppbt", "ppt_metro", "ppbt_metro", "apa", "ppb"] {
        let folder = Folder::new();
        let define = format!("method={method}");
        let (picture, _) = folder.render(&["--layers", "--passes", "8", "-D", &define]);
        assert_layers_add_up(&picture, method);
        for layer in LAYERS {
            let lit = picture.channel(&format!("{layer}.R")).unwrap().iter().filter(|v| **v > 0.0);
            assert!(lit.count() > 10, "{method}: {layer} is dark");
        }
        let samples = picture.channel("samples.Y").unwrap();
        let is_count = |count: f32| (count - count.round()).abs() <= 1e-6 * count;
        assert!(samples.iter().all(|per_pass| is_count(8.0 * per_pass)), "{method}");
        assert!(
            samples.iter().filter(|count| **count > 0.0).count() > samples.len() / 2,
            "{method}"
        );
        assert!(picture.channel("error.R").unwrap().iter().any(|error| *error > 0.0), "{method}");
        let (plain, _) = folder.render(&["--passes", "8", "-D", &define]);
        assert_eq!(plain.channels.len(), 3);
        // Sums of the two families are added up in another order: the last bit may fall either way.
        let is_same = |(a, b): (&f32, &f32)| (a - b).abs() <= f32::EPSILON * b.abs();
        for colour in ["R", "G", "B"] {
            let [layered, plain] = [&picture, &plain].map(|of| of.channel(colour).unwrap());
            assert!(layered.iter().zip(plain).all(is_same), "{method}: layers change {colour}");
        }
    }
}

/// A world with one kind of receiver has one layer: fog between black walls, and bright walls without fog. What is seen in the mirror
/// is what is behind it.
#[test]
fn light_lies_in_the_layer_of_its_receiver() {
    let folder = Folder::new();
    let sum = |picture: &LayeredPicture, layer: &str| {
        let channel = picture.channel(&format!("{layer}.G")).unwrap();
        channel.iter().map(|value| f64::from(*value)).sum::<f64>()
    };
    for connections in ["true", "false"] {
        let connections = format!("connections={connections}");
        let (fog, _) = folder.render(&["--layers", "-D", "wall=0", "--set", &connections]);
        assert_eq!(sum(&fog, "surfaces"), sum_of_lamp_light_on_black(&fog));
        assert!(sum(&fog, "media") > 1.0);
        let (walls, _) = folder.render(&["--layers", "-D", "albedo=0", "--set", &connections]);
        assert_eq!(sum(&walls, "media"), 0.0);
        assert!(sum(&walls, "surfaces") > 1.0 && sum(&walls, "emission") > 1.0);
        assert_layers_add_up(&fog, "fog");
        assert_layers_add_up(&walls, "walls");
    }
}

/// The lamp's own body is the only wall that reflects.
fn sum_of_lamp_light_on_black(picture: &LayeredPicture) -> f64 {
    let channel = picture.channel("surfaces.G").unwrap();
    let lamp = picture.channel("emission.G").unwrap();
    let on_lamp = channel.iter().zip(lamp).filter(|(_, lamp)| **lamp > 0.0);
    on_lamp.map(|(value, _)| f64::from(*value)).sum()
}

#[test]
fn layers_work_in_wide_variants() {
    if llvm::llvm_or_skip("layers in wide variants").is_none() {
        return;
    }
    let (picture, metadata) = Folder::new().render(&["--layers", "--variant", "llvm_ad_rgb"]);
    assert_layers_add_up(&picture, "llvm_ad_rgb");
    assert_eq!(metadata.get_text("vpt.variant"), Some("llvm_ad_rgb"));
}

#[test]
fn layers_are_refused_where_no_file_can_hold_them() {
    let folder = Folder::new();
    let output = folder.run("picture.png", &["--layers"]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("--layers needs an EXR file"), "{message}");
}

/// Everything that it takes to render the picture again; the same command gives the same bytes.
#[test]
fn metadata_tell_how_the_picture_was_made() {
    let folder = Folder::new();
    let arguments = ["--seed", "7", "--set", "alpha=0.6", "-D", "wall=0.3"];
    let (_, metadata) = folder.render(&arguments);
    let stats = std::fs::read(folder.path("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
    let text =
        |name: &str| metadata.get_text(name).unwrap_or_else(|| panic!("no {name}")).to_owned();
    let number = |name: &str| match metadata.get(name) {
        Some(vpt::picture::Value::Number(number)) => *number,
        Some(vpt::picture::Value::Integer(integer)) => f64::from(*integer),
        other => panic!("{name} is {other:?}"),
    };
    assert_eq!(text("vpt.method"), "ppt");
    assert_eq!((number("vpt.seed"), number("vpt.passes"), number("vpt.sensor")), (7.0, 4.0, 0.0));
    assert_eq!(text("vpt.version"), env!("CARGO_PKG_VERSION"));
    assert_eq!((text("vpt.mitsuba"), text("vpt.variant")), ("3.9.1".into(), "scalar_rgb".into()));
    let parameters: serde_json::Value = serde_json::from_str(&text("vpt.parameters")).unwrap();
    assert_eq!(parameters, stats["parameters"]);
    assert!((parameters["alpha"].as_f64().unwrap() - 0.6).abs() < 1e-6);
    for (name, place) in [("first", "initial_radii"), ("last", "final_radii")] {
        for kind in ["surface", "medium"] {
            let told = number(&format!("vpt.{kind}_radius.{name}"));
            assert!((told / stats[place][kind].as_f64().unwrap() - 1.0).abs() < 1e-6);
        }
    }
    let error = stats["estimated_error"]["relative"].as_f64().unwrap();
    assert!((number("vpt.error") / error - 1.0).abs() < 1e-12);
    assert!(
        text("vpt.command").ends_with("--seed 7 --set alpha=0.6 -D wall=0.3"),
        "{}",
        text("vpt.command")
    );
    assert_eq!(
        text("generatedBy"),
        format!("vpt {} with Mitsuba 3.9.1", env!("CARGO_PKG_VERSION"))
    );

    let first = std::fs::read(folder.path("picture.exr")).unwrap();
    let (_, again) = folder.render(&arguments);
    assert_eq!(again, metadata);
    assert!(
        first == std::fs::read(folder.path("picture.exr")).unwrap(),
        "the same command, other bytes"
    );
    std::fs::write(folder.path("scene.xml"), format!("{ROOM}\n")).unwrap();
    let (_, other) = folder.render(&arguments);
    assert_ne!(other.get_text("vpt.scene_hash"), metadata.get_text("vpt.scene_hash"));
}

fn read_packet(stream: &mut TcpStream) -> Option<Vec<u8>> {
    let mut packet = vec![0; 4];
    stream.read_exact(&mut packet).ok()?;
    let length = u32::from_le_bytes(packet[..4].try_into().unwrap());
    packet.resize(length as usize, 0);
    stream.read_exact(&mut packet[4..]).unwrap();
    Some(packet)
}

/// The bytes are those of tev's protocol, as `src/cli/tev/packet.rs` has them written out; the last picture is the one that is written.
#[test]
fn a_viewer_gets_the_picture_as_it_is_rendered() {
    let folder = Folder::new();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let peer = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        std::iter::from_fn(|| read_packet(&mut stream)).collect::<Vec<_>>()
    });
    let (picture, _) = folder.render(&["--tev", &address, "--passes", "12"]);
    let packets = peer.join().unwrap();
    let name = folder.path("picture.exr").display().to_string();
    let text = |text: &str| [text.as_bytes(), b"\0"].concat();
    let numbers =
        |numbers: &[u32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>();
    let rgb = [text("R"), text("G"), text("B")].concat();
    let create = [vec![4, 1], text(&name), numbers(&[24, 20, 3]), rgb.clone()].concat();
    assert_eq!(packets[0][4..], create);
    let layout = [0_i64, 1, 2, 3, 3, 3].iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>();
    let head =
        [vec![6, 0], text(&name), numbers(&[3]), rgb, numbers(&[0, 0, 24, 20]), layout].concat();
    assert!(packets.len() >= 3, "{} packets", packets.len());
    for packet in &packets[1..] {
        assert_eq!(packet[4..4 + head.len()], head);
        assert_eq!(packet.len(), 4 + head.len() + 24 * 20 * 12);
    }
    let pixels = picture.rgb(None).unwrap();
    let expected: Vec<u8> = pixels.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    assert!(packets.last().unwrap()[4 + head.len()..] == expected, "the last picture is another");
}

#[test]
fn a_viewer_that_is_not_there_is_named_before_anything_is_rendered() {
    let folder = Folder::new();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    drop(listener);
    let output = folder.run("picture.exr", &["--tev", &address]);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1));
    assert!(message.contains(&format!("no viewer answers at {address}")), "{message}");
    assert!(!folder.path("picture.exr").exists());
    let output = folder.run("picture.exr", &["--tev", "nowhere"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn metrics_are_printed_and_pictures_of_two_sizes_refused() {
    let folder = Folder::new();
    folder.render(&["--layers", "--seed", "1"]);
    std::fs::rename(folder.path("picture.exr"), folder.path("reference.exr")).unwrap();
    folder.render(&["--layers", "--seed", "2"]);
    let metrics = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_vpt"))
            .arg("metrics")
            .args(arguments.iter().map(|name| {
                if name.ends_with("exr") {
                    folder.path(name)
                } else {
                    name.into()
                }
            }))
            .output()
            .unwrap()
    };
    let output = metrics(&["picture.exr", "reference.exr", "--json", "--layer", "media"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["relative_mse"].as_f64().unwrap() > 0.0 && json["layer"] == "media");
    let output = metrics(&["picture.exr", "picture.exr"]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("RMSE          0.000000e0") && text.contains("FLIP"), "{text}");
    let output = metrics(&["picture.exr", "nothing.exr"]);
    assert_eq!(output.status.code(), Some(2));
}
