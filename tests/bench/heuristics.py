"""The heuristic constants of covol, read from the heuristics.h of each folder of lib/src."""
import dataclasses
import pathlib
import re

SOURCE = pathlib.Path(__file__).resolve().parents[2]
STRUCT = re.compile(r"((?:///[^\n]*\n)*)struct (\w+)Heuristics \{\n(.*?)\n\};\nCOVOL_HEURISTICS \w+ (\w+)\{\};", re.S)
FIELD = re.compile(r"((?:    ///[^\n]*\n)*)    ([\w:]+) (\w+) =\s*(heuristic|limit)\(\"([\w.]+)\", ([^;]+)\);")


@dataclasses.dataclass
class Heuristic:
    name: str      # STEP.FIELD, as in COVOL_SCALE
    value: float
    text: str      # the value of the constant as it is written in heuristics.h
    is_count: bool
    unit: str
    meaning: str
    folder: str
    step: str      # the comment of the struct, which describes the step
    problem: str   # what is wrong with the declaration; empty: nothing
    is_limit: bool = False  # a limit of time or memory: only inputs that reach it have another result

    def scaled(self, factor):
        return max(1, int(self.value * factor + 0.5)) if self.is_count else self.value * factor


def words(comment):
    return re.sub(r"\s*///<?\s*", " ", comment).strip()


def read_heuristics(source=SOURCE):
    found = []
    for path in sorted((source / "lib/src").rglob("heuristics.h")):
        text = path.read_text()
        before = len(found)
        for comment, _, body, _ in STRUCT.findall(text):
            for about, kind, field, what, name, value in FIELD.findall(body + "\n"):
                plain = re.sub(r"(?<=\d)[FU]\b|'", "", value)
                match = re.match(r"\[([^]]+)\] (.+)", words(about), re.S)
                problem = "expected a comment '[unit] meaning'" if not match else "" if name.endswith("." + field) else f"its name is {name}"
                unit, meaning = match.groups() if match else ("", "")
                found.append(Heuristic(name, float(eval(plain, {"__builtins__": {}})), plain.replace(" ", ""), kind not in ("double", "float"), unit, meaning,
                                       path.parent.relative_to(source / "lib/src").as_posix(), words(comment), problem, what == "limit"))
        if len(found) - before != len(re.findall(r"\b(?:heuristic|limit)\(\"", text)) or not re.search(r"struct", text):
            found.append(Heuristic(str(path), 0, "", False, "", "", "", "", "a field that is not read: expected `type field = heuristic(\"step.field\", value);` in a struct"))
    return found
