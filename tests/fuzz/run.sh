#!/usr/bin/env bash
# Fuzzes the reader of each file format under libFuzzer, with clang's address and undefined-behaviour sanitizers.
#
#   bash tests/fuzz/run.sh [--seconds 1800] [--formats dcm,h5,...] [--corpus FOLDER] ...     (--help lists the rest)
set -euo pipefail
cd "$(dirname "$0")/../.."

bash tests/install_packages.sh clang
cmake --preset default --log-level=WARNING
cmake --build --preset default --target covol_tool --parallel "${COVOL_JOBS:-$(nproc)}"
cmake --preset fuzz --log-level=WARNING
cmake --build --preset fuzz --parallel "${COVOL_JOBS:-$(nproc)}"
exec /usr/bin/python3 tests/fuzz/guided.py --program build-fuzz/tests/fuzz/covol_fuzz_readers --covol build/bin/covol "$@"
