#!/usr/bin/env bash
# Writes docs/PERFORMANCE.md: what the commands below print on the machine that they run on, word for word.
#
#     benches/performance.sh                 measures everything; takes half an hour, and nothing else should run beside it
#     benches/performance.sh walks queries   measures these parts anew and keeps the others
#     benches/performance.sh assemble        measures nothing
#
# Each part lies in docs/performance, with the commit and the machine that it was measured on.
set -euo pipefail
cd "$(dirname "$0")/.."

parts=(errors walks passes queries effects)
contestants='ppt,ppt+preset=paper,ppbt,ppt_metro,ppbt_metro,apa,ppb,volpath'
errors=$(mktemp)
pictures=$(mktemp -d)
trap 'rm -rf "$errors" "$pictures"' EXIT
# Elsewhere than usual: the tables do not tell what has changed since the last time.
export CRITERION_HOME=$pictures/criterion

# What a command prints on stdout, without colours.
measured() {
    local command=$1
    printf '```sh\n%s\n```\n\n```text\n' "$command"
    bash -c "$command" 2>>"$errors" | sed -E 's/\x1b\[[0-9;]*m//g; s/[[:space:]]+$//' | grep -vE '^$|^(Gnuplot|Benchmarking|Warning)' || {
        cat "$errors" >&2
        exit 1
    }
    printf '```\n\n'
}

measure_errors() {
    cat <<'TEXT'
## Error for time

Equal wall time for all, Dr.Jit's LLVM variant on all cores. Methods have the default preset; `ppt+preset=paper` is the publication's.

TEXT
    for scene in caustic_fog window_room cornell_fog smoke; do
        printf '### %s\n\n' "$scene"
        measured "target/release/vpt compare mitsuba_scenes/$scene/scene.xml --variant llvm_ad_rgb -D resx=160 -D resy=160 \\
    --methods $contestants \\
    --time 6 --seeds 2 --reference-time 40 -o $pictures/$scene" | sed "s#$pictures#out#"
    done
}

measure_walks() {
    cat <<'TEXT'
## Walks

Vertices per second of photon walks, one thread: through the seam (batches, C ABI, outputs), and in a bare C++ loop of the same calls of Mitsuba.

TEXT
    measured 'cargo bench --bench photon_walk'
    cat <<'TEXT'
Dr.Jit's LLVM variant on all cores: walks that nobody looks at, by the size of batches, against whole shooting, whose photons look for their receivers and are deposited.

TEXT
    measured 'cargo bench --bench wavefront'
}

measure_passes() {
    cat <<'TEXT'
## Passes

Passes per second, preset `paper`; in brackets for how many passes view beams stay (baselines trace new ones in each). First the picture and the photons of the simplest scene in
the publication's table 2 (dragon smokes: a twelfth of a photon for each pixel, 0.11 at most elsewhere), then several photons for each pixel, where walks and queries, which both sides share,
weigh more. `bound` is the ratio that would be left if photons cost nothing once they are traced: the walks alone, which both share, against the baseline. Below, two threads
against one (first for arithmetic that shares nothing, which waits for itself or fills a core: what this machine gives), and what of a render with the default preset goes into trees.

TEXT
    measured 'cargo bench --bench passes -- scalar_rgb'
    measured 'cargo bench --bench passes -- llvm_ad_rgb'
}

measure_queries() {
    cat <<'TEXT'
## Queries

Accepted pairs per second (`thrpt`): photons among the beams of a pinhole, photons on surfaces among visible points, photon beams among view
beams. `no_search` is a loop over the very pairs that all accept; `bvh` and `kiddo` are the crates, `uniform_grid` is the bench's own. Photons find
ten pairs in the mean whatever the number of receivers; `_sorted` puts them in order first, as gathering does, and counts the time for it. The program
asks `ApexGrid` and `ViewPointTree`, and `ViewBeamTree` for beams that do not come from a pinhole.

TEXT
    measured 'cargo bench --bench tree_query -- "beams/|points/"'
    cat <<'TEXT'
There a pair is two additions. In a render it is also evaluated and deposited: photons of real scenes at the first radii of preset `paper`, against a loop over the same pairs
that evaluates and deposits them without a search; the two take turns. What a search may take besides the pairs goes by the photons that there are.

TEXT
    measured 'cargo bench --bench pairs'
}

measure_effects() {
    cat <<'TEXT'
## What a scene does not call for

TEXT
    measured 'cargo bench --bench effects'
}

origin() {
    local state
    state=$(git rev-parse --short HEAD)
    printf 'Commit %s; %s, %s cores; %s.\n\n' "$state" \
        "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)" "$(rustc --version)"
}

[ $# -gt 0 ] || set -- "${parts[@]}"
[ "$*" != assemble ] || set --
mkdir -p docs/performance
for part in "$@"; do
    declare -F "measure_$part" >/dev/null || {
        echo "no part is called $part; there are: ${parts[*]}" >&2
        exit 2
    }
    {
        "measure_$part"
        origin
    } >"$pictures/part.md"
    mv "$pictures/part.md" "docs/performance/$part.md"
done

{
    cat <<'TEXT'
# Performance

Written by `just performance`, which runs every command below and copies what it prints. Read ratios within one table: machines differ, and
this one drifts.

TEXT
    for part in "${parts[@]}"; do
        [ ! -e "docs/performance/$part.md" ] || cat "docs/performance/$part.md"
    done
    cat benches/tried.md
} >docs/PERFORMANCE.md
