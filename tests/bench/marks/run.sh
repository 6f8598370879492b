#!/usr/bin/env bash
# Builds covol and measures the quality of results from few marks; writes tables (.csv, .md) and curve.png into
# tests/bench/marks/results.
#
#   COVOL_DATA=FOLDER bash tests/bench/marks/run.sh [PART...] [--quick] [OPTION...]
#
# PART is table, contours, curve, bias, cut, silence, correction, inference or wrong; by default, all are run.
# Options are those of the scripts (table.py --help). Results of the same binary and the same scripts are kept in
# build/marks and not measured again. Table, contours, curve, silence, correction, inference and wrong need the images
# of COVOL_DATA and are skipped without them.
set -euo pipefail
cd "$(dirname "$0")/../../.."

parts=()
while (( $# > 0 )) && [[ $1 != -* ]]; do
  parts+=("$1")
  shift
done
(( ${#parts[@]} > 0 )) || parts=(table contours curve bias cut silence correction inference wrong)

bash tests/install_packages.sh python3-scipy python3-skimage python3-matplotlib
cmake --preset default --log-level=WARNING
cmake --build --preset default --parallel "${COVOL_JOBS:-$(nproc)}" --target covol_tool
for part in "${parts[@]}"; do
  if [[ $part != bias && $part != cut && -z ${COVOL_DATA:-} ]]; then
    echo "$part: SKIPPED, COVOL_DATA is not set"
    continue
  fi
  /usr/bin/python3 "tests/bench/marks/$part.py" --covol build/bin/covol "$@"
done
