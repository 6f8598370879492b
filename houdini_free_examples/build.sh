#!/usr/bin/env bash
# The common beginning of the numbered scripts: installs what is needed and builds covol. Sourced from the repository's
# root; sets $covol, and $results, the folder for their outputs. If COVOL is set to a built program, nothing is
# installed or built; COVOL_OUT is another folder for the results.
covol=${COVOL:-build/bin/covol}
results=${COVOL_OUT:-out}

if [[ -z ${COVOL:-} ]]; then
  echo "== installing and building (the first time takes minutes)"
  bash tests/install_packages.sh
  cmake --preset default -DCOVOL_BUILD_TESTS=OFF >/dev/null
  cmake --build build --parallel "${COVOL_JOBS:-$(nproc)}" --target covol_tool
fi
