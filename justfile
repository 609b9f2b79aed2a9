# Everything here is also a plain command: copy it from the recipe.

# What must pass before a change lands; installs what is missing on Debian and its kin
check:
    .ci/run

# The tests
test:
    cargo test --release

# The Python package: installed into a fresh virtual environment and tested there
python *ARGS:
    python/test.sh {{ARGS}}

# Pin what the tests of the Python package need, with hashes (needs uv)
python-lock:
    uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
        --custom-compile-command "just python-lock" python/requirements-test.in -o python/requirements-test.txt

# How a render gets faster with more worker processes: `just scaling mitsuba_scenes/smoke/scene.xml --workers 1,2,4`
scaling SCENE="mitsuba_scenes/cornell_fog/scene.xml" *ARGS="--passes 64 --workers 1,2":
    target/python/bin/python python/examples/scaling.py {{SCENE}} {{ARGS}}

# Renew the files that tests compare with
bless:
    VPT_BLESS=1 cargo test --release --test abi_header

# Compare all methods with Mitsuba's own integrators, at length
agreement:
    cargo test --release --test agreement -- --ignored --nocapture

# Random scenes against Mitsuba (VPT_FUZZ_SEED and VPT_FUZZ_SCENES say from which scene on and how many), the C ABI, parameters
fuzz:
    PROPTEST_CASES=5000 cargo test --release --test fuzz_abi --test fuzz_parameters
    cargo test --release --test differential -- --ignored --nocapture

# Memory and thread safety of both sides of the C ABI: `just sanitize address` and `just sanitize thread`
sanitize SANITIZER:
    tests/sanitizers.sh {{SANITIZER}}

# Metropolis chains where one walk in 100,000 is seen
markov:
    cargo test --release --test markov -- --ignored --nocapture

# A render that is killed two hundred times
survive:
    cargo test --release --test parts -- --ignored --nocapture

# Estimated errors of all methods against true ones
calibration:
    cargo test --release --test error_estimate -- --ignored --nocapture

# The paper's measurements again: `just reproduce kitchen --budget 5m`
reproduce *ARGS="all":
    cargo run --release -- reproduce {{ARGS}}

# Put what `just reproduce` measured into the documents
results FOLDER="reproduction":
    mkdir -p docs/results
    cp {{FOLDER}}/claims.md docs/results/claims.md
    cp {{FOLDER}}/dragon_smokes/rmse.svg docs/results/dragon_smokes.svg
    cp {{FOLDER}}/breakfast_hall/rmse.svg docs/results/breakfast_hall.svg
    cp {{FOLDER}}/kitchen/rmse.svg docs/results/kitchen.svg

bench:
    cargo bench

# Measure, and write docs/PERFORMANCE.md; `just performance walks` renews one part of it
performance *PARTS:
    cargo build --release
    benches/performance.sh {{PARTS}}

# Render the pictures of docs/GALLERY.md again, all or those whose commands hold a word: `just gallery smoke`
gallery *WORDS:
    cargo build --release
    docs/gallery.sh {{WORDS}}

fmt:
    cargo fmt

doc:
    cargo doc --release --no-deps
