#!/usr/bin/env bash
# The unit and property tests under the address and undefined-behaviour sanitizers, and the lines of lib/ that they reach.
#
#   bash tests/sanitizers.sh [WORDS FOR CTEST ...]
#
# About half an hour to build and half an hour to run on two cores. Leaks are looked for, too, but for those of the HDF5
# library, which loses memory on damaged files.
set -euo pipefail
cd "$(dirname "$0")/.."

bash tests/install_packages.sh gcovr
cmake --preset asan --log-level=WARNING
cmake --build --preset asan --parallel "${COVOL_JOBS:-$(nproc)}"
find build-asan -name '*.gcda' -delete
leaks=$(mktemp)
trap 'rm -f "$leaks"' EXIT
echo 'leak:libhdf5' > "$leaks"
status=0
LSAN_OPTIONS="suppressions=$leaks:print_suppressions=0" UBSAN_OPTIONS=print_stacktrace=1 \
    ctest --test-dir build-asan -R '^(unit|property)/' --parallel "${COVOL_JOBS:-$(nproc)}" --timeout 3600 \
    --output-on-failure "$@" || status=$?
gcovr --root . --filter lib/ --object-directory build-asan --exclude-throw-branches --sort-percentage \
    --gcov-ignore-parse-errors=all --print-summary -o build-asan/coverage.txt
echo "by file: build-asan/coverage.txt"
exit "$status"
