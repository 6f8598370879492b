"""The shared library exports the functions of its public headers, and none of its internals.

    python3 tests/lint/symbols_test.py LIBRARY [NM]
"""
import re
import subprocess
import sys

# Symbols from headers of other libraries, which set default visibility. Every library that includes them exports the
# same.
FOREIGN = re.compile(r"^(std|__gnu_cxx|openvdb|tbb|boost|itk)::|^(guard variable|typeinfo|typeinfo name|vtable|VTT) for "
                     r"((std|__gnu_cxx|openvdb|tbb|boost|itk)::|void \(\*\)\()")
ABOUT = re.compile(r"^(?:(?:guard variable|typeinfo|typeinfo name|vtable|VTT) for |(?:non-)?virtual thunk to )")
# Names in a namespace within covol, such as covol::detail and covol::pipeline, which is internal. It is recognised by
# its lower-case first letter: names of classes begin with a capital.
INTERNAL = re.compile(r"\bcovol::[a-z_]\w*::")


def without_arguments(name):
    """`covol::f` from `T covol::f<...>(...)`: template arguments, parameters and the return type are removed."""
    while True:
        shorter = re.sub(r"\([^()]*\)|<[^<>]*>|\[[^\[\]]*\]|\{[^{}]*\}", "", name.replace("(anonymous namespace)", "anonymous"))
        if shorter == name:
            break
        name = shorter
    return re.sub(r"\s*(const|&+)?\s*$", "", name)


def findings(listing):
    symbols = [line.split(maxsplit=2) for line in listing.splitlines()]
    symbols = [(kind, name) for _, kind, name in (s for s in symbols if len(s) == 3) if kind != "A"]
    own = 0
    for kind, name in symbols:
        subject = ABOUT.sub("", without_arguments(name)).split(" ")[-1]
        if INTERNAL.search(name):
            yield f"internal: {name}"
        elif subject.startswith("covol::"):
            own += 1
        elif not (kind in "WVu" and (FOREIGN.match(subject) or FOREIGN.match(name))):
            yield f"not covol's: {kind} {name}"
    if own < 100:
        yield f"expected covol's public functions, found {own}"


if __name__ == "__main__":
    library, nm = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "nm"
    listing = subprocess.run([nm, "-DC", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    found = list(findings(listing))
    print("\n".join(found) if found else f"{len(listing.splitlines())} symbols, no finding")
    sys.exit(1 if found else 0)
