//! Metropolis chains that steer photons to where they are seen. [Hachisuka 2011] [Collin 2013 §5.2]
//!
//! A walk is a function of its uniform numbers `u`, a point in primary sample space. For one family, the
//! photons on surfaces or those in media, let `f(u)` be what a walk adds to the picture and
//! `V(u) = 1` where that is not zero, else 0. Two streams of walks run side by side:
//!
//! - the *uniform stream* draws `u` afresh. The share of its walks with `V = 1` estimates the visible
//!   share `b`, the volume of the visible part of primary sample space;
//! - *chains* of each family walk on the visible part by small mutations. Their states are uniform on it,
//!   so `E f = b · mean of f over states`.
//!
//! The two families share the uniform stream; chains, mutation size and normalisation are their own.
//!
//! # Why a pass is unbiased
//!
//! Chains start, and are replaced, at visible walks of the uniform stream alone (`chains`). Such a
//! walk is uniform on the visible part, mutations keep that distribution, and which chains are replaced
//! depends on nothing but *whether* uniform walks were visible and on independent dice. So, given the
//! visibility of all uniform walks, every state is uniform on the visible part, and `b`, which is a
//! function of that visibility, is not correlated with the mean of `f`: `E[b̂ · mean f] = b E[f | V]`.
//! No burn-in is owed to the start. The mutation size adapts to the chains' own history, ever more
//! slowly; that alone is unbiased only in the limit.
//!
//! Radii shrink from pass to pass, and with them the visible part: states that fall out of it are
//! dropped, those that stay are uniform on what is left. New view rays see another part, so with each
//! jitter chains start anew.

mod batches;
mod chains;
mod mutation;
mod recorded;
mod shooter;
mod state;
mod trails;

pub use chains::{ChainCounts, Population};
pub use mutation::{Mutation, MutationSize};
pub use shooter::{ChainShooter, FamilyReport, Mode};
