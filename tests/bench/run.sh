#!/usr/bin/env bash
# Builds covol with its benchmarks, runs them, and writes tables (.csv, table.md) and speed.png into
# tests/bench/results.
#
#   bash tests/bench/run.sh [--quick] [--only PART,PART...] [--update-docs] ...     (--help lists the parts)
#
# All parts take about a quarter of an hour on two idle cores; --quick, which only tests the scripts, three minutes.
# Set COVOL_DATA to also run the jobs on larger data.
set -euo pipefail
cd "$(dirname "$0")/../.."

bash tests/install_packages.sh libbenchmark-dev python3-matplotlib
cmake --preset bench --log-level=WARNING
cmake --build --preset bench --parallel "${COVOL_JOBS:-$(nproc)}"
# Debian's Python, as numpy and matplotlib are installed for it.
exec /usr/bin/python3 tests/bench/bench.py --build build-bench "$@"
