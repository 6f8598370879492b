#!/usr/bin/env bash
# The unit and property tests under the address and undefined-behaviour sanitizers, and the lines of lib/ that they reach.
#
#   bash tests/sanitizers.sh [WORDS FOR CTEST ...]
#
# Leaks are looked for, too, but for what the libraries of HDF5 and OpenVDB lose of a file that is damaged: the first keeps
# objects of its header, the second the node that it was reading. The tests' own code is under the address sanitizer alone
# (COVOL_TEST_FLAGS in CMakePresets.json).
set -euo pipefail
cd "$(dirname "$0")/.."

bash tests/install_packages.sh gcovr
cmake --preset asan --log-level=WARNING
cmake --build --preset asan --parallel "${COVOL_JOBS:-$(nproc)}"
find build-asan -name '*.gcda' -delete
leaks=$(mktemp)
trap 'rm -f "$leaks"' EXIT
printf 'leak:libhdf5\nleak:libopenvdb\n' > "$leaks"
status=0
LSAN_OPTIONS="suppressions=$leaks:print_suppressions=0" UBSAN_OPTIONS=print_stacktrace=1 \
    ctest --test-dir build-asan -R '^(unit|property)/' --parallel "${COVOL_JOBS:-$(nproc)}" --timeout 3600 \
    --output-on-failure "$@" || status=$?
gcovr --root . --filter lib/ --object-directory build-asan --exclude-throw-branches --sort-percentage \
    --gcov-ignore-parse-errors --print-summary -o build-asan/coverage.txt
echo "by file: build-asan/coverage.txt"
exit "$status"
