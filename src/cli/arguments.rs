//! The arguments as they are typed; [`super::job`] gives them a meaning.

use super::reproduce::Choice;
use clap::builder::RangedU64ValueParser;
use clap::{ArgAction, Args, Parser, Subcommand};
use clap_complete::Shell;
use std::path::PathBuf;
use std::time::Duration;

/// Renders Mitsuba 3 scenes with progressive volume photon tracing.
#[derive(Debug, Parser)]
#[command(name = "vpt", version)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    Render(RenderArguments),
    Inspect(InspectArguments),
    Compare(CompareArguments),
    Reproduce(ReproduceArguments),
    Selftest(SelftestArguments),
    Metrics(MetricsArguments),
    Merge(MergeArguments),
    PluginDir(PluginDirArguments),
    Completions(CompletionsArguments),
    Man(ManArguments),
    /// Started by `compare`: one contestant in a process of its own.
    #[command(name = "contestant", hide = true)]
    Contestant,
}

/// Render a scene to a picture.
///
/// Ctrl-C ends the render after the current pass and writes the picture of the passes done; a
/// second Ctrl-C aborts at once, without a picture.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// Mitsuba scene (XML)
    pub scene: PathBuf,
    /// Picture to write; its extension chooses the format [default: SCENE's name with .exr]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Value of the scene's parameter $NAME; may be given more than once
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub defines: Vec<(String, String)>,
    /// Value of a parameter of the integrator, instead of the scene's; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub settings: Vec<(String, String)>,
    /// Method, instead of the scene's
    #[arg(long, value_name = "NAME")]
    pub method: Option<String>,
    /// Photon passes [default: the samples per pixel of the scene's sampler; without end if --target-error
    /// is given]; or a range of them, A..B or A.., whose sums are written as a part, for `vpt merge` to add up with others
    #[arg(long, value_name = "N|A..B", allow_negative_numbers = true, value_parser = parse_passes)]
    pub passes: Option<Passes>,
    /// Keep what the passes so far brought in this file, which survives whatever ends the render; Ctrl-C writes it, too
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// Time between checkpoints, such as 30s or 5m
    #[arg(long, value_name = "TIME", value_parser = parse_span, requires = "checkpoint", default_value = "60s")]
    pub every: Duration,
    /// Go on where the checkpoint ends; without one, begin
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,
    /// Wall time after which no new pass starts
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub timeout: Option<f64>,
    /// Estimated relative error at which the render ends (0.01 is 1 %); --passes and --timeout may end it
    /// before
    #[arg(long, value_name = "E", allow_negative_numbers = true)]
    pub target_error: Option<f64>,
    /// What to simulate: auto (what the scene calls for), all, or effects to add to what it calls for, with commas
    /// between; `vpt inspect` lists them
    #[arg(long, value_name = "LIST")]
    pub effects: Option<String>,
    /// Seed of the random numbers
    #[arg(long, value_name = "S", allow_negative_numbers = true, default_value_t = 0)]
    pub seed: u32,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "T", allow_negative_numbers = true,
          value_parser = RangedU64ValueParser::<usize>::new().range(1..))]
    pub threads: Option<usize>,
    /// Mitsuba variant: scalar_rgb, scalar_spectral, or llvm_ad or cuda_ad with _rgb, _mono or _spectral
    #[arg(long, value_name = "V")]
    pub variant: Option<String>,
    /// Index of the scene's sensor, from 0
    #[arg(long, value_name = "I", allow_negative_numbers = true, default_value_t = 0)]
    pub sensor: usize,
    /// Write what was done, counted and timed, to this file (JSON)
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Write layers, too: radiance of surfaces, of media and of direct emission, which add up to the picture, its estimated
    /// error, and the photons that each pixel got (EXR)
    #[arg(long)]
    pub layers: bool,
    /// Show the picture in tev as it is rendered; tev listens at 127.0.0.1:14158
    #[arg(long, value_name = "HOST:PORT")]
    pub tev: Option<String>,
    /// Print Mitsuba's log too; twice for more of it
    #[arg(short, long, action = ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print warnings and errors alone
    #[arg(short, long)]
    pub quiet: bool,
}

/// Say what a scene calls for, what will be simulated, why, and what it costs.
///
/// Traces the view rays once and shoots a share of one pass, as the scene calls for it and with every effect forced
/// on. The work is counted per jitter of the view rays or per pass.
#[derive(Debug, Args)]
pub struct InspectArguments {
    /// Mitsuba scene (XML)
    pub scene: PathBuf,
    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,
    /// Value of the scene's parameter $NAME; may be given more than once
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub defines: Vec<(String, String)>,
    /// Value of a parameter of the integrator, instead of the scene's; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub settings: Vec<(String, String)>,
    /// Method, instead of the scene's
    #[arg(long, value_name = "NAME")]
    pub method: Option<String>,
    /// Effects to force on; see `vpt render --help`
    #[arg(long, value_name = "LIST")]
    pub effects: Option<String>,
    /// Mitsuba variant: scalar_rgb, scalar_spectral, or llvm_ad or cuda_ad with _rgb, _mono or _spectral
    #[arg(long, value_name = "V")]
    pub variant: Option<String>,
    /// Index of the scene's sensor, from 0
    #[arg(long, value_name = "I", allow_negative_numbers = true, default_value_t = 0)]
    pub sensor: usize,
    /// Print Mitsuba's log too; twice for more of it
    #[arg(short, long, action = ArgAction::Count)]
    pub verbose: u8,
}

/// Measure what accuracy costs in time: methods and integrators side by side, and a report.
///
/// Every method renders the scene for the same wall time; pictures on the way are held against a
/// reference. Ctrl-C ends early and writes the report of what was measured; the same command goes on
/// where that or a crash ended it, with the runs that were not complete.
#[derive(Debug, Args)]
pub struct CompareArguments {
    /// Mitsuba scene (XML)
    pub scene: PathBuf,
    /// Methods of vpt (ppt, ppbt, ppt_metro, ppbt_metro, apa, ppb) and Mitsuba's integrators;
    /// NAME@VARIANT renders in another variant than the others, and NAME+PARAMETER=VALUE with another parameter
    #[arg(
        long,
        value_name = "NAMES",
        value_delimiter = ',',
        default_value = "ppt_metro,ppt,apa,ppb,volpath"
    )]
    pub methods: Vec<String>,
    /// Wall time of each method, for each seed
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, default_value_t = 60.0)]
    pub time: f64,
    /// Repetitions with other random numbers; their spread is shown
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 2,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub seeds: u32,
    /// Reference picture (EXR) [default: one is rendered, and kept in the folder]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["reference_time", "reference_method"])]
    pub reference: Option<PathBuf>,
    /// Who renders the reference: a method or integrator, or auto, by a trial of Mitsuba's path
    /// tracer for the scene and ppt
    #[arg(long, value_name = "NAME", default_value = "auto")]
    pub reference_method: String,
    /// Wall time for the rendered reference [default: four times --time]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub reference_time: Option<f64>,
    /// Folder for the report [default: SCENE's name with -compare]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Start anew where the folder holds a comparison that was interrupted
    #[arg(long)]
    pub restart: bool,
    /// Value of the scene's parameter $NAME; may be given more than once
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub defines: Vec<(String, String)>,
    /// Value of a parameter of vpt's integrator, for all its methods; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub settings: Vec<(String, String)>,
    /// Mitsuba variant: scalar_rgb, scalar_spectral, or llvm_ad or cuda_ad with _rgb, _mono or _spectral
    #[arg(long, value_name = "V")]
    pub variant: Option<String>,
    /// Index of the scene's sensor, from 0
    #[arg(long, value_name = "I", allow_negative_numbers = true, default_value_t = 0)]
    pub sensor: usize,
    /// Print Mitsuba's log too; twice for more of it
    #[arg(short, long, action = ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print warnings and errors alone
    #[arg(short, long)]
    pub quiet: bool,
}

/// Repeat the paper's measurements: its methods on scenes of its kind, and what they say of its claims.
///
/// Errors over time as in the paper's Fig. 4, crops as in its Fig. 5 to 7, with the parameters of its Table 2. Every scene
/// gets a folder in DIR with its files and the report; DIR/claims.md holds the verdicts. Ctrl-C ends early and judges by what
/// was measured.
#[derive(Debug, Args)]
pub struct ReproduceArguments {
    /// Scene of the paper, or all
    #[arg(value_name = "SCENE")]
    pub choice: Choice,
    /// Time for each scene, such as 90s, 5m or 2h: a quarter for the reference, the rest divided equally among methods
    /// and seeds; memory is measured on top [default: 10m, or the paper's hours with --paper]
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    pub budget: Option<Duration>,
    /// Repetitions with other random numbers; without a second one no claim can be decided
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(1..))]
    pub seeds: u32,
    /// Resolution and rendering times of the paper, each method for hours
    #[arg(long)]
    pub paper: bool,
    /// Mitsuba scene (XML) in place of the project's
    #[arg(long = "scene", value_name = "FILE")]
    pub file: Option<PathBuf>,
    /// Value of the scene's parameter $NAME; may be given more than once
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = parse_pair)]
    pub defines: Vec<(String, String)>,
    /// Mesh (PLY or OBJ) in place of the Stanford dragon, which npm fetches
    #[arg(long, value_name = "FILE")]
    pub dragon: Option<PathBuf>,
    /// Reference picture (EXR) [default: one is rendered, and kept in the folder]
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// Folder for scenes, reports and claims
    #[arg(short, long, value_name = "DIR", default_value = "reproduction")]
    pub output: PathBuf,
    /// Start anew where the folder holds a measurement that was interrupted
    #[arg(long)]
    pub restart: bool,
    /// Leave out how memory grows with photons, which takes about a minute for each scene
    #[arg(long)]
    pub no_memory: bool,
    /// Write the scenes into the folder, and render nothing
    #[arg(long)]
    pub prepare: bool,
    /// Mitsuba variant: scalar_rgb, scalar_spectral, or llvm_ad or cuda_ad with _rgb, _mono or _spectral
    #[arg(long, value_name = "V")]
    pub variant: Option<String>,
    /// Print Mitsuba's log too; twice for more of it
    #[arg(short, long, action = ArgAction::Count, conflicts_with = "quiet")]
    pub verbose: u8,
    /// Print warnings and errors alone
    #[arg(short, long)]
    pub quiet: bool,
}

/// Render extreme scenes whose answer is known, and print how far the program is off.
///
/// Every line is a case and its worst reading; z is how far it is off in standard errors of its noise. The exit code is
/// 1 if a case failed.
#[derive(Debug, Args)]
pub struct SelftestArguments {
    /// Cases to run [default: all]
    #[arg(value_name = "NAME")]
    pub names: Vec<String>,
    /// Print the cases and what they assert, and run nothing
    #[arg(long)]
    pub list: bool,
    /// Write every reading to this file (JSON)
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Mitsuba variant: scalar_rgb, scalar_spectral, or llvm_ad or cuda_ad with _rgb, _mono or _spectral
    #[arg(long, value_name = "V")]
    pub variant: Option<String>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "T", allow_negative_numbers = true,
          value_parser = RangedU64ValueParser::<usize>::new().range(1..))]
    pub threads: Option<usize>,
    /// Print what failed alone
    #[arg(short, long)]
    pub quiet: bool,
}

/// Print how far a picture is from another: RMSE, relative MSE, FLIP.
///
/// The second picture is the reference: the relative error divides by it, and FLIP exposes both pictures by its brightness; the
/// RMSE alone is the same both ways. Pixels that are no finite numbers in either are left out, counted and named.
#[derive(Debug, Args)]
pub struct MetricsArguments {
    /// Picture to judge (EXR)
    pub picture: PathBuf,
    /// Reference to hold it against (EXR)
    pub reference: PathBuf,
    /// Compare the channels NAME.R, NAME.G and NAME.B, or NAME.Y [default: R, G and B, or Y]
    #[arg(long, value_name = "NAME")]
    pub layer: Option<String>,
    /// Print everything as JSON
    #[arg(long)]
    pub json: bool,
}

/// Add up parts of a picture that were rendered apart.
///
/// Parts are what `vpt render --passes A..B` and `--checkpoint` write; their names do not matter. In `scalar_rgb` with photons that
/// are shot uniformly the picture is, bit by bit, that of one render of all passes. Parts of other scenes, parameters, seeds,
/// variants or versions are refused, and so are passes that come twice; passes that are missing are told.
#[derive(Debug, Args)]
pub struct MergeArguments {
    /// Parts to add up
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Picture to write; its extension chooses the format: exr, png, jpg or ppm
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Write a part again instead of a picture
    #[arg(long)]
    pub part: bool,
    /// Print warnings and errors alone
    #[arg(short, long)]
    pub quiet: bool,
}

/// Print a folder that the stock `mitsuba -a DIR` finds the plugin in.
///
/// The plugin is copied to DIR/plugins. In Python, give DIR to mi.file_resolver().append().
#[derive(Debug, Args)]
pub struct PluginDirArguments {
    /// Folder to fill [default: vpt-plugins next to the program, or in the user's cache folder]
    pub dir: Option<PathBuf>,
}

/// Print a script that completes the program's commands and options in a shell.
///
/// For bash: vpt completions bash > ~/.local/share/bash-completion/completions/vpt
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// Shell that reads the script
    pub shell: Shell,
}

/// Write the manual pages of the program and of all its commands.
///
/// For man to find them: vpt man ~/.local/share/man/man1
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Folder for vpt.1, vpt-render.1 and so on; it is made if need be
    pub dir: PathBuf,
}

/// How many passes to render, or which.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Passes {
    Count(u32),
    /// Without an end, up to the number that there would be without a range.
    Range {
        first: u32,
        end: Option<u32>,
    },
}

/// `N`, `A..B` or `A..`
fn parse_passes(text: &str) -> Result<Passes, String> {
    let number = |text: &str| {
        text.trim().parse::<u32>().map_err(|_| {
            format!(
                "{text:?} is no number of passes; write N, or a range A..B or A.., such as 0..8"
            )
        })
    };
    let Some((first, end)) = text.split_once("..") else {
        return match number(text)? {
            0 => Err("there must be at least 1 pass".into()),
            count => Ok(Passes::Count(count)),
        };
    };
    let first = number(first)?;
    let end = if end.trim().is_empty() { None } else { Some(number(end)?) };
    match end {
        Some(end) if end <= first => Err(format!(
            "the range is empty: it ends before pass {end}, which must be behind its first, {first}; write A..B with B above A"
        )),
        _ => Ok(Passes::Range { first, end }),
    }
}

/// `NAME=VALUE`; the value may be empty or hold more `=`.
fn parse_pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() && !name.contains(char::is_whitespace) => {
            Ok((name.to_owned(), value.to_owned()))
        }
        Some(_) => Err("the name before '=' is empty or holds a space; write NAME=VALUE".into()),
        None => Err("it has no '='; write NAME=VALUE".into()),
    }
}

/// A number with a unit.
fn parse_span(text: &str) -> Result<Duration, String> {
    match humantime::parse_duration(text) {
        Ok(span) if !span.is_zero() => Ok(span),
        _ => Err(
            "it is no span of time above 0; write a number with its unit, such as 90s, 5m or 2h"
                .into(),
        ),
    }
}

#[cfg(test)]
impl RenderArguments {
    /// The arguments of `vpt render`, as the parser reads them.
    pub fn parse(words: &[&str]) -> Result<Self, clap::Error> {
        let argv = ["vpt", "render"].iter().chain(words);
        match Arguments::try_parse_from(argv)?.command {
            Command::Render(arguments) => Ok(arguments),
            _ => unreachable!("the command is render"),
        }
    }
}

#[cfg(test)]
impl CompareArguments {
    /// The arguments of `vpt compare`, as the parser reads them.
    pub fn parse(words: &[&str]) -> Result<Self, clap::Error> {
        let argv = ["vpt", "compare"].iter().chain(words);
        match Arguments::try_parse_from(argv)?.command {
            Command::Compare(arguments) => Ok(arguments),
            _ => unreachable!("the command is compare"),
        }
    }
}

#[cfg(test)]
impl ReproduceArguments {
    /// The arguments of `vpt reproduce`, as the parser reads them.
    pub fn parse(words: &[&str]) -> Result<Self, clap::Error> {
        let argv = ["vpt", "reproduce"].iter().chain(words);
        match Arguments::try_parse_from(argv)?.command {
            Command::Reproduce(arguments) => Ok(arguments),
            _ => unreachable!("the command is reproduce"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn pair_splits_at_the_first_equals_sign() {
        assert_eq!(parse_pair("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert_eq!(parse_pair("a="), Ok(("a".into(), String::new())));
        assert!(parse_pair("a").unwrap_err().contains("no '='"));
        assert!(parse_pair("=b").unwrap_err().contains("empty"));
        assert!(parse_pair("a b=c").unwrap_err().contains("space"));
    }

    #[test]
    fn passes_are_a_number_or_a_range() {
        assert_eq!(parse_passes("16"), Ok(Passes::Count(16)));
        assert_eq!(parse_passes("0..8"), Ok(Passes::Range { first: 0, end: Some(8) }));
        assert_eq!(parse_passes("8 .. 16"), Ok(Passes::Range { first: 8, end: Some(16) }));
        assert_eq!(parse_passes("8.."), Ok(Passes::Range { first: 8, end: None }));
        for (text, part) in [
            ("0", "at least 1"),
            ("-3", "no number of passes"),
            ("8..8", "is empty"),
            ("8..4", "is empty"),
            ("..8", "no number of passes"),
            ("0..=8", "no number of passes"),
            ("0...8", "no number of passes"),
            ("a..b", "\"a\""),
            ("4294967296", "no number of passes"),
            ("", "no number of passes"),
        ] {
            let error = parse_passes(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }

    #[test]
    fn span_has_a_unit() {
        assert_eq!(parse_span("5m"), Ok(Duration::from_secs(300)));
        assert_eq!(parse_span("1h 30m"), Ok(Duration::from_secs(5400)));
        for text in ["5", "0s", "-3s", "soon", ""] {
            assert!(parse_span(text).unwrap_err().contains("such as 90s"), "{text}");
        }
    }

    #[test]
    fn mistakes_name_their_argument() {
        for (words, named) in [
            (&["s.xml", "-D", "radius"][..], "-D"),
            (&["s.xml", "--set", "=1"], "--set"),
            (&["s.xml", "--passes", "0"], "--passes"),
            (&["s.xml", "--passes", "-3"], "--passes"),
            (&["s.xml", "--passes", "many"], "--passes"),
            (&["s.xml", "--passes", "8..4"], "--passes"),
            (&["s.xml", "--resume"], "--checkpoint"),
            (&["s.xml", "--every", "5m"], "--checkpoint"),
            (&["s.xml", "--checkpoint", "c", "--every", "5"], "--every"),
            (&["s.xml", "--threads", "0"], "--threads"),
            (&["s.xml", "--seed", "-1"], "--seed"),
            (&["s.xml", "--sensor", "-1"], "--sensor"),
            (&["s.xml", "--timeout", "soon"], "--timeout"),
            (&["s.xml", "--target-error", "low"], "--target-error"),
            (&["s.xml", "-v", "-q"], "--quiet"),
            (&[], "<SCENE>"),
        ] {
            let message = RenderArguments::parse(words).unwrap_err().to_string();
            assert!(message.contains(named), "{words:?}: {message}");
        }
    }
}
