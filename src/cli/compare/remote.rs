//! Contestants in another variant than the program's: Mitsuba has one variant per process, so they render in one
//! of their own. They take turns like all others: a process that is not asked does nothing.

use super::contestants::Contestant;
use super::error::CompareError;
use super::kernels;
use super::meaning::{Ground, Meaning};
use super::meter::Meter;
use super::protocol::{receive, receive_pixels, send, send_pixels, Order, Reply, Request};
use crate::cli::failure::Failure;
use crate::cli::job::check_sensor;
use anyhow::{anyhow, bail, Context, Result};
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use tempfile::TempDir;
use vpt::host::session::Session;
use vpt::report::picture::Picture;
use vpt::report::results::Phase;

/// The command that makes this program such a process.
pub const COMMAND: &str = "contestant";

/// A contestant in a process of its own, as the comparison sees it.
pub struct Remote {
    name: String,
    process: Child,
    /// None once the process was told to end.
    requests: Option<ChildStdin>,
    replies: BufReader<ChildStdout>,
    preparation: f64,
    work: u64,
    memory: Option<u64>,
    phases: Vec<Phase>,
    _kernels: TempDir,
}

impl Remote {
    /// Starts the process and waits until it is ready to render.
    pub fn start(order: &Order) -> Result<Self> {
        let kernels = kernels::empty_folder()?;
        let program = std::env::current_exe().context("cannot tell where this program is")?;
        let mut command = Command::new(program);
        command.arg(COMMAND).stdin(Stdio::piped()).stdout(Stdio::piped());
        // Ctrl-C in the terminal is for the comparison alone.
        command.env(kernels::VARIABLE, kernels.path()).process_group(0);
        let mut process = command.spawn().context("cannot start this program once more")?;
        let (requests, replies) = (process.stdin.take(), process.stdout.take());
        let mut remote = Remote {
            name: format!("{}@{}", order.integrator, order.variant),
            process,
            requests,
            replies: BufReader::new(replies.expect("its stdout is a pipe")),
            preparation: 0.0,
            work: 0,
            memory: None,
            phases: Vec::new(),
            _kernels: kernels,
        };
        let Reply::Ready { preparation } = remote.ask(order)? else {
            bail!("the process of {} answers out of turn", remote.name)
        };
        remote.preparation = preparation;
        Ok(remote)
    }

    /// Seconds that preparing the scene took, once it was loaded.
    pub fn preparation(&self) -> f64 {
        self.preparation
    }

    fn ask(&mut self, request: &impl serde::Serialize) -> Result<Reply> {
        let requests = self.requests.as_mut().expect("it was not told to end");
        let reply = send(requests, request).and_then(|()| receive(&mut self.replies));
        match reply {
            Ok(Some(Reply::Failed(sentence))) => Err(anyhow!("{}: {sentence}", self.name)),
            Ok(Some(reply)) => Ok(reply),
            Ok(None) | Err(_) => Err(self.lost()),
        }
    }

    /// The process ended or says what cannot be understood.
    fn lost(&mut self) -> anyhow::Error {
        self.requests = None;
        match self.process.wait() {
            Ok(status) => anyhow!("the process that renders {} ended with {status}", self.name),
            Err(error) => anyhow!("lost the process that renders {}: {error}", self.name),
        }
    }
}

impl Contestant for Remote {
    fn advance(&mut self) -> Result<()> {
        match self.ask(&Request::Advance)? {
            Reply::Advanced { work, memory } => (self.work, self.memory) = (work, memory),
            _ => bail!("the process of {} answers out of turn", self.name),
        }
        Ok(())
    }

    fn picture(&mut self) -> Result<Picture> {
        let Reply::Picture { width, height, phases } = self.ask(&Request::Show)? else {
            bail!("the process of {} answers out of turn", self.name)
        };
        self.phases = phases;
        receive_pixels(&mut self.replies, width, height).map_err(|_| self.lost())
    }

    fn work(&self) -> u64 {
        self.work
    }

    /// As of the last picture.
    fn phases(&self) -> Vec<Phase> {
        self.phases.clone()
    }

    fn memory(&self) -> Option<u64> {
        self.memory
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        // The end of its stdin tells the process to end.
        self.requests = None;
        let _ = self.process.wait();
    }
}

/// The process of one contestant: does what it is asked on stdin until that ends.
pub fn serve() -> Result<(), Failure> {
    let (mut requests, mut replies) = (io::stdin().lock(), io::stdout().lock());
    let Err(error) = obey(&mut requests, &mut replies) else { return Ok(()) };
    let sentence = Failure::failed(error).message();
    // Where nobody listens any more, there is nobody to tell.
    let _ = send(&mut replies, &Reply::Failed(sentence));
    Ok(())
}

fn obey(requests: &mut impl BufRead, replies: &mut impl Write) -> Result<()> {
    let order = receive::<Order>(requests).context("vpt compare starts this command by itself")?;
    let Some(order) = order else { return Ok(()) };
    // Mitsuba's log goes to stdout, which is taken: it stays silent.
    let session = Session::start(Some(&order.variant), None, 0)?;
    let scene = session.load(&order.file())?;
    check_sensor(order.sensor, scene.sensor_count(), &order.scene).map_err(CompareError::Common)?;
    let (sensor, size) = (order.sensor, scene.film_size(order.sensor));
    let ground = Ground { session: &session, scene: &scene, sensor, size };
    let meaning = Meaning::find(&order.integrator, &session, &scene.parameters(sensor)?)?;
    let preparation = meaning.prepare(&ground, order.seed)?;
    let mut contestant =
        meaning.contestant(&ground, preparation.as_ref(), order.seed, order.slice)?;
    let seconds = preparation.as_ref().map_or(0.0, |preparation| preparation.seconds);
    send(replies, &Reply::Ready { preparation: seconds })?;
    let mut meter = Meter::default();
    while let Some(request) = receive(requests)? {
        match request {
            Request::Advance => {
                meter.around(|| contestant.advance())?;
                let (work, memory) = (contestant.work(), meter.most());
                send(replies, &Reply::Advanced { work, memory })?;
            }
            Request::Show => show(&mut *contestant, replies)?,
        }
    }
    Ok(())
}

fn show(contestant: &mut dyn Contestant, replies: &mut impl Write) -> Result<()> {
    let picture = contestant.picture()?;
    let (width, height, phases) = (picture.width, picture.height, contestant.phases());
    send(replies, &Reply::Picture { width, height, phases })?;
    Ok(send_pixels(replies, &picture)?)
}
