//! What can be wrong with a comparison.

use super::folder::FolderError;
use crate::cli::job::JobError;
use std::path::PathBuf;
use vpt::method::Method;
use vpt::report::picture::PictureError;

/// A mistake in the arguments of a comparison, with the mend.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    #[error(transparent)]
    Common(#[from] JobError),
    #[error(
        "--methods holds an empty name; write names with commas between them, such as ppt,volpath"
    )]
    EmptyMethod,
    #[error("--methods has the parameter \"{0}\"; write NAME=VALUE, such as ppt+connections=true")]
    BadSetting(String),
    #[error(
        "--methods gives \"{0}\" parameters, but only vpt's methods take some; leave them out"
    )]
    SettingsOfMitsubas(String),
    #[error("--methods names \"{0}\" twice; keep one of them")]
    MethodTwice(String),
    #[error("{option} is {seconds}, but must be a number of seconds above 0")]
    Seconds { option: &'static str, seconds: f64 },
    #[error("--reference cannot be used")]
    Reference(#[from] PictureError),
    #[error(
        "the reference \"{}\" has {} x {} pixels, but the scene's film has {} x {}; render one of that size, \
         or leave --reference out", .path.display(), .found[0], .found[1], .wanted[0], .wanted[1]
    )]
    ReferenceSize { path: PathBuf, found: [usize; 2], wanted: [usize; 2] },
    #[error("the reference \"{}\" is black, so no error can be told relative to it", .0.display())]
    ReferenceBlack(PathBuf),
    #[error(
        "the folder \"{}\" holds an interrupted comparison with other settings: {}; go on with the same, name another \
         folder with -o, or start anew with --restart", .folder.display(), .differences.join(", ")
    )]
    OtherSettings { folder: PathBuf, differences: Vec<String> },
    #[error("--reference-method is \"{0}\", but the reference has the comparison's variant; leave \"@...\" out")]
    ReferenceVariant(String),
    #[error("the folder (-o) cannot be used")]
    Folder(#[from] FolderError),
    #[error(
        "unknown method or integrator \"{name}\"; use vpt's {ours}, or one of Mitsuba's, such as volpath, \
         volpathmis, path or ptracer"
    )]
    UnknownMethod { name: String, ours: String },
}

impl CompareError {
    /// Neither vpt nor Mitsuba knows the name.
    pub fn unknown_method(name: &str) -> Self {
        let ours = Method::ALL.map(Method::name).join(", ");
        CompareError::UnknownMethod { name: name.to_owned(), ours }
    }
}
