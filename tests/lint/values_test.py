"""segment() consists of pure functions: inputs and choices are never modified, and nothing that is only reported to users affects
the computation.

    python3 tests/lint/values_test.py SOURCE_DIR
"""
import pathlib
import re
import sys

FOLDERS = ("segment", "bricks")
# Parameters that would allow a function to change inputs or choices: references and pointers that are not const.
WRITTEN_TO = re.compile(r"(?<!const )(?<!struct )(?<!class )\b(?:covol::)?(?:pipeline::)?(?:Problem|Choices|Resolved|\w*Options)\s*[&*]")
# Code that makes a result depend on the report: it searches texts of the report, or uses one in a condition.
READ_BACK = re.compile(r"\.(?:automatic|warnings)\s*(?:\.(?:contains|count|find|erase|empty|at)\b|\[)"
                       r"|\b(?:if|while)\s*\((?:[^()]|\([^()]*\))*\b(?:reason|why_not|summary)\b")
# The module that keeps the log, and the only one that may read it.
KEEPER = "segment/step.cpp"


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", lambda m: "\n" * m.group().count("\n"), text, flags=re.S)


def problems_of(text):
    """(line number, what is wrong) in the text of a source."""
    for number, line in enumerate(without_comments(text).splitlines(), 1):
        if WRITTEN_TO.search(line):
            yield number, "takes or keeps values that it could write to"
        if READ_BACK.search(line):
            yield number, "does something by what is told to people"


def findings(root):
    sources = sorted(path for folder in FOLDERS for path in (root / "lib/src" / folder).rglob("*") if path.suffix in (".h", ".cpp"))
    if len(sources) < 30:
        yield f"{root}: expected the sources of segment() and of bricks"
    if (root / "lib/src/segment/job.h").exists():
        yield "lib/src/segment/job.h: there is no object that all steps write to"
    for path in sources:
        name = path.relative_to(root / "lib/src").as_posix()
        for number, problem in problems_of(path.read_text()):
            if name != KEEPER:
                yield f"lib/src/{name}:{number}: {problem}"


def self_test():
    for bad in ("void choose(Choices& choices);", "void f(SegmentOptions& o, int n);", "EdgeOptions* kept;", "EvolveOptions & e = c.evolve;",
                "if (!report.automatic.contains(\"delta\")) return;", "report.automatic.erase(\"guess\");", "if (tag.reason.empty()) return;",
                "while (level.why_not.size() > 3) next();"):
        assert list(problems_of(bad)), bad
    for good in ("void choose(const Choices& choices);", "Choices without_points(Choices choices);", "// if the reason is\n", "run.info(why_not);",
                 "const SegmentOptions& options = problem.options;", "if (solution.was_asked) return;"):
        assert not list(problems_of(good)), good


if __name__ == "__main__":
    self_test()
    found = list(findings(pathlib.Path(sys.argv[1])))
    print("\n".join(found) if found else "no finding")
    sys.exit(1 if found else 0)
