#!/usr/bin/env bash
# Memory and thread safety of the engine, the C ABI and the shim: `tests/sanitizers.sh address` or `thread`.
#
# Both sides of the ABI are instrumented, with the sanitizers of the stable toolchain (which wants to be asked by
# RUSTC_BOOTSTRAP) and of the C++ compiler. Mitsuba's libraries and Rust's standard library are not. ThreadSanitizer
# therefore does not see the standard library's locks, and reports what they guard, such as the results of a thread
# that has ended: reports count whose access lies in the shim or in the parts of the engine that run in parallel.
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizer=${1:-}
case $sanitizer in
    address) rust_flags="-Zsanitizer=address" ;;
    thread) rust_flags="-Zsanitizer=thread -Cunsafe-allow-abi-mismatch=sanitizer" ;;
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
    cargo test --release --target "$target" --test fuzz_abi --test fuzz_parameters --test render
    cargo build --release --target "$target"
    for variant in scalar_rgb llvm_ad_rgb; do
        for method in ppt ppbt_metro; do
            "$CARGO_TARGET_DIR/$target/release/vpt" render tests/agreement/scenes/glass_in_fog.xml --variant $variant \
                --method $method --passes 2 --set photons=3000 --set connections=true -o "$CARGO_TARGET_DIR/picture.exr"
        done
    done
}

if [ "$sanitizer" = address ]; then
    check
else
    check >"$log" 2>&1 || grep -q "ThreadSanitizer" "$log" || {
        cat "$log"
        exit 1
    }
    parallel='in vpt::|src/(transport|tree|markov|density|medium|film)/'
    if grep -E "^SUMMARY: ThreadSanitizer: data race" "$log" | grep -E "$parallel"; then
        echo "these accesses race; the reports are in $log" >&2
        exit 1
    fi
fi
echo "the $sanitizer sanitizer found nothing"
