//! Batches that suit chains.

use crate::scene::Batching;
use crate::transport::target::Target;

/// Lanes per batch where several threads work side by side: small, so that each gets some.
const CONCURRENT_LANES: u64 = 64;

/// How a job of `walks` likes its batches: where threads work side by side, of equal size, so that none
/// waits long for another.
pub(super) fn batching(target: &Target, walks: u64) -> Batching {
    let batching = target.scene.batching();
    if !batching.concurrent {
        return batching;
    }
    let batches = walks.div_ceil(CONCURRENT_LANES).max(1);
    Batching { lanes: walks.div_ceil(batches).max(1) as usize, ..batching }
}
