#!/usr/bin/env bash
# Installs the packages with which covol is built and tested, all from Debian 12. Does nothing if all are installed.
# Further packages, such as those for the benchmarks, are given as arguments.
set -euo pipefail

packages=(
  # build
  g++ cmake ninja-build
  # grids, parallelism
  libopenvdb-dev libnanovdb-dev libtbb-dev libimath-dev libblosc-dev zlib1g-dev libboost-dev
  # meshes, geometry
  libopenmesh-dev libcgal-dev libeigen3-dev liblbfgs-dev libgmp-dev libmpfr-dev
  # images
  libinsighttoolkit5-dev libtiff-dev libpng-dev libturbojpeg0-dev libzstd-dev liblz4-dev libhdf5-dev
  # command line, reports, the Python module, packages
  libcli11-dev nlohmann-json3-dev libxxhash-dev pybind11-dev python3-dev dpkg-dev file patchelf
  # tests, and other programs that read covol's files
  catch2 libopenvdb-tools libnanovdb-tools python3-vtk9 python3-meshio python3 python3-openvdb python3-numpy python3-tifffile
  python3-nibabel python3-pydicom python3-zarr python3-numcodecs python3-h5py python3-pil
  python3-pytest python3-yaml xxhash pkgconf lintian groff-base man-db fish zsh
  "$@"
)

missing=()
for package in "${packages[@]}"; do
  state=$(dpkg-query -W -f '${Status}' "$package" 2>/dev/null || true)
  [[ $state == "install ok installed" ]] || missing+=("$package")
done
if (( ${#missing[@]} == 0 )); then
  echo "covol: all packages are installed"
  exit 0
fi

as_root=()
if (( EUID != 0 )); then
  command -v sudo >/dev/null || { echo "covol: please install as root: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "covol: installing ${missing[*]}"
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
