//! The report: one HTML file that needs nothing else.

use super::crops::{self, Crop};
use super::curve::Reached;
use super::display::{difference, png, Exposure};
use super::picture::Picture;
use super::plot::{Chart, PlotError};
use super::results::{Comparison, Metric, Phase, Run};
use super::summary::{summarize, Summary, TimeTo, LEVELS};
use super::{cells, text};
use base64::prelude::{Engine, BASE64_STANDARD};
use image::RgbImage;
use std::fmt::Write;

const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// Parts of the pictures that are shown enlarged.
const CROPS: usize = 3;
/// Width [CSS pixels] that small pictures are enlarged to.
const STAGE: usize = 720;

/// The pictures of a comparison.
pub struct Pictures {
    pub reference: Picture,
    /// The last picture of each method's first seed, by name; None where there is none.
    pub methods: Vec<Option<Picture>>,
}

/// The report as HTML.
pub fn report(comparison: &Comparison, pictures: &Pictures) -> Result<String, PlotError> {
    let summaries = summarize(comparison);
    let mut body = header(comparison);
    body += &section("Time to an error", &summary_table(comparison, &summaries));
    body += &section("Error over time", &plots(comparison)?);
    let shown = shown(comparison, pictures);
    let crops = crops_of(&shown);
    body += &section("Pictures", &slider(&shown, &crops));
    body += &section("Details", &details(&shown, &crops));
    body += &section("Differences", &differences(&shown));
    body += &section("Time and memory", &costs(comparison));
    body += &section("How to read this", EXPLANATION);
    let title = escape(&comparison.scene);
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><title>vpt compare: {title}</title>\
         <style>{STYLE}</style></head>\n<body>{body}<script>{SCRIPT}</script></body></html>\n"
    ))
}

const EXPLANATION: &str = "<p>Every method was given the same wall time, alone on the machine: the one that has \
    used least goes on next, for one pass or one small render. Its preparation counts, the loading of the scene \
    and the measuring do not. <b>Error</b> is the root of the relative MSE: the mean over pixels and channels of \
    (x − r)² / (r² + (m/10)²), m being the reference's mean, its brightest hundredth counted as the least of it. <b>FLIP</b> is LDR-FLIP at 67 pixels per degree, in \
    [0, 1]. <b>Rate</b> is the exponent of time that the RMSE follows; independent samples have −0.5. Times are \
    interpolated along the mean over the seeds, ranges are those of the seeds. The <b>factor</b> below a time is the \
    fastest Mitsuba integrator's time over the method's: above 1 is faster than Mitsuba. The bands in the plots span \
    the seeds. No error can be told \
    from the noise of the reference below the dashed line.</p>\
    <p>NAME@VARIANT rendered in a process of its own, as Mitsuba has one variant per process; compiling its kernels \
    counts. The folder of this report holds every picture of the first seed and the last one of the others as EXR, \
    named in results.json.</p>\
    <p>In the differences red is too bright and blue too dark; full colour is half of the reference's value.</p>";

fn section(title: &str, body: &str) -> String {
    format!("<section><h2>{title}</h2>\n{body}</section>\n")
}

fn header(comparison: &Comparison) -> String {
    let [width, height] = comparison.film_size;
    let mut out = format!(
        "<h1>{}</h1><p>{width} × {height} pixels, {}, {} s for each method and seed, seeds: {}; vpt {}.</p>",
        escape(&comparison.scene),
        escape(&comparison.variant),
        text::number(comparison.seconds),
        comparison.seeds,
        escape(&comparison.version)
    );
    let reference = &comparison.reference;
    let _ = write!(out, "<p>Reference: {}", escape(&reference.origin));
    match reference.noise {
        Some(noise) => {
            let relative = text::percent(noise.relative_mse.sqrt());
            let bias = comparison
                .reference
                .bias
                .map_or(String::new(), |bias| format!(", its bias about {}", text::percent(bias)));
            let rmse = text::number(noise.rmse);
            let _ = write!(out, "; its own noise is {relative} (RMSE {rmse}){bias}.");
        }
        None => out += "; its own noise is not known.",
    }
    out += "</p>";
    if comparison.interrupted {
        out += "<p class=\"note\">The comparison was interrupted: it holds what was measured until then.</p>";
    }
    for note in &comparison.notes {
        let _ = write!(out, "<p class=\"note remark\">{}</p>", escape(note));
    }
    out
}

fn summary_table(comparison: &Comparison, summaries: &[Summary]) -> String {
    let mut out = String::from(
        "<div class=\"scroll\"><table><tr><th>method<th>error<th>RMSE<th>FLIP<th>rate",
    );
    for level in LEVELS {
        let _ = write!(out, "<th>to {} %", 100.0 * level);
    }
    for (method, summary) in comparison.methods.iter().zip(summaries) {
        let _ = write!(out, "<tr><td>{}", escape(&text::marked_name(method)));
        match summary.last {
            Some(errors) => {
                let relative = text::percent(errors.relative());
                let (rmse, flip) = (text::number(errors.rmse), text::number(errors.flip));
                let _ = write!(out, "<td>{relative}<td>{rmse}<td>{flip}");
            }
            None => out += "<td>–<td>–<td>–",
        }
        let _ = write!(out, "<td>{}", cells::rate(summary));
        out.extend(summary.times.iter().map(time_cell));
    }
    out += "</table></div>";
    for line in text::explained_marks(comparison) {
        let _ = write!(out, "<p class=\"note\">{}</p>", escape(&line));
    }
    out
}

/// The time to an error, its range over the seeds, and the ratio to Mitsuba.
fn time_cell(time: &TimeTo) -> String {
    if time.reached == Reached::Never {
        return "<td class=\"quiet\">not reached".to_owned();
    }
    let range = time.range.map_or(String::new(), |[fast, slow]| {
        format!("<small>{} – {} s</small>", text::number(fast), text::number(slow))
    });
    let factor = time.speed_up.map_or(String::new(), |factor| {
        format!("<small><b>{} ×</b></small>", text::number(factor))
    });
    format!("<td>{}{range}{factor}", escape(&cells::reached(time)))
}

fn plots(comparison: &Comparison) -> Result<String, PlotError> {
    let mut out = String::new();
    for metric in Metric::ALL {
        let svg = Chart::new(comparison, metric).svg()?;
        let _ = write!(out, "<figure class=\"plot\">{svg}</figure>");
    }
    Ok(out)
}

/// Names and pictures of what was rendered, the reference first.
fn shown<'a>(comparison: &'a Comparison, pictures: &'a Pictures) -> Vec<(&'a str, &'a Picture)> {
    let methods = comparison.methods.iter().zip(&pictures.methods);
    let methods = methods.filter_map(|(m, picture)| Some((m.name.as_str(), picture.as_ref()?)));
    std::iter::once(("reference", &pictures.reference)).chain(methods).collect()
}

/// Where the methods differ most from the reference, which is the first of those shown.
fn crops_of(shown: &[(&str, &Picture)]) -> Vec<Crop> {
    let others: Vec<&Picture> = shown[1..].iter().map(|(_, picture)| *picture).collect();
    crops::choose(shown[0].1, &others, CROPS)
}

/// Two pictures behind one edge that moves, and below it all pictures; without scripts these alone.
fn slider(shown: &[(&str, &Picture)], crops: &[Crop]) -> String {
    let reference = shown[0].1;
    let exposure = Exposure::of(reference);
    let [width, height] = reference.size();
    let frames: String =
        crops.iter().enumerate().map(|(index, crop)| frame(index, crop, reference)).collect();
    let mut out = format!(
        "<div id=\"viewer\" hidden><div class=\"controls\">\
         <label>left <select id=\"left\">{}</select></label> \
         <label>right <select id=\"right\">{}</select></label> \
         <button id=\"flip\" type=\"button\">flip (F)</button> \
         <label><input id=\"frames\" type=\"checkbox\" checked> frames of the details</label></div>\
         <div id=\"stage\" style=\"aspect-ratio:{width}/{height};max-width:{}px\">\
         <img id=\"below\" alt=\"right picture\"><img id=\"above\" alt=\"left picture\"><div id=\"edge\"></div>\
         {frames}<span class=\"tag\" id=\"left-tag\"></span><span class=\"tag\" id=\"right-tag\"></span></div>\
         <input id=\"split\" type=\"range\" min=\"0\" max=\"100\" value=\"50\" style=\"max-width:{}px\" \
         aria-label=\"share of the left picture\"></div><div class=\"strip\">",
        options(shown, usize::from(shown.len() > 1)),
        options(shown, 0),
        width.max(STAGE),
        width.max(STAGE)
    );
    for (name, picture) in shown {
        out += &figure("source", name, &exposure.show(picture));
    }
    out + "</div>"
}

fn options(shown: &[(&str, &Picture)], chosen: usize) -> String {
    let option = |(index, (name, _)): (usize, &(&str, &Picture))| {
        let selected = if index == chosen { " selected" } else { "" };
        format!("<option value=\"{index}\"{selected}>{}</option>", escape(name))
    };
    shown.iter().enumerate().map(option).collect()
}

/// The outline of a crop, with its number.
fn frame(index: usize, crop: &Crop, picture: &Picture) -> String {
    let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole as f64;
    format!(
        "<div class=\"frame\" style=\"left:{:.3}%;top:{:.3}%;width:{:.3}%;height:{:.3}%\">{}</div>",
        percent(crop.x, picture.width),
        percent(crop.y, picture.height),
        percent(crop.width, picture.width),
        percent(crop.height, picture.height),
        index + 1
    )
}

fn details(shown: &[(&str, &Picture)], crops: &[Crop]) -> String {
    let exposure = Exposure::of(shown[0].1);
    let images: Vec<(&str, RgbImage)> =
        shown.iter().map(|(name, picture)| (*name, exposure.show(picture))).collect();
    let row = |(index, crop): (usize, &Crop)| {
        let figures: String =
            images.iter().map(|(name, image)| figure("crop", name, &crop.cut(image))).collect();
        let Crop { x, y, width, height } = crop;
        format!(
            "<h3>{}: {width} × {height} pixels from ({x}, {y})</h3><div class=\"strip\">{figures}</div>",
            index + 1
        )
    };
    crops.iter().enumerate().map(row).collect()
}

fn differences(shown: &[(&str, &Picture)]) -> String {
    let figures = shown[1..]
        .iter()
        .map(|(name, picture)| figure("difference", name, &difference(picture, shown[0].1)));
    format!("<div class=\"row\">{}</div>", figures.collect::<String>())
}

/// An image with its name, by a class of the style sheet.
fn figure(class: &str, name: &str, image: &RgbImage) -> String {
    let (data, name) = (BASE64_STANDARD.encode(png(image)), escape(name));
    format!(
        "<figure class=\"{class}\"><img alt=\"{name}\" src=\"data:image/png;base64,{data}\">\
         <figcaption>{name}</figcaption></figure>"
    )
}

/// Where the time of the first seed went, and the memory.
fn costs(comparison: &Comparison) -> String {
    let mut out = String::from(
        "<div class=\"scroll\"><table><tr><th>method<th>work<th class=\"phases\">time by phase<th>own memory at its peak",
    );
    for method in &comparison.methods {
        let Some(run) = method.runs.first() else { continue };
        let bars: String = match run.phases.is_empty() {
            true => "<span class=\"quiet\">one phase: rendering</span>".to_owned(),
            false => bars(run),
        };
        let unit = if method.ours { "passes" } else { "samples per pixel" };
        let _ = write!(
            out,
            "<tr><td>{}<td>{} {unit}<td class=\"phases\">{bars}<td>{}",
            escape(&method.name),
            run.work,
            text::memory(run.peak_memory_bytes)
        );
    }
    let whole = text::memory(comparison.peak_memory_bytes);
    out + &format!(
        "</table></div><p>The whole program, with all methods of its variant side by side, held {whole} at its peak.</p>"
    )
}

/// Phases of a run as bars.
fn bars(run: &Run) -> String {
    let total: f64 = run.phases.iter().map(|phase| phase.seconds).sum();
    let bar = |phase: &Phase| {
        let share = 100.0 * phase.seconds / total.max(f64::MIN_POSITIVE);
        format!(
            "<div class=\"phase\"><span>{}</span><span class=\"track\"><span class=\"bar\" \
             style=\"width:{share:.1}%\"></span></span><span>{} s</span></div>",
            escape(&phase.name),
            format_args!("{:.2}", phase.seconds)
        )
    };
    run.phases.iter().map(bar).collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::summary::tests::comparison;

    fn pictures() -> Pictures {
        let grey = |value: f32| Picture::from_fn(8, 6, |_, _| [value; 3]);
        Pictures { reference: grey(1.0), methods: vec![Some(grey(1.1)), None] }
    }

    #[test]
    fn report_is_self_contained_and_escaped() {
        let html = report(&comparison(), &pictures()).unwrap();
        assert_eq!(html.matches("<svg").count(), Metric::ALL.len());
        assert!(html.contains("a &lt;b&gt;.xml") && !html.contains("a <b>"));
        let links: Vec<_> =
            html.match_indices("src=\"").map(|(i, _)| &html[i + 5..i + 20]).collect();
        assert!(links.iter().all(|link| link.starts_with("data:image/png")), "{links:?}");
        for outside in ["<link", "@import", "url(", "<script src"] {
            assert!(!html.contains(outside), "{outside}");
        }
    }

    #[test]
    fn report_tells_noise_interruption_and_notes() {
        let mut comparison = comparison();
        comparison.interrupted = true;
        let html = report(&comparison, &pictures()).unwrap();
        for part in
            ["its own noise is 1.00 %", "was interrupted", "a note", "not reached", "3.00 MiB"]
        {
            assert!(html.contains(part), "{part}");
        }
    }
}
