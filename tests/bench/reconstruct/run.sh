#!/usr/bin/env bash
# Builds covol and the programs with which it is compared, measures surfaces from points, and writes results.csv and
# table.md into tests/bench/reconstruct/results. README.md in this folder has details.
#
#   [COVOL_DATA=FOLDER] bash tests/bench/reconstruct/run.sh [--poisson-recon BINARY] [--shapes NAME,NAME] ...
#
# --help lists all options.
# Paths are relative to the repository's folder. Results of the same programs are kept in build/reconstruct and not
# measured again.
set -euo pipefail
cd "$(dirname "$0")/../../.."

bash tests/install_packages.sh python3-skimage python3-matplotlib
cmake --preset default --log-level=WARNING
cmake --build --preset default --parallel "${COVOL_JOBS:-$(nproc)}" --target covol_tool
cmake -S tests/bench/reconstruct -B build/reconstruct -G Ninja --log-level=WARNING
cmake --build build/reconstruct --parallel "${COVOL_JOBS:-$(nproc)}"
# Debian's Python, as numpy and scikit-image are installed for it.
exec /usr/bin/python3 tests/bench/reconstruct/compare.py "$@"
