#!/usr/bin/env bash
# What the numbered scripts begin with: installs what is needed and builds covol. Sourced from the repository's root;
# sets $covol.
covol=build/bin/covol

echo "== installing and building (the first time takes minutes)"
bash tests/install_packages.sh
cmake --preset default -DCOVOL_BUILD_TESTS=OFF >/dev/null
cmake --build build --parallel "${COVOL_JOBS:-$(nproc)}" --target covol_tool
