//! A folder with a scene in which the program runs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;
use vpt::picture::LayeredPicture;

/// A lamp in view (so that emission has rays of its own), a floor and a ball of fog; no photons given, so that a pilot chooses them.
pub const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="vpt"/>
    <default name="reflectance" value="0.5"/>
    <sensor type="perspective">
        <float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0,-5,1" target="0,0,1.3" up="0,0,1"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="16"/><integer name="height" value="12"/>
        </film>
        <sampler type="independent"><integer name="sample_count" value="6"/></sampler>
    </sensor>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="150"/><translate z="3"/></transform>
        <emitter type="area"><rgb name="radiance" value="4"/></emitter>
    </shape>
    <shape type="rectangle">
        <transform name="to_world"><scale value="4"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="$reflectance"/></bsdf>
    </shape>
    <shape type="sphere">
        <point name="center" x="0" y="0" z="1"/><float name="radius" value="1"/>
        <bsdf type="null"/>
        <medium name="interior" type="homogeneous">
            <rgb name="sigma_t" value="1"/><rgb name="albedo" value="0.8"/>
        </medium>
    </shape>
</scene>
"#;

pub struct Desk {
    folder: TempDir,
}

/// What a finished program said.
pub struct Said {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

impl Desk {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.xml"), SCENE).unwrap();
        Desk { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_vpt"));
        command.args(line.split_whitespace()).current_dir(self.folder.path());
        command.stdin(Stdio::null());
        command
    }

    pub fn run(&self, line: &str) -> Said {
        Said::of(self.command(line).output().unwrap())
    }

    /// Runs what must succeed.
    pub fn must(&self, line: &str) -> Said {
        let said = self.run(line);
        assert_eq!(said.code, Some(0), "{line}: {}", said.err);
        said
    }

    /// Runs what must be refused with one message that holds all the parts.
    pub fn refused(&self, line: &str, parts: &[&str]) {
        let said = self.run(line);
        assert_eq!(said.code, Some(2), "{line}: {}{}", said.out, said.err);
        assert_eq!(said.err.matches("error: ").count(), 1, "{line}: {}", said.err);
        for part in parts {
            assert!(said.err.contains(part), "{line}: no {part:?} in: {}", said.err);
        }
    }

    /// The bits of every channel of a picture.
    pub fn bits(&self, name: &str) -> BTreeMap<String, Vec<u32>> {
        bits(&self.path(name))
    }
}

impl Said {
    pub fn of(output: Output) -> Self {
        Said {
            code: output.status.code(),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

fn bits(path: &Path) -> BTreeMap<String, Vec<u32>> {
    let (picture, _) = LayeredPicture::read(path).unwrap();
    let channels = picture.channels.into_iter();
    channels.map(|c| (c.name, c.values.iter().map(|value| value.to_bits()).collect())).collect()
}
