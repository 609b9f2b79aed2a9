//! The table of `vpt selftest`, by the same code.

use std::sync::Arc;
use vpt::selftest::{self, judge, Bench};

/// Every case runs, so that one run shows all faults.
#[test]
fn every_case_passes() {
    let bench = Arc::new(Bench::new(None, None).expect("a folder for scenes"));
    let (mut faults, mut readings) = (Vec::new(), 0);
    for case in selftest::table() {
        match selftest::run(&case, &bench) {
            Ok(verdict) => {
                println!("{:20} {:6.2} s", verdict.name, verdict.seconds);
                readings += verdict.readings.len();
                let of_case = |r: &selftest::Reading| format!("{} {}: {r:?}", case.name, r.what);
                faults.extend(verdict.faults().map(of_case));
            }
            Err(error) => faults.push(format!("{}: {error}", case.name)),
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // The level of a single reading is for so many at most.
    assert!(readings <= judge::FAMILY_SIZE, "{readings} readings");
}
