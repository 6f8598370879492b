"""Untrusted files against the real program: provenance, plans, checkpoints, configurations, reports and names.

    /usr/bin/python3 tests/fuzz/provenance.py --covol BUILD/bin/covol [--cases N | --seconds S] [--seed 1] [--keep FOLDER]

Each case changes fields of files that covol itself wrote to values that look like options, paths, commands of a shell, numbers out
of range, deep lists or control characters, and runs the command that reads it. A finding is: a file that was created, changed or
left over although the command line does not name it; termination by a signal or exit code 1; a run that a signal does not end; a
control character on a stream or in a file's name. A job that only takes long is ended by SIGTERM, and is no finding. Findings are
kept with their case's number, with which --seed and --from repeat them; the exit code is 1.
"""
import argparse
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

import pyopenvdb as vdb

STEERS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
GOOD = {0, 2, 3, 4, 5, 6}
LONG = 20       # seconds after which a command gets SIGTERM
PATIENCE = 20   # seconds after SIGTERM, after which a command counts as hanging


class Sandbox:
    """inputs/ (where commands run), elsewhere/ (which nothing may modify), home/ and tmp/."""

    def __init__(self, covol, root):
        self.covol, self.root = str(pathlib.Path(covol).resolve()), root
        self.here, self.elsewhere = root / "inputs", root / "elsewhere"
        for folder in (self.here, self.elsewhere, root / "home", root / "tmp"):
            folder.mkdir()
        self.environment = {**os.environ, "HOME": str(root / "home"), "TMPDIR": str(root / "tmp")}
        for name in ("victim.vdb", "victim.json", ".bashrc", "cloud.xyz"):
            (self.elsewhere / name).write_text("1 2 3\n")
        self.make("phantom", "sphere", "--size", "20", "--count", "300", "-o", "ball.nrrd", "--points", "ball.xyz")
        self.job = ["segment", "ball.nrrd", "--points", "ball.xyz", "--init", "tag", "--max-steps", "2"]
        self.make(*self.job, "--theta", "0.5", "--density", "s.vdb", "--exterior-seed", "1,1,1", "-o", "s.vdb", "--json", "report.json")
        points = [[float(x) for x in line.split()] for line in (self.here / "ball.xyz").read_text().splitlines() if not line.startswith("#")]
        (self.here / "small.xyz").write_text("".join("%r %r %r\n" % tuple(x / 3 for x in point) for point in points))
        self.make("segment", "ball.nrrd", "--points", "a=ball.xyz", "b=small.xyz", "--init", "tag", "--max-steps", "2", "-o", "two.vdb", "--mask", "two.seg.nrrd")
        self.make("brick", "plan", *self.job, "--model", "paper", "--brick-voxels", "3000", "-o", "plan")
        self.make("brick", "run", "plan")
        self.make(*self.job, "-o", "c.vdb", "--save-config", "c.toml")
        self.interrupted_states()
        self.kept = {str(path.relative_to(root)): None if path.is_symlink() or path.is_dir() else path.read_bytes() for path in root.rglob("*")}

    def make(self, *words):
        subprocess.run([self.covol, *words, "--quiet"], cwd=self.here, env=self.environment, check=True, stdout=subprocess.DEVNULL)

    def interrupted_states(self):
        """A folder of checkpoints, as a run that was stopped leaves it."""
        run = subprocess.Popen([self.covol, *self.job[:-1], "100000", "--tolerance", "0", "-o", "long.vdb", "--checkpoint", "states", "--checkpoint-every", "0"],
                               cwd=self.here, env=self.environment, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while not (self.here / "states/flow-01.state").exists():
            if run.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError("no state of a flow")
            time.sleep(0.02)
        run.terminate()
        run.wait()

    def restore(self):
        for path in sorted(self.root.rglob("*"), reverse=True):
            name = str(path.relative_to(self.root))
            if name not in self.kept or path.is_symlink():
                shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink(missing_ok=True)
        for name, data in self.kept.items():
            path = self.root / name
            if data is None:
                path.mkdir(parents=True, exist_ok=True)
            elif not path.is_file() or path.read_bytes() != data:
                path.write_bytes(data)

    def differences(self, before, allowed):
        """Paths below the root that were created, changed or removed, except those that match `allowed`, regular expressions."""
        after = self.state()
        return [name for name in sorted({*before, *after})
                if before.get(name, b"?") != after.get(name, b"?") and not any(re.fullmatch(one, name, re.S) for one in allowed)]

    def state(self):
        found = {}
        for folder, folders, files in os.walk(self.root):
            for name in folders + files:
                path = os.path.join(folder, name)
                relative = os.path.relpath(path, self.root)
                try:
                    found[relative] = open(path, "rb").read() if os.path.isfile(path) and not os.path.islink(path) else None
                except OSError:
                    found[relative] = None
        return found


class Values:
    """Values that an attacker may write."""

    def __init__(self, rng, elsewhere):
        self.rng = rng
        out = str(elsewhere)
        self.texts = [f"--json={out}/stolen", f"--save-config={out}/.bashrc", f"--checkpoint={out}/states", "--help", "--", "-", "-o", "-o" + out + "/x.vdb",
                      f"--output={out}/victim.vdb", f"$(touch {out}/stolen)", f"`touch {out}/stolen`", f"x; touch {out}/stolen", f"{out}/victim.vdb", f"{out}/cloud.xyz",
                      "../elsewhere/cloud.xyz", "ball.nrrd/../../elsewhere/cloud.xyz", "/etc/passwd", "/dev/zero", "/dev/stdin", "..", ".", "/", "~", "ball.xyz", "ball.nrrd",
                      "a=ball.xyz", f"a={out}/cloud.xyz", f"[ball.xyz,{out}/cloud.xyz]", "[", "[]", "{}", "{frame}", "ball_{frame:03d}.xyz", "{frame", "mesh:ball.xyz",
                      f"vdb:{out}/victim.vdb", "sphere:0,0,0,1", "sphere:nan,0,0,1", "box:0,0,0,1,1,1", "tag", "auto", "paper", "1,2,3", "nan,inf,1e999", "", " ", "\x1b[31m\x1b]0;x\x07",
                      "two\nlines", "\u202egpj.exe", "\x9b31m", "\x7f", "nul\0end", "'\"\\", "ü" * 300, "x" * 5000, "%s%n%d", "true", "false", "on", "3vx", "-3vx", "1e400vx", "0x10", "٣"]
        self.numbers = [0, -1, 1, 0.5, 2, 8, 1e-320, 1e-9, 1e300, -1e300, 2**31 - 1, 2**31, -2**31, 2**32, 2**63, 2**64, 10**30]

    def text(self):
        text = self.rng.choice(self.texts)
        if self.rng.random() < 0.15:
            text += self.rng.choice(self.texts)
        return text

    def any(self, depth=0):
        kind = self.rng.random()
        if kind < 0.55:
            return self.text()
        if kind < 0.8:
            return self.rng.choice(self.numbers)
        if kind < 0.88:
            return self.rng.choice([None, True, False])
        if depth > 2:
            return []
        if kind < 0.96:
            return [self.any(depth + 1) for _ in range(self.rng.randrange(4))]
        return {self.text(): self.any(depth + 1)}

    def changed(self, json_value):
        """The value with some part changed, added or removed."""
        rng = self.rng
        if isinstance(json_value, dict) and json_value and rng.random() < 0.9:
            result = dict(json_value)
            name = rng.choice(list(result))
            kind = rng.random()
            if kind < 0.75:
                result[name] = self.changed(result[name])
            elif kind < 0.85:
                del result[name]
            else:
                result[rng.choice([self.text(), "json", "save-config", "config", "checkpoint", "resume", "mesh", "report", "mask", "keep-failed", "threads", "help"])] = self.any()
            return result
        if isinstance(json_value, list) and json_value and rng.random() < 0.8:
            result = list(json_value)
            at = rng.randrange(len(result))
            kind = rng.random()
            if kind < 0.6:
                result[at] = self.changed(result[at])
            elif kind < 0.75:
                del result[at]
            elif kind < 0.9:
                result.insert(at, self.any())
            else:
                result += result
            return result
        return self.any()

    def damaged(self, text):
        rng = self.rng
        kind = rng.randrange(5)
        if kind == 0:
            return text[:rng.randrange(len(text) + 1)]
        at = rng.randrange(len(text) + 1)
        if kind == 1:
            return text[:at] + self.text() + text[at:]
        if kind == 2:
            return text[:at] + rng.choice("[{\"'=,.#\\\n\0]}") * rng.choice((1, 3, 2000)) + text[at:]
        if kind == 3:
            return re.sub(r"-?[0-9.]+", lambda m: str(rng.choice(self.numbers)) if rng.random() < 0.2 else m[0], text)
        return text[:at] + text[at + rng.randrange(1, 50):]


def provenance(box, values, rng):
    grids, facts = vdb.readAll(str(box.here / rng.choice(("s.vdb", "two.vdb"))))
    changed = {}
    for key in rng.sample(["covol_options", "covol_given", "covol_inputs"], rng.randrange(1, 4)):
        value = json.loads(facts[key])
        for _ in range(rng.randrange(1, 4)):
            value = values.changed(value)
        changed[key] = json.dumps(value) if rng.random() < 0.93 else values.damaged(json.dumps(value))
    # Lists the options as given by the user, so that rerun uses them.
    if rng.random() < 0.5 and "covol_options" in changed:
        try:
            changed["covol_given"] = json.dumps(sorted({*json.loads(changed.get("covol_given", facts["covol_given"])), *json.loads(changed["covol_options"])} - {"command"}))
        except (TypeError, ValueError):
            pass
    if rng.random() < 0.1:
        changed[rng.choice(["covol_version", "covol_instruction_set", "covol_unit", "covol_space"])] = values.text().replace("\0", "")
    for grid in grids:
        for key, value in changed.items():
            grid[key] = value
        if rng.random() < 0.1:
            grid.name = values.text().replace("\0", "") or "g"
    vdb.write(str(box.here / "t.vdb"), grids, facts | changed)
    for name in ("ball.xyz", "ball.nrrd"):  # further inputs with names that a shell or covol may misinterpret
        if rng.random() < 0.2:
            shutil.copy(box.here / name, box.here / rng.choice(["--json=stolen", "-o", "$(touch stolen)", "a=b", "\x1b[31m"]))
    yield ["rerun", "t.vdb", "--memory-limit", "600M"], []
    if rng.random() < 0.3:
        yield ["rerun", "t.vdb", "-o", "again.vdb", "--memory-limit", "600M"], ["inputs/again\\.vdb"]
    yield [rng.choice(("info", "check")), "t.vdb"], []


def plan(box, values, rng):
    path = box.here / "plan/plan.json"
    value = json.loads(path.read_text())
    for _ in range(rng.randrange(1, 4)):
        value = values.changed(value)
    if isinstance(value, dict) and rng.random() < 0.5:
        value = {**json.loads(path.read_text()), "job": values.changed(value.get("job", {}))}
    text = json.dumps(value)
    path.write_text(values.damaged(text) if rng.random() < 0.1 else text, errors="replace")
    if rng.random() < 0.4:
        shutil.rmtree(box.here / "plan/sweep-01")
    if rng.random() < 0.1:
        shutil.rmtree(box.here / "plan/sweep-01", ignore_errors=True)
        (box.here / "plan/sweep-01").symlink_to(box.elsewhere)
    yield ["brick", "run", "plan", "--memory-limit", "600M"], ["inputs/plan/sweep-[0-9]+(/brick-[0-9]+\\.(vdb|json))?"]
    yield ["brick", "join", "plan", "-o", "joined.vdb", "--memory-limit", "600M"], ["inputs/joined\\.vdb"]


def facts(box, values, rng):
    path = rng.choice(sorted((box.here / "plan").glob("sweep-*/*.json")))
    text = json.dumps(values.changed(json.loads(path.read_text())))
    path.write_text(values.damaged(text) if rng.random() < 0.3 else text, errors="replace")
    if rng.random() < 0.3:
        shutil.copy(box.here / rng.choice(("s.vdb", "two.vdb", "ball.nrrd")), rng.choice([*sorted((box.here / "plan").glob("sweep-*/*.vdb")), box.here / "plan/coarse.vdb"]))
    yield ["brick", "join", "plan", "-o", "joined.vdb", "--memory-limit", "600M"], ["inputs/joined\\.vdb"]
    yield ["brick", "run", "plan", "--memory-limit", "600M"], ["inputs/plan/sweep-[0-9]+(/brick-[0-9]+\\.(vdb|json))?"]


def states(box, values, rng):
    path = rng.choice(sorted(path for path in (box.here / "states").iterdir()))
    kind = rng.randrange(4)
    if kind == 0 or path.name == "job.txt":
        path = box.here / "states/job.txt"
        text = json.dumps(values.changed(json.loads(path.read_text())), indent=2) + "\n"
        path.write_text(values.damaged(text) if rng.random() < 0.3 else text, errors="replace")
    elif kind == 1:
        data = bytearray(path.read_bytes())
        for _ in range(rng.randrange(1, 5)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        path.write_bytes(data[:rng.choice((len(data), rng.randrange(len(data))))])
    elif kind == 2:
        shutil.copy(box.here / rng.choice(("s.vdb", "two.vdb", "ball.nrrd")), path)
    else:
        (box.here / "states" / rng.choice(("flow-02.state", "flow-notes.txt", "mine.txt"))).write_text("mine")
    words = [*box.job[:-1], "100000", "--tolerance", "0", "-o", "long.vdb", "--resume", "states", "--checkpoint-every", "1"]
    yield words, ["inputs/states/(flow-[0-9]+\\.(vdb|state))", "inputs/long\\.vdb"]


def config(box, values, rng):
    text = (box.here / "c.toml").read_text()
    for _ in range(rng.randrange(1, 4)):
        kind = rng.randrange(3)
        if kind == 0:
            text = values.damaged(text)
        elif kind == 1:  # adds an option with a random name and value
            name = rng.choice(["points", "image", "init", "theta", "delta", "exterior-seed", "segment.theta", "quiet", "mesh", "[x]\nname", values.text().replace("\n", "")])
            text += f"\n{name} = {rng.choice((json.dumps(values.text()), str(rng.choice(values.numbers)), json.dumps([values.text(), values.text()])))}\n"
        else:
            text = re.sub(r'"[^"\n]*"', lambda m: json.dumps(values.text()) if rng.random() < 0.4 else m[0], text)
    # A configuration may name outputs, as a command line may. These options are removed here, so that any other file
    # that is written is a finding.
    text = "\n".join(line for line in text.splitlines() if not re.match(r"\W*(segment\W+)?(json|checkpoint|resume|output|mesh|mask|report|density|fields|table|usda|evidence|keep-failed)\b", line))
    (box.here / "c.toml").write_text(text, errors="replace")
    yield ["segment", "--config", "c.toml", "-o", "c.vdb", "--save-config", "again.toml", "--memory-limit", "600M"], ["inputs/(c\\.vdb|again\\.toml)"]
    for shell in ("sh", "bash"):
        subprocess.run([shell, "-c", ". ./again.toml"], cwd=box.here, capture_output=True, stdin=subprocess.DEVNULL, timeout=60)
    # Files are compared after each command. This one finds the files that a shell created when it read again.toml.
    yield ["info", "ball.nrrd"], ["inputs/(c\\.vdb|again\\.toml)"]


def names(box, values, rng):
    def name():
        return values.text().replace("/", "_").replace("\0", "").replace("=", "_")[:120].encode(errors="replace").decode(errors="replace") or "n"
    first = name()
    if rng.random() < 0.5:
        data = (box.here / "two.seg.nrrd").read_bytes()
        label = values.text().replace("\n", "\\n").replace("\0", "").encode(errors="replace")
        (box.here / "p.seg.nrrd").write_bytes(re.sub(rb"(Segment0_Name:=).*", lambda m: m[1] + label, data, count=1))
        words = ["segment", "ball.nrrd", "--painted", "p.seg.nrrd", "--max-steps", "2"]
    else:
        words = ["segment", "ball.nrrd", "--points", f"{first}=ball.xyz", f"{name()}=small.xyz", "--init", "tag", "--max-steps", "2"]
    yield ([*words, "-o", "n.vdb", "--mesh", "n.ply", "--mask", "n.nii.gz", "--report", "n.html", "--table", "n.csv", "--usda", "n.usda", "--memory-limit", "900M"],
           ["inputs/n(_[A-Za-z0-9_]+)?(\\.nii)?\\.(vdb|ply|html|csv|usda|nii\\.gz|txt)"])
    yield ["info", "n.vdb"], []


def report(box, values, rng):
    value = json.loads((box.here / "report.json").read_text())
    for _ in range(rng.randrange(1, 5)):
        value = values.changed(value)
    text = json.dumps(value)
    (box.here / "report.json").write_text(values.damaged(text) if rng.random() < 0.2 else text, errors="replace")
    yield ["report", "s.vdb:surface", "--run-report", "report.json", "-o", "page.html"], ["inputs/page\\.html"]


KINDS = [provenance, provenance, provenance, plan, plan, facts, states, config, config, names, report]


def run(box, words):
    """@return a description of the problem, or nothing; whether the run had to be ended"""
    process = subprocess.Popen([box.covol, *words], cwd=box.here, env=box.environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    ended = False
    try:
        out, error = process.communicate(timeout=LONG)
    except subprocess.TimeoutExpired:
        ended = True
        process.terminate()
        try:
            out, error = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            return "does not end", ended
    code, output = process.returncode, (out + error).decode(errors="surrogateescape")
    if code < 0 or (code not in GOOD and not (ended and code == 130)):
        return f"exit code {code}: {output[-300:]!r}", ended
    if found := STEERS.search(output) or re.search("[\udc80-\udcff]", output):
        return f"a control character on a stream: {output[max(0, found.start() - 60):found.start() + 20]!r}", ended
    return "", ended


def case(box, number, seed):
    """@return the findings, the number of runs, and how many of them had to be ended"""
    rng = random.Random(f"{seed}-{number}")
    values = Values(rng, box.elsewhere)
    kind = rng.choice(KINDS)
    findings, runs, long = [], 0, 0
    try:
        before = None
        allowed_so_far = []
        for words, allowed in kind(box, values, rng):
            if before is None:
                before = box.state()
            allowed_so_far += allowed
            wrong, ended = run(box, words)
            runs, long = runs + 1, long + ended
            where = f"case {number} ({kind.__name__}): covol {' '.join(words)}: "
            if wrong:
                findings.append(where + wrong)
            changed = box.differences(before, allowed_so_far)
            if changed:
                findings.append(where + f"created, changed or removed: {changed[:5]!r}")
            findings += [where + f"a name with a control character: {name!r}" for name in box.state() if STEERS.search(name) and name not in before]
            if findings:
                break
    finally:
        if findings and box.keep:
            shutil.copytree(box.root, box.keep / f"case-{number}", symlinks=True, dirs_exist_ok=True)
        box.restore()
    return findings, runs, long


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--covol", required=True)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--seconds", type=float, help="as many cases as there is time for")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--from", type=int, default=0, dest="first")
    parser.add_argument("--keep", type=pathlib.Path)
    options = parser.parse_args()
    begin, findings, runs, long, number = time.monotonic(), [], 0, 0, options.first
    with tempfile.TemporaryDirectory(prefix="covol-trust-") as name:
        box = Sandbox(options.covol, pathlib.Path(name))
        box.keep = options.keep
        while time.monotonic() - begin < options.seconds if options.seconds else number < options.first + options.cases:
            found, own_runs, own_long = case(box, number, options.seed)
            for line in found:
                print(line, flush=True)
            findings += found
            runs, long, number = runs + own_runs, long + own_long, number + 1
    print(f"{number - options.first} cases, {runs} runs in {time.monotonic() - begin:.0f} s with seed {options.seed}, {long} of them ended by a signal; "
          f"{len(findings)} findings")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
