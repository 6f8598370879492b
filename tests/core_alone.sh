#!/usr/bin/env bash
# Builds covol's core, that is covol without COVOL_IO, while CMake is prevented from finding TIFF, ITK and HDF5. Checks
# that the library links none of them, nor GDCM, and runs the tests of the core.
set -euo pipefail
cd "$(dirname "$0")/.."

build=${1:-build-core}
absent=(-DCMAKE_DISABLE_FIND_PACKAGE_TIFF=ON -DCMAKE_DISABLE_FIND_PACKAGE_ITK=ON -DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON)
cmake --preset ci -B "$build" -DCOVOL_IO=OFF "${absent[@]}" >/dev/null
cmake --build "$build" --parallel "${COVOL_JOBS:-$(nproc)}"
if ldd "$build/lib/libcovol.so" | grep -iE 'tiff|itk|gdcm|hdf5'; then
  echo "covol: the core links what it should not" >&2
  exit 1
fi
ctest --test-dir "$build" --output-on-failure -j2 -R '^(unit|property|convergence)/'
echo "covol: the core stands alone"
