//! What `vpt compare` and a contestant in a process of its own say to each other: lines of JSON on the
//! contestant's stdin and stdout, a picture's numbers as raw bytes after its line.

use super::entrant::Entrant;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, BufRead, Read, Write};
use std::path::PathBuf;
use vpt::host::session::SceneFile;
use vpt::report::picture::Picture;
use vpt::report::results::Phase;

/// What to render; the first line.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Order {
    pub scene: PathBuf,
    pub defines: Vec<(String, String)>,
    pub settings: Vec<(String, String)>,
    pub integrator: String,
    pub variant: String,
    pub sensor: usize,
    pub seed: u32,
    /// Seconds of one small render of Mitsuba's.
    pub slice: f64,
}

/// What is asked of the contestant.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Request {
    /// Make a step.
    Advance,
    /// Show the picture of all steps so far.
    Show,
}

/// What it answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// To the order: the scene is loaded, and the preparation took so many seconds.
    Ready { preparation: f64 },
    /// To [`Request::Advance`]: the passes or samples per pixel so far, and the most memory [bytes] it held.
    Advanced { work: u64, memory: Option<u64> },
    /// To [`Request::Show`]; the pixels follow.
    Picture { width: usize, height: usize, phases: Vec<Phase> },
    /// It cannot go on, in one sentence.
    Failed(String),
}

impl Order {
    /// Of a contestant without seed and slice.
    pub fn new(entrant: &Entrant, file: &SceneFile, sensor: usize) -> Self {
        Order {
            scene: file.path.clone(),
            defines: file.defines.clone(),
            settings: file.settings.iter().chain(&entrant.settings).cloned().collect(),
            integrator: entrant.integrator.clone(),
            variant: entrant.variant.clone(),
            sensor,
            seed: 0,
            slice: 1.0,
        }
    }

    pub fn file(&self) -> SceneFile {
        SceneFile {
            path: self.scene.clone(),
            defines: self.defines.clone(),
            settings: self.settings.clone(),
            ..SceneFile::default()
        }
    }
}

/// Writes one message as a line.
pub fn send(to: &mut impl Write, message: &impl Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(message)?;
    line.push(b'\n');
    to.write_all(&line)?;
    to.flush()
}

/// Reads one message; None at the end.
pub fn receive<T: DeserializeOwned>(from: &mut impl BufRead) -> io::Result<Option<T>> {
    let mut line = String::new();
    match from.read_line(&mut line)? {
        0 => Ok(None),
        _ => Ok(Some(serde_json::from_str(&line)?)),
    }
}

/// Writes a picture's numbers, little-endian, row by row.
pub fn send_pixels(to: &mut impl Write, picture: &Picture) -> io::Result<()> {
    let bytes: Vec<u8> =
        picture.pixels.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    to.write_all(&bytes)?;
    to.flush()
}

/// Reads what [`send_pixels`] wrote.
pub fn receive_pixels(from: &mut impl Read, width: usize, height: usize) -> io::Result<Picture> {
    let mut bytes = vec![0; 12 * width * height];
    from.read_exact(&mut bytes)?;
    let value = |pixel: &[u8], c: usize| {
        f32::from_le_bytes([pixel[4 * c], pixel[4 * c + 1], pixel[4 * c + 2], pixel[4 * c + 3]])
    };
    let pixels = bytes.chunks_exact(12).map(|pixel| [0, 1, 2].map(|c| value(pixel, c))).collect();
    Ok(Picture { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_and_pixels_arrive_as_they_were_sent() {
        let picture = Picture::from_fn(3, 2, |x, y| [x as f32, -0.1 * y as f32, f32::MAX]);
        let reply = Reply::Picture { width: 3, height: 2, phases: Vec::new() };
        let mut wire = Vec::new();
        send(&mut wire, &Request::Show).unwrap();
        send(&mut wire, &reply).unwrap();
        send_pixels(&mut wire, &picture).unwrap();
        let mut from = wire.as_slice();
        assert_eq!(receive(&mut from).unwrap(), Some(Request::Show));
        assert_eq!(receive(&mut from).unwrap(), Some(reply));
        assert_eq!(receive_pixels(&mut from, 3, 2).unwrap(), picture);
        assert_eq!(receive::<Request>(&mut from).unwrap(), None);
    }
}
