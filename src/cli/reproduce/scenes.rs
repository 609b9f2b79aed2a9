//! The paper's scenes, and the files of the scenes that stand for them here.

use super::assets::{breakfast_hall, dragon, dragon_smokes, kitchen, Asset};
use anyhow::{Context, Result};
use clap::ValueEnum;
use std::fs;
use std::path::{Path, PathBuf};

/// A scene of the paper. [Collin 2013 §6]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PaperScene {
    DragonSmokes,
    BreakfastHall,
    Kitchen,
}

/// What the user wants reproduced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Choice {
    DragonSmokes,
    BreakfastHall,
    Kitchen,
    All,
}

impl Choice {
    pub fn scenes(self) -> &'static [PaperScene] {
        match self {
            Choice::DragonSmokes => &PaperScene::ALL[..1],
            Choice::BreakfastHall => &PaperScene::ALL[1..2],
            Choice::Kitchen => &PaperScene::ALL[2..],
            Choice::All => &PaperScene::ALL,
        }
    }
}

impl PaperScene {
    pub const ALL: [PaperScene; 3] =
        [PaperScene::DragonSmokes, PaperScene::BreakfastHall, PaperScene::Kitchen];

    /// As the paper has it, and the folder of its files.
    pub fn name(self) -> &'static str {
        match self {
            PaperScene::DragonSmokes => "dragon_smokes",
            PaperScene::BreakfastHall => "breakfast_hall",
            PaperScene::Kitchen => "kitchen",
        }
    }

    /// The scene's XML, which the program carries along so that it works wherever it is installed.
    fn xml(self) -> &'static str {
        match self {
            PaperScene::DragonSmokes => {
                include_str!("../../../mitsuba_scenes/dragon_smokes/scene.xml")
            }
            PaperScene::BreakfastHall => {
                include_str!("../../../mitsuba_scenes/breakfast_hall/scene.xml")
            }
            PaperScene::Kitchen => include_str!("../../../mitsuba_scenes/kitchen/scene.xml"),
        }
    }

    /// Writes the scene and all that it reads into a folder; returns the path of its XML. `own` is a mesh that takes
    /// the dragon's place.
    pub fn write(self, folder: &Path, own: Option<&Path>, say: impl Fn(&str)) -> Result<PathBuf> {
        let mut assets = match self {
            PaperScene::DragonSmokes => dragon_smokes::assets(),
            PaperScene::BreakfastHall => breakfast_hall::assets(),
            PaperScene::Kitchen => kitchen::assets(),
        };
        if self == PaperScene::DragonSmokes {
            assets.push(("dragon.ply", Asset::Mesh(dragon::dragon(own, say)?)));
        }
        for (name, asset) in assets {
            let path = folder.join(name);
            let written = asset.write(&path);
            written.with_context(|| format!("cannot write \"{}\"", path.display()))?;
        }
        let path = folder.join("scene.xml");
        fs::write(&path, self.xml())
            .with_context(|| format!("cannot write \"{}\"", path.display()))?;
        Ok(path)
    }
}
