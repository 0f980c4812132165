# SPDX-License-Identifier: MIT
# What the scripts share. Source it: it changes to the project's root and sets strict mode.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
bin=$root/build/host/bin
python=/usr/bin/python3   # Debian's, whose python3-* packages scripts/setup installs

say() { printf '\n== %s\n' "$*"; }
die() { printf '%s: %s\n' "${0##*/}" "$*" >&2; exit 1; }

# version: the project's, from CMakeLists.txt, which has it alone.
version() { sed -n 's/^project(compbox VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt; }

# sources PATTERN…: the project's files whose names fit one of the patterns, each ended by a NUL; with
# git those that it knows or would add, without (a tarball) all but what is built.
sources() {
    local file names=() pattern
    if [ "$(git rev-parse --show-toplevel 2>/dev/null)" = "$(pwd -P)" ]; then
        git ls-files -z --cached --others --exclude-standard -- "$@"
    else
        for pattern in "$@"; do names+=(-o -name "$pattern"); done
        find . \( -path ./build -o -path ./out -o -name .git -o -name __pycache__ -o -name .cache -o \
            -name .venv \) -prune -o -type f \( "${names[@]:1}" \) -printf '%P\0' | sort -z
    fi | while IFS= read -r -d '' file; do
        if [ -f "$file" ]; then printf '%s\0' "$file"; fi
    done
}

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
