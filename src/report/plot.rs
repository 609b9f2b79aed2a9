//! Errors over time, log-log, as SVG and PNG.

use super::curve::BandPoint;
use super::results::{Comparison, Metric};
use super::summary::method_band;
use image::RgbImage;
use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{register_font, FontStyle};
use std::ops::Range;
use std::sync::Once;

const SIZE: (u32, u32) = (900, 560);
const FONT: &str = "sans-serif";

/// Okabe and Ito's colours, which colour-blind people tell apart.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(140, 110, 40),
];

/// A plot that cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("cannot draw the plot of {metric}: {cause}")]
pub struct PlotError {
    metric: &'static str,
    cause: String,
}

/// One measure of all methods over time.
pub struct Chart {
    metric: Metric,
    series: Vec<Series>,
    /// The reference's own noise.
    floor: Option<f64>,
}

struct Series {
    name: String,
    ours: bool,
    band: Vec<BandPoint>,
}

impl Chart {
    pub fn new(comparison: &Comparison, metric: Metric) -> Self {
        let series = comparison.methods.iter().map(|method| Series {
            name: super::text::marked_name(method),
            ours: method.ours,
            band: method_band(method, metric),
        });
        let noise = comparison.reference.noise.as_ref();
        let floor = noise.and_then(|noise| metric.of_noise(noise)).filter(|&floor| floor > 0.0);
        Chart { metric, series: series.collect(), floor }
    }

    pub fn svg(&self) -> Result<String, PlotError> {
        let mut text = String::new();
        self.draw(&SVGBackend::with_string(&mut text, SIZE).into_drawing_area())?;
        Ok(text)
    }

    pub fn png(&self) -> Result<RgbImage, PlotError> {
        let mut bytes = vec![0; (SIZE.0 * SIZE.1 * 3) as usize];
        self.draw(&BitMapBackend::with_buffer(&mut bytes, SIZE).into_drawing_area())?;
        RgbImage::from_raw(SIZE.0, SIZE.1, bytes)
            .ok_or_else(|| self.error("its size is impossible"))
    }

    fn error(&self, cause: impl ToString) -> PlotError {
        PlotError { metric: self.metric.title(), cause: cause.to_string() }
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), PlotError> {
        provide_font();
        area.fill(&WHITE).map_err(|e| self.error(e))?;
        let mut builder = ChartBuilder::on(area);
        builder.caption(format!("{} over time", self.metric.title()), (FONT, 22));
        builder.margin(12).x_label_area_size(44).y_label_area_size(76);
        let (times, errors) = self.ranges();
        let mut chart = builder
            .build_cartesian_2d(times.clone().log_scale(), errors.log_scale())
            .map_err(|e| self.error(e))?;
        configure_mesh(&mut chart, self.metric.title()).map_err(|e| self.error(e))?;
        for (index, series) in self.series.iter().enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            draw_series(&mut chart, series, colour).map_err(|e| self.error(e))?;
        }
        if let Some(floor) = self.floor {
            draw_floor(&mut chart, times, floor).map_err(|e| self.error(e))?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .label_font((FONT, 14))
            .draw()
            .map_err(|e| self.error(e))?;
        area.present().map_err(|e| self.error(e))
    }

    /// What the axes show: all points and the floor, with some room.
    fn ranges(&self) -> (Range<f64>, Range<f64>) {
        let points = || self.series.iter().flat_map(|series| &series.band);
        let times = points().map(|point| point.seconds);
        let errors = points().flat_map(|point| [point.low, point.high]).chain(self.floor);
        (padded(times, 1.1), padded(errors, 1.3))
    }
}

/// The font of pictures; without it they need one of the system's, which may have none.
fn provide_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let font = dejavu::sans::regular();
        assert!(register_font(FONT, FontStyle::Normal, font).is_ok(), "the font is a constant");
    });
}

fn padded(values: impl Iterator<Item = f64>, factor: f64) -> Range<f64> {
    let (low, high) =
        values.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return 0.1..10.0;
    }
    // An axis of less than a factor of two has hardly a label.
    let room = (2.0 * low / high).max(1.0).sqrt() * factor;
    low / room..high * room
}

type LogChart<'a, 'b, B> = ChartContext<'a, B, Cartesian2d<LogCoord, LogCoord>>;
type LogCoord = plotters::coord::combinators::LogCoord<f64>;
type DrawResult<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

fn configure_mesh<B: DrawingBackend>(chart: &mut LogChart<B>, title: &str) -> DrawResult<B>
where
    LogCoord: ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .x_desc("seconds")
        .y_desc(title)
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 16))
        .bold_line_style(BLACK.mix(0.15))
        .light_line_style(BLACK.mix(0.05))
        .draw()
}

/// The band over the seeds, the mean, and the measured points.
fn draw_series<B: DrawingBackend>(
    chart: &mut LogChart<B>,
    series: &Series,
    colour: RGBColor,
) -> DrawResult<B> {
    let upper = series.band.iter().map(|point| (point.seconds, point.high));
    let lower = series.band.iter().rev().map(|point| (point.seconds, point.low));
    let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
    chart.draw_series(std::iter::once(Polygon::new(outline, colour.mix(0.18))))?;
    let means: Vec<(f64, f64)> =
        series.band.iter().map(|point| (point.seconds, point.mean)).collect();
    let style = colour.stroke_width(2);
    let (dash, gap) = if series.ours { (1, 0) } else { (7, 5) };
    let drawn = if series.ours {
        chart.draw_series(LineSeries::new(means.clone(), style))?
    } else {
        chart.draw_series(DashedLineSeries::new(means.clone(), dash, gap, style))?
    };
    let width = if series.ours { 3 } else { 1 };
    drawn.label(series.name.clone()).legend(move |(x, y)| {
        PathElement::new(vec![(x, y), (x + 18, y)], colour.stroke_width(width))
    });
    chart.draw_series(means.into_iter().map(|point| Circle::new(point, 3, colour.filled())))?;
    Ok(())
}

fn draw_floor<B: DrawingBackend>(
    chart: &mut LogChart<B>,
    times: Range<f64>,
    floor: f64,
) -> DrawResult<B> {
    let style = BLACK.mix(0.5);
    let line = vec![(times.start, floor), (times.end, floor)];
    chart
        .draw_series(DashedLineSeries::new(line, 2, 4, style.into()))?
        .label("noise of the reference")
        .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], style));
    Ok(())
}

/// `0.002`, `20`, `3e-6`.
fn tick(value: f64) -> String {
    if (1e-4..1e5).contains(&value) {
        let digits = (-value.log10().floor()).max(0.0) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::summary::tests::comparison;

    #[test]
    fn svg_names_the_methods_and_png_is_not_blank() {
        let chart = Chart::new(&comparison(), Metric::Rmse);
        let svg = chart.svg().unwrap();
        for part in ["<svg", "ppt", "volpath", "noise of the reference", "seconds"] {
            assert!(svg.contains(part), "{part}");
        }
        assert!(chart.png().unwrap().pixels().any(|pixel| pixel.0 == [0, 114, 178]));
    }

    #[test]
    fn nothing_measured_gives_empty_axes() {
        let mut comparison = comparison();
        comparison.methods.iter_mut().for_each(|method| method.runs.clear());
        comparison.reference.noise = None;
        assert!(Chart::new(&comparison, Metric::Flip).svg().unwrap().contains("FLIP"));
    }

    #[test]
    fn ticks_are_plain_in_the_middle() {
        for (value, text) in [(0.002, "0.002"), (20.0, "20"), (3e-6, "3e-6")] {
            assert_eq!(tick(value), text);
        }
    }
}
