"""The core, linked alone, depends on none of the libraries that readers and writers need.

    python3 tests/lint/core_test.py LIBRARY
"""
import re
import subprocess
import sys

FOREIGN = re.compile(r"tiff|itk|gdcm|hdf5|zstd|lz4", re.I)
needed = re.findall(r"\(NEEDED\).*\[(.+)\]", subprocess.run(["readelf", "-d", sys.argv[1]], capture_output=True, text=True, check=True).stdout)
found = [library for library in needed if FOREIGN.search(library)]
print("\n".join(found) or f"{len(needed)} libraries, no finding")
sys.exit(bool(found) or not any("openvdb" in library for library in needed))
