#!/usr/bin/env bash
# Installs the packages that are needed, builds covol with warnings as errors, and runs all tests. Tests on larger data
# use the folder in the environment variable COVOL_DATA, and print SKIPPED if it is not set.
set -euo pipefail
cd "$(dirname "$0")/.."

bash tests/install_packages.sh clang-format-14 snakemake slurm-wlm munge \
  chromium chromium-driver python3-selenium blender imagej meshlab cloudcompare xvfb xauth python3-venv python3-pip
cmake --preset ci
cmake --build build-ci --parallel "${COVOL_JOBS:-$(nproc)}" --target all all_verify_interface_header_sets
if [[ -n ${COVOL_DATA:-} ]]; then
  echo "covol: tests use the data in $COVOL_DATA"
else
  echo "covol: COVOL_DATA is not set: tests on larger data are SKIPPED"
fi
ctest --test-dir build-ci --output-on-failure -j2
echo "covol: all tests passed"
