#!/usr/bin/env bash
# Builds covol with its benchmarks, runs them, and writes tables (.csv, table.md) and speed.png into tests/bench/results.
#
#   bash tests/bench/run.sh [--quick] [--only PART,PART...] [--update-readme] ...     (--help lists the parts)
#
# The whole of it takes about a quarter of an hour on two idle cores; --quick about three minutes, for a look at the
# machinery. Set COVOL_DATA to also run the jobs on larger data.
set -euo pipefail
cd "$(dirname "$0")/../.."

bash tests/install_packages.sh
missing=()
for package in libbenchmark-dev python3-matplotlib; do  # beyond what the build and the tests need
  dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q "install ok installed" || missing+=("$package")
done
if (( ${#missing[@]} > 0 )); then
  as_root=()
  (( EUID == 0 )) || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi
cmake --preset bench --log-level=WARNING
cmake --build --preset bench --parallel "${COVOL_JOBS:-$(nproc)}"
exec /usr/bin/python3 tests/bench/bench.py --build build-bench "$@"  # Debian's, for its numpy and matplotlib
