//! Errors over time, log-log, as SVG and PNG.

use super::axis::{label, LogAxis};
use super::curve::BandPoint;
use super::results::{Comparison, Metric};
use super::summary::method_band;
use image::RgbImage;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::{register_font, FontStyle};
use std::ops::Range;
use std::sync::Once;

const SIZE: (u32, u32) = (980, 520);
/// Width of the legend at the right.
const LEGEND: u32 = 210;
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

/// Of the line at the reference's noise.
const FLOOR: RGBAColor = RGBAColor(0, 0, 0, 0.6);

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
        let (plot, legend) = area.split_horizontally(SIZE.0 - LEGEND);
        self.draw_plot(&plot).map_err(|e| self.error(e))?;
        self.draw_legend(&legend).map_err(|e| self.error(e))?;
        area.present().map_err(|e| self.error(e))
    }

    fn draw_plot<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> DrawResult<B> {
        let mut builder = ChartBuilder::on(area);
        builder.caption(format!("{} over time", self.metric.title()), (FONT, 22));
        builder.margin(12).x_label_area_size(44).y_label_area_size(76);
        let (times, errors) = self.ranges();
        let mut chart =
            builder.build_cartesian_2d(LogAxis::new(times.clone()), LogAxis::new(errors))?;
        configure_mesh(&mut chart, self.metric.title())?;
        for (index, series) in self.series.iter().enumerate() {
            draw_series(&mut chart, series, COLOURS[index % COLOURS.len()])?;
        }
        match self.floor {
            Some(floor) => draw_floor(&mut chart, times, floor),
            None => Ok(()),
        }
    }

    /// A line as it is drawn and its name, one below the other.
    fn draw_legend<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> DrawResult<B> {
        let line = |index: usize| 56 + 24 * index as i32;
        for (index, series) in self.series.iter().enumerate() {
            let style = COLOURS[index % COLOURS.len()].stroke_width(3);
            draw_sample(area, line(index), if series.ours { &[30] } else { &[8, 8] }, style)?;
            area.draw(&Text::new(series.name.clone(), (38, line(index) - 7), (FONT, 14)))?;
        }
        if self.floor.is_some() {
            let y = line(self.series.len());
            draw_sample(area, y, &[3, 3, 3], FLOOR.into())?;
            area.draw(&Text::new("noise of the reference", (38, y - 7), (FONT, 14)))?;
        }
        Ok(())
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

type LogChart<'a, 'b, B> = ChartContext<'a, B, Cartesian2d<LogAxis, LogAxis>>;
type DrawResult<B> = Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// Dashes of the given lengths, over the width of a sample in the legend.
fn draw_sample<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    y: i32,
    dashes: &[i32],
    style: ShapeStyle,
) -> DrawResult<B> {
    let step = 32 / dashes.len() as i32;
    for (index, length) in dashes.iter().enumerate() {
        let x = index as i32 * step;
        area.draw(&PathElement::new(vec![(x, y), (x + length, y)], style))?;
    }
    Ok(())
}

fn configure_mesh<B: DrawingBackend>(chart: &mut LogChart<B>, title: &str) -> DrawResult<B> {
    chart
        .configure_mesh()
        .x_desc("seconds")
        .y_desc(title)
        .x_label_formatter(&|value| label(*value))
        .y_label_formatter(&|value| label(*value))
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 16))
        .bold_line_style(BLACK.mix(0.15))
        .light_line_style(TRANSPARENT)
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
    if series.ours {
        chart.draw_series(LineSeries::new(means.clone(), style))?;
    } else {
        chart.draw_series(DashedLineSeries::new(means.clone(), 7, 5, style))?;
    }
    chart.draw_series(means.into_iter().map(|point| Circle::new(point, 3, colour.filled())))?;
    Ok(())
}

fn draw_floor<B: DrawingBackend>(
    chart: &mut LogChart<B>,
    times: Range<f64>,
    floor: f64,
) -> DrawResult<B> {
    let line = vec![(times.start, floor), (times.end, floor)];
    chart.draw_series(DashedLineSeries::new(line, 2, 4, FLOOR.into()))?;
    Ok(())
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
}
