//! How the program ends when it does not succeed.

use std::process::ExitCode;

/// Exit code of work that failed.
pub const FAILED: u8 = 1;
/// Exit code of arguments or scenes that must be mended.
pub const BAD_INPUT: u8 = 2;
/// Exit code of a program that Ctrl-C aborted, as shells have it: 128 + SIGINT.
pub const ABORTED: u8 = 130;

/// An error, and the exit code that it ends the program with.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    error: anyhow::Error,
}

impl Failure {
    /// The work failed through no fault of the arguments.
    pub fn failed(error: impl Into<anyhow::Error>) -> Self {
        Failure { code: FAILED, error: error.into() }
    }

    /// The user has to mend the arguments or the scene.
    pub fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Failure { code: BAD_INPUT, error: error.into() }
    }

    /// The user stopped the program before it had a result.
    pub fn aborted(error: impl Into<anyhow::Error>) -> Self {
        Failure { code: ABORTED, error: error.into() }
    }

    pub fn exit_code(&self) -> ExitCode {
        ExitCode::from(self.code)
    }

    /// The chain of errors as one message. A cause that the message already holds (many errors
    /// print their source) is not repeated.
    pub fn message(&self) -> String {
        let mut message = String::new();
        for error in self.error.chain() {
            let text = error.to_string();
            if message.is_empty() {
                message = text;
            } else if !message.contains(&text) {
                message.push_str(": caused by ");
                message.push_str(&text);
            }
        }
        message
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn message_holds_every_cause_once() {
        let error = anyhow!("disk full").context("cannot write: disk full").context("no picture");
        assert_eq!(
            Failure::failed(error).message(),
            "no picture: caused by cannot write: disk full"
        );
        let error = anyhow!("no such file").context("cannot read");
        assert_eq!(Failure::bad_input(error).message(), "cannot read: caused by no such file");
    }
}
