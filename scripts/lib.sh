# SPDX-License-Identifier: MIT
# What the scripts share. Source it: it changes to the project's root and sets strict mode.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
bin=$root/build/host/bin
python=/usr/bin/python3   # Debian's, whose python3-* packages scripts/setup installs

say() { printf '\n== %s\n' "$*"; }
die() { printf '%s: %s\n' "${0##*/}" "$*" >&2; exit 1; }

# build PRESET [TARGET…]: configures and builds quietly; shows the end of the log when it fails.
build() {
    local preset=$1 log
    shift
    mkdir -p build
    log=build/$preset.log
    if ! { cmake --preset "$preset" && cmake --build --preset "$preset" ${1:+--target "$@"}; } >"$log" 2>&1; then
        tail -n 60 "$log" >&2
        die "preset $preset does not build; the whole log is $log"
    fi
}
