//! How tests judge estimates: by Student's t-test with its power, against integrals that are exact to many
//! more digits than the tests look at.

pub mod quadrature;
pub mod t_test;
