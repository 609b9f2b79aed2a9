//! Ctrl-C: the first asks the render to end after the current pass, the second aborts at once.

use super::failure::ABORTED;
use signal_hook::consts::SIGINT;
use signal_hook::iterator::Signals;
use signal_hook::low_level;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

/// Whether the user asked the render to end.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
}

impl Interrupt {
    /// Listens for Ctrl-C from now on; `say` tells the user that it was heard.
    pub fn listen(say: impl Fn() + Send + 'static) -> io::Result<Self> {
        let interrupt = Interrupt::default();
        let heard = interrupt.clone();
        let mut signals = Signals::new([SIGINT])?;
        std::thread::Builder::new().name("interrupt".into()).spawn(move || {
            for _ in signals.forever() {
                if heard.request() {
                    // Without destructors, which would pull the renderer from under its threads.
                    low_level::exit(ABORTED.into());
                }
                say();
            }
        })?;
        Ok(interrupt)
    }

    /// Asks the render to end; tells whether that had been asked before.
    pub fn request(&self) -> bool {
        self.requested.swap(true, Ordering::Relaxed)
    }

    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }
}
