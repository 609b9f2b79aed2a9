//! What comparisons are measured and shown by: pictures, errors against a reference, curves over time, and
//! the files that hold them. Stands alone: it knows neither scenes nor methods.
//!
//! ```text
//! picture                   linear RGB, EXR in and out
//! metrics, flip             errors of a picture against a reference
//! halves                    noise and disagreement of renders without a reference
//! curve                     errors over time: rates, times to an error, bands over seeds
//! results                   everything that was measured, as written to results.json
//! summary                   what the results come to, method by method
//! display, plot, crops      pictures and curves made visible
//! csv, html, table          the results for programs, for the eye, for the terminal
//! ```

mod axis;
mod cells;
pub mod crops;
pub mod csv;
pub mod curve;
pub mod display;
pub mod flip;
pub mod halves;
pub mod html;
pub mod metrics;
pub mod picture;
pub mod plot;
pub mod results;
pub mod summary;
pub mod table;
mod text;
