//! Shows how a render gets on: a bar on a terminal, a few plain lines elsewhere.

use super::interrupt::Interrupt;
use super::{say, text};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::ops::ControlFlow;
use std::time::Duration;
use vpt::markov::{FamilyReport, Mode};
use vpt::method::{Observer, Progress};

/// What is shown.
#[derive(Debug, Clone)]
pub enum Display {
    /// One line that is drawn again and again.
    Bar(ProgressBar),
    /// A line at the start and about every tenth of the work.
    Lines,
    Nothing,
}

impl Display {
    /// A bar on stderr, which appears with the first progress.
    pub fn bar() -> Self {
        let style = ProgressStyle::with_template("[{bar:16}] {pos}/{len} passes, {elapsed}{msg}")
            .expect("the template is a constant");
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        bar.set_style(style.progress_chars("=> "));
        Display::Bar(bar)
    }

    /// Prints a line without tearing the bar.
    pub fn say(&self, line: &str) {
        match self {
            Display::Bar(bar) if bar.length().is_some() => bar.suspend(|| say(line)),
            Display::Bar(_) | Display::Lines => say(line),
            Display::Nothing => {}
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Display::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Shows the progress of a render and ends it when the user asks for that.
pub struct Reporter {
    display: Display,
    interrupt: Interrupt,
    timeout: Option<f64>,
    /// Tenths of the work for which a line was printed.
    tenths: u32,
    /// Passes asked for, once the render said so.
    passes: u32,
}

impl Reporter {
    pub fn new(display: Display, interrupt: Interrupt, timeout: Option<f64>) -> Self {
        Reporter { display, interrupt, timeout, tenths: 0, passes: 0 }
    }

    /// Passes asked for; 0 before the render began.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    fn show(&mut self, progress: &Progress) {
        if progress.passes_done == 0 {
            let radii = progress.radii;
            self.display.say(&format!(
                "radii of the first pass: {:.3e} on surfaces, {:.3e} in media",
                radii.surface, radii.medium
            ));
        }
        match &self.display {
            Display::Bar(bar) => {
                let first = bar.length().is_none();
                bar.set_message(details(progress, self.timeout));
                bar.set_length(progress.passes.into());
                bar.set_position(progress.passes_done.into());
                if first {
                    // A pass can be long: the clock runs on meanwhile.
                    bar.enable_steady_tick(Duration::from_millis(250));
                }
            }
            Display::Lines => {
                let tenths = (share_done(progress, self.timeout) * 10.0) as u32;
                if tenths > self.tenths {
                    self.tenths = tenths;
                    say(&line(progress, self.timeout));
                }
            }
            Display::Nothing => {}
        }
    }
}

impl Observer for Reporter {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.passes = progress.passes;
        self.show(progress);
        if self.interrupt.requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// Share of the work that is done, by passes or by the timeout, whichever ends it first.
fn share_done(progress: &Progress, timeout: Option<f64>) -> f64 {
    let passes = f64::from(progress.passes_done) / f64::from(progress.passes.max(1));
    let time = timeout.map_or(0.0, |timeout| progress.seconds / timeout);
    passes.max(time).min(1.0)
}

/// Seconds that are left, while some are and there is a pass to judge by.
fn seconds_left(progress: &Progress, timeout: Option<f64>) -> Option<f64> {
    let Progress { passes_done, passes, seconds, .. } = *progress;
    if passes_done == 0 || passes_done >= passes {
        return None;
    }
    let left = seconds / f64::from(passes_done) * f64::from(passes - passes_done);
    Some(timeout.map_or(left, |timeout| left.min(timeout - seconds)).max(0.0))
}

/// `, 12 s left, timeout 60 s, 1.20 M photons/s, radii 1.00e-2 surface, 2.00e-2 medium`
fn details(progress: &Progress, timeout: Option<f64>) -> String {
    let mut parts = vec![String::new()];
    if let Some(left) = seconds_left(progress, timeout) {
        parts.push(format!("{} left", text::seconds(left)));
    }
    if let Some(timeout) = timeout {
        parts.push(format!("timeout {}", text::seconds(timeout)));
    }
    if progress.seconds > 0.0 && progress.walks > 0 {
        let rate = progress.walks as f64 / progress.seconds;
        parts.push(format!("{} photons/s", text::count(rate)));
    }
    parts.push(format!("radii {} surface", text::length(progress.radii.surface)));
    parts.push(format!("{} medium", text::length(progress.radii.medium)));
    parts.extend(shooting("surfaces", &progress.shooting.surface));
    parts.extend(shooting("media", &progress.shooting.medium));
    parts.join(", ")
}

/// `media by chains (0.12 % visible, 23 % accepted)`; nothing where a method does not measure.
fn shooting(family: &str, report: &FamilyReport) -> Option<String> {
    let visible = text::percent(report.visible_share);
    match report.mode {
        Mode::Off => None,
        Mode::Uniform => Some(format!("{family} uniformly ({visible} visible)")),
        Mode::Metropolis => {
            let accepted = text::percent(report.acceptance);
            Some(format!("{family} by chains ({visible} visible, {accepted} accepted)"))
        }
    }
}

/// The line of plain progress after a pass.
fn line(progress: &Progress, timeout: Option<f64>) -> String {
    format!(
        "pass {} of {}, {}{}",
        progress.passes_done,
        progress.passes,
        text::seconds(progress.seconds),
        details(progress, timeout)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use vpt::density::radius::Radii;
    use vpt::transport::photon::PerFamily;

    fn progress(passes_done: u32, seconds: f64) -> Progress {
        let radii = Radii { surface: 0.01, medium: 0.02 };
        let walks = u64::from(passes_done) * 1_000_000;
        let shooting = PerFamily::default();
        Progress { passes_done, passes: 20, walks, radii, seconds, shooting }
    }

    #[test]
    fn time_left_is_the_nearer_of_passes_and_timeout() {
        assert_eq!(seconds_left(&progress(0, 1.0), None), None);
        assert_eq!(seconds_left(&progress(20, 1.0), None), None);
        assert_eq!(seconds_left(&progress(5, 10.0), None), Some(30.0));
        assert_eq!(seconds_left(&progress(5, 10.0), Some(25.0)), Some(15.0));
        assert_eq!(seconds_left(&progress(5, 10.0), Some(9.0)), Some(0.0));
    }

    #[test]
    fn share_counts_passes_or_time() {
        assert_eq!(share_done(&progress(5, 10.0), None), 0.25);
        assert_eq!(share_done(&progress(5, 10.0), Some(20.0)), 0.5);
        assert_eq!(share_done(&progress(5, 10.0), Some(5.0)), 1.0);
    }

    #[test]
    fn line_says_everything() {
        assert_eq!(
            line(&progress(5, 2.5), Some(60.0)),
            "pass 5 of 20, 2.50 s, 7.50 s left, timeout 1 min 0 s, 2.00 M photons/s, \
             radii 1.00e-2 surface, 2.00e-2 medium"
        );
    }

    #[test]
    fn line_says_how_photons_are_shot() {
        let uniform =
            FamilyReport { mode: Mode::Uniform, visible_share: 0.341, ..Default::default() };
        let chains = FamilyReport {
            mode: Mode::Metropolis,
            visible_share: 0.00123,
            acceptance: 0.2345,
            ..Default::default()
        };
        let shooting = PerFamily { surface: uniform, medium: chains };
        let line = line(&Progress { shooting, ..progress(5, 2.5) }, None);
        assert!(
            line.ends_with(
                ", surfaces uniformly (34 % visible), media by chains (0.12 % visible, 23 % accepted)"
            ),
            "{line}"
        );
    }

    #[test]
    fn reporter_ends_the_render_when_asked() {
        let interrupt = Interrupt::default();
        let mut reporter = Reporter::new(Display::Nothing, interrupt.clone(), None);
        assert_eq!(reporter.progress(&progress(0, 0.0)), ControlFlow::Continue(()));
        assert_eq!(reporter.passes(), 20);
        interrupt.request();
        assert_eq!(reporter.progress(&progress(1, 1.0)), ControlFlow::Break(()));
    }
}
