#!/usr/bin/env bash
# Builds covol and what it is compared with, and measures surfaces from points; writes results.csv and table.md (--scans: scans.csv,
# scans.md) into tests/bench/reconstruct/results.
#
#   COVOL_DATA=FOLDER bash tests/bench/reconstruct/run.sh [--poisson-recon BINARY] [--shapes NAME,NAME] [OPTION...]
#
# Options are those of bench.py (--help). What was measured with the same programs is not measured again (build/reconstruct). Without
# COVOL_DATA only shapes that are made here are measured. PoissonRecon is built by its owner: github.com/mkazhdan/PoissonRecon.
set -euo pipefail
cd "$(dirname "$0")/../../.."

bash tests/install_packages.sh python3-scipy python3-skimage python3-matplotlib
cmake --preset default --log-level=WARNING
cmake --build --preset default --parallel "${COVOL_JOBS:-$(nproc)}" --target covol_tool
cmake -S tests/bench/reconstruct -B build/reconstruct -G Ninja --log-level=WARNING
cmake --build build/reconstruct --parallel "${COVOL_JOBS:-$(nproc)}"
exec /usr/bin/python3 tests/bench/reconstruct/bench.py --covol build/bin/covol --rivals build/reconstruct/bench_reconstruct_rivals "$@"
