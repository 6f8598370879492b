"""Objects for one instruction set share no function with other objects.

The linker keeps one of several functions of the same name. If it kept one that was compiled for AVX2, processors without
AVX2 could not run it.

    python3 tests/lint/kernels_test.py NM OBJECT ...

The objects' paths contain covol_kernels_ and the name of the set. Functions of Eigen are in the namespace Eigen_SET there.
"""
import re
import subprocess
import sys


def findings(nm, path):
    own = f"Eigen_{re.search(r'covol_kernels_([a-z0-9]+)', path)[1]}::"
    for line in subprocess.run([nm, "--demangle", "--defined-only", path], capture_output=True, text=True, check=True).stdout.splitlines():
        _, kind, name = line.split(maxsplit=2)
        # V and W are weak symbols, u is unique in the whole process. DW.ref is a pointer, not code.
        if kind in "VWu" and own not in name and not name.startswith("DW.ref."):
            yield f"{path}: {name}"


found = [line for path in sys.argv[2:] for line in findings(sys.argv[1], path)]
print("\n".join(found) or f"{len(sys.argv) - 2} objects, no finding")
sys.exit(bool(found) or len(sys.argv) < 4)
