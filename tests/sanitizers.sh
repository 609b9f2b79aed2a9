#!/usr/bin/env bash
# Memory and thread safety of the engine, the C ABI and the shim: `tests/sanitizers.sh address` or `thread`.
#
# Both sides of the ABI are instrumented, with the sanitizers of the stable toolchain (which wants to be asked by
# RUSTC_BOOTSTRAP) and of the C++ compiler. Mitsuba's libraries and Rust's standard library are not. ThreadSanitizer
# therefore does not see the standard library's locks, through which work goes to a pool of threads and comes back. Among the
# threads of a pool it goes through atomics, which are seen: reports count where both accesses are theirs, and lie in the shim or
# in the parts of the engine that run in parallel.
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizer=${1:-}
case $sanitizer in
    address)
        rust_flags="-Zsanitizer=address"
        tests="--test fuzz_abi --test fuzz_parameters --test render"
        ;;
    thread)
        # The fuzzers' tests share scenes between pools of their own, by way of the threads that run the tests.
        rust_flags="-Zsanitizer=thread -Cunsafe-allow-abi-mismatch=sanitizer"
        tests="--test render"
        ;;
    *)
        echo "say which sanitizer: tests/sanitizers.sh address, or thread" >&2
        exit 2
        ;;
esac

target=x86_64-unknown-linux-gnu
export RUSTC_BOOTSTRAP=1 RUSTFLAGS=$rust_flags
export CXXFLAGS="-fsanitize=$sanitizer -fno-omit-frame-pointer"
export CARGO_TARGET_DIR="$PWD/target/$sanitizer-sanitizer"
# Mitsuba keeps what it made until the process ends, and stops there with a lock-order report of Embree's.
export ASAN_OPTIONS=detect_leaks=0 TSAN_OPTIONS=exitcode=0:detect_deadlocks=0
log="$CARGO_TARGET_DIR/log"
mkdir -p "$CARGO_TARGET_DIR"

check() {
    # shellcheck disable=SC2086
    cargo test --release --target "$target" $tests
    cargo build --release --target "$target"
    for variant in scalar_rgb llvm_ad_rgb; do
        for method in ppt ppbt_metro; do
            "$CARGO_TARGET_DIR/$target/release/vpt" render tests/agreement/scenes/glass_in_fog.xml --variant $variant \
                --method $method --passes 2 --set photons=3000 --set connections=true -o "$CARGO_TARGET_DIR/picture.exr"
        done
    done
}

# The summaries of races between two threads of a pool.
between_workers() {
    awk '
        function judge() { if (workers == 2 && summary ~ /data race/) print summary }
        /^==================/ { judge(); summary = ""; workers = 0; next }
        /rayon_core::registry::ThreadBuilder>::run/ { workers++ }
        /^SUMMARY/ { summary = $0 }
        END { judge() }'
}

if [ "$sanitizer" = address ]; then
    check
else
    check >"$log" 2>&1 || grep -q "ThreadSanitizer" "$log" || {
        cat "$log"
        exit 1
    }
    parallel='in vpt::|src/(transport|tree|markov|density|medium|film)/'
    if between_workers <"$log" | grep -E "$parallel"; then
        echo "these accesses race; the reports are in $log" >&2
        exit 1
    fi
fi
echo "the $sanitizer sanitizer found nothing"
