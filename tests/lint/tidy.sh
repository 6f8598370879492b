#!/usr/bin/env bash
# clang-tidy over lib and tools, with the checks of .clang-tidy; takes half an hour of one core, so it is no part of the
# tests. With names it looks at the sources whose path holds one of them: bash tests/lint/tidy.sh evolve redistance
set -euo pipefail
cd "$(dirname "$0")/../.."

bash tests/install_packages.sh clang-tidy-14
cmake --preset ci --log-level=WARNING
names=$(IFS='|'; echo "${*:-}")
run-clang-tidy-14 -p build-ci -quiet -j "${COVOL_JOBS:-$(nproc)}" "^$PWD/(lib/src|tools/covol|tools/python)/.*($names).*\.cpp$"
