#!/usr/bin/env bash
# Runs the unit and property tests under the address and undefined-behaviour sanitizers.
#
#   bash tests/sanitizers.sh [WORDS FOR CTEST ...]  all of them, and the lines of lib/ that they reach: an hour and more
#   bash tests/sanitizers.sh --quick                the programs that take less than 20 s (tests/CMakeLists.txt): for CI
#
# The quick pass leaves out the checks of pointer dereferences, which take a third of the compile time, because the
# address sanitizer finds most of these errors, too. Leaks are detected, except for those of two libraries with damaged
# files: HDF5 keeps objects of the header, and OpenVDB the node that it was reading. The tests' own code is compiled
# with the address sanitizer only (COVOL_TEST_FLAGS in CMakePresets.json).
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${COVOL_JOBS:-$(nproc)}
leaks=$(mktemp)
trap 'rm -f "$leaks"' EXIT
printf 'leak:libhdf5\nleak:libopenvdb\n' > "$leaks"
export LSAN_OPTIONS="suppressions=$leaks:print_suppressions=0" UBSAN_OPTIONS=print_stacktrace=1

# Address randomization is switched off if possible: with many random bits, the sanitizer may find no free range of
# addresses for its own memory.
fixed=(setarch --addr-no-randomize)
"${fixed[@]}" true 2> /dev/null || fixed=()

if [[ ${1:-} == --quick ]]; then
    bash tests/install_packages.sh
    cmake --preset asan --log-level=WARNING
    cmake --build --preset asan --parallel "$jobs" --target quick_tests
    # Each program runs all its tests in one process; its output is shown only if it fails.
    run='text=$("$0" 2>&1) || { echo "$0: exit code $?"; printf "%s\n" "$text"; exit 1; }'
    "${fixed[@]}" xargs --max-args=1 --max-procs="$jobs" bash -c "$run" < build-asan/tests/quick_tests.txt
    echo "covol: $(wc -l < build-asan/tests/quick_tests.txt) test programs passed under the sanitizers"
    exit
fi

bash tests/install_packages.sh gcovr
cmake --preset coverage --log-level=WARNING
cmake --build --preset coverage --parallel "$jobs"
find build-coverage -name '*.gcda' -delete
status=0
"${fixed[@]}" ctest --test-dir build-coverage -R '^(unit|property)/' --parallel "$jobs" --timeout 3600 --output-on-failure "$@" ||
    status=$?
gcovr --root . --filter lib/ --object-directory build-coverage --exclude-throw-branches --sort-percentage \
    --gcov-ignore-parse-errors --print-summary -o build-coverage/coverage.txt
echo "by file: build-coverage/coverage.txt"
exit "$status"
