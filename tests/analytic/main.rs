//! Renders of scenes whose radiance can be worked out on paper, judged by statistics.
//!
//! Every test states its derivation. Lengths, radiances and fluxes are in units of the scene; `N`
//! is the number of emitted walks. Where a kernel of finite width blurs the answer, either the
//! answer is flat, or the blur is part of the expected value, or its size is bounded and given to
//! the comparison as `bias`.
//!
//! By default a fault of 1 % is noticed. `VPT_TEST_EFFORT=100` renders a hundred times as much and
//! notices a tenth of that.

mod arithmetic;
mod batches;
mod connections;
mod convergence;
mod furnace;
mod guided;
mod memory;
mod room;
mod scenes;
mod single_scattering;
mod surface;
mod transmittance;
mod wavelengths;
