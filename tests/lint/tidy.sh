#!/usr/bin/env bash
# Runs clang-tidy on lib and tools, with the checks of .clang-tidy; it needs half an hour on one core and is therefore
# not part of the tests. With arguments it checks the sources whose path contains one of them: bash tests/lint/tidy.sh
# evolve redistance
set -euo pipefail
cd "$(dirname "$0")/../.."

bash tests/install_packages.sh clang-tidy-14
cmake --preset ci --log-level=WARNING
names=$(IFS='|'; echo "${*:-}")
run-clang-tidy-14 -p build-ci -quiet -j "${COVOL_JOBS:-$(nproc)}" "^$PWD/(lib/src|tools/covol|tools/python)/.*($names).*\.cpp$"
