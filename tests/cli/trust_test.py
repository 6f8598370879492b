"""Untrusted files: provenance, plans, checkpoints, configurations and names are data, and cannot cause actions that the user did
not request.

    COVOL=build/bin/covol python3 -m unittest tests/cli/trust_test.py
"""
import json
import os
import pathlib
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import time
import unittest

import pyopenvdb as vdb

from covol_case import CENTER, COVOL, Case, sphere_points, write_xyz

ESC = "\x1b]0;title\x07\x1b[31m"
# Characters that steer a terminal: controls (C0 without line ends, C1), and those that change the direction of writing.
STEERS = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
FUZZ = pathlib.Path(__file__).resolve().parent.parent / "fuzz"


class Stranger(Case):
    """A folder with a small result whose metadata is changed."""

    def setUp(self):
        super().setUp()
        shutil.copy(self.image, self.out / "ball.nrrd")
        shutil.copy(self.points, self.out / "ball.xyz")

    def make(self, *more, image="ball.nrrd"):
        self.run_covol("segment", "--points", "ball.xyz", "--init", "tag", "-o", "s.vdb", "--max-steps", "2", "--quiet", *more, "--", image)
        facts = vdb.readMetadata(str(self.out / "s.vdb"))
        return {key: json.loads(facts[f"covol_{key}"]) for key in ("options", "given", "inputs")}

    def write(self, **changed):
        """Writes t.vdb: s.vdb with other metadata."""
        grids, facts = vdb.readAll(str(self.out / "s.vdb"))
        texts = {f"covol_{key}": value if isinstance(value, str) else json.dumps(value) for key, value in changed.items()}
        for grid in grids:
            for key, value in texts.items():
                grid[key] = value
        vdb.write(str(self.out / "t.vdb"), grids, facts | texts)

    def state(self):
        return {str(path.relative_to(self.out)): path.read_bytes() if path.is_file() else None for path in sorted(self.out.rglob("*"))}

    def untouched(self, *command, code=3, expected_text=""):
        before = self.state()
        done = subprocess.run([COVOL, *map(str, command)], cwd=self.out, capture_output=True, timeout=120)
        error = done.stderr.decode(errors="replace")
        self.assertEqual(done.returncode, code, error)
        self.assertIn(expected_text, error)
        self.assertIsNone(STEERS.search(error + done.stdout.decode(errors="replace")), error)
        self.assertEqual(self.state(), before)
        return error


class Provenance(Stranger):
    def test_what_states_how_a_run_goes_is_refused(self):
        facts = self.make()
        for name in ("json", "save-config", "config", "checkpoint", "resume", "checkpoint-every", "threads", "memory-limit", "strict", "help"):
            with self.subTest(name):
                self.write(options=facts["options"] | {name: "stolen"}, given=facts["given"] + [name])
                self.untouched("rerun", "t.vdb", expected_text=name)

    def test_values_are_no_options(self):
        facts = self.make()
        for value in ("--json=stolen.json", "--save-config=stolen.sh", "-o", "--", "--help", "-", "@x", "[ball.xyz,--json=stolen.json]",
                      "/etc/passwd", "../ball.xyz", "ball.xyz/../ball.xyz", "a=/etc/passwd", "mesh:/etc/passwd", "", "no\0thing"):
            for option in ("image", "points", "init"):
                with self.subTest(option=option, value=value):
                    self.write(options=facts["options"] | {option: value}, given=sorted({*facts["given"], option}))
                    self.untouched("rerun", "t.vdb")
            with self.subTest(option="delta", value=value):
                self.write(options=facts["options"] | {"delta": value}, given=facts["given"] + ["delta"])
                before = self.state()
                done = subprocess.run([COVOL, "rerun", "t.vdb"], cwd=self.out, capture_output=True, timeout=120)
                self.assertEqual(done.returncode, 3, done.stderr)
                self.assertEqual(self.state(), before)

    def test_names_that_look_like_options(self):
        for name in ("--json=stolen.nrrd", "-o.nrrd", "--save-config=stolen.nrrd", "$(touch stolen).nrrd", "two\nlines.nrrd", "a=b.nrrd", "it's.nrrd"):
            with self.subTest(name):
                shutil.copy(self.image, self.out / name)
                grids = self.out / "s.vdb"
                self.make(image=f"./{name}")
                before = self.state()
                done = self.run_covol("rerun", "s.vdb")
                self.assertIn("bit-identical", done.stdout)
                self.assertEqual(self.state(), before)
                self.assertIsNone(STEERS.search(done.stderr))
                # The printed command is quoted so that a shell parses it to the original words.
                shown = next(line for line in done.stderr.splitlines() if "running covol" in line).split("running ", 1)[1]
                words = subprocess.run(["bash", "-c", f"printf '%s\\0' {shown}"], capture_output=True, check=True).stdout.decode().split("\0")
                self.assertEqual(os.path.normpath(words[-2]), str(self.out / name))
                self.assertEqual(self.state(), before)
                grids.unlink()
                (self.out / name).unlink()

    def test_what_is_kept_replaces_no_input(self):
        self.make()
        self.run_covol("segment", "ball.nrrd", "--points", "ball.xyz", "--init", "vdb:s.vdb", "-o", "t.vdb", "--max-steps", "2", "--quiet")
        self.untouched("rerun", "t.vdb", "-o", "s.vdb", expected_text="is an input of this run")

    def test_only_files_with_their_digest_are_inputs(self):
        facts = self.make()
        self.write(inputs=[*facts["inputs"], {"name": "..", "digest": "xxh128:0"}])
        self.untouched("rerun", "t.vdb", expected_text="expected a file's name")
        self.write(inputs=[])
        self.untouched("rerun", "t.vdb", expected_text="not among the inputs that the file lists")
        os.mkfifo(self.out / "pipe")  # a pipe without a writer: opening it for reading would block forever
        self.write(options=facts["options"] | {"image": "pipe"}, inputs=[*facts["inputs"], {"name": "pipe", "digest": "xxh128:0"}])
        done = subprocess.run([COVOL, "rerun", "t.vdb"], cwd=self.out, capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 4, done.stderr)

    def test_deep_and_damaged_texts(self):
        facts = self.make()
        deep = "[" * 500_000 + "]" * 500_000
        for key in ("options", "given", "inputs"):
            self.write(**{key: deep})
            self.untouched("rerun", "t.vdb", expected_text="levels")
        for options in ({"delta": [[1]]}, {"delta": None}, {"delta": {"a": 1}}, {"delta": [1, 2]}):
            self.write(options=facts["options"] | options, given=facts["given"] + ["delta"])
            self.untouched("rerun", "t.vdb")
        self.write(given=facts["given"] * 2)
        self.untouched("rerun", "t.vdb", expected_text="twice")

    def test_outputs_stay_in_a_folder_of_their_own(self):
        facts = self.make("--density", "d.vdb")
        for value in ("/tmp/stolen.vdb", "../../stolen.vdb", str(self.out / "ball.vdb"), "~/x.vdb"):
            self.write(options=facts["options"] | {"density": value})
            before = self.state()
            # An error: the run makes two .vdb files, and none has the name t.vdb that is to be compared.
            self.run_covol("rerun", "t.vdb", code=3)
            self.assertEqual(self.state(), before)
            self.assertFalse(pathlib.Path("/tmp/stolen.vdb").exists())
        for output in ("s.ply", "..", ".", "x/.."):
            self.write(options=facts["options"] | {"output": output}, given=[name for name in facts["given"] if name != "density"])
            self.untouched("rerun", "t.vdb", expected_text="makes no .vdb")

    def test_frames_are_inputs_too(self):
        for n in range(2):
            shutil.copy(self.points, self.out / f"marks_{n:02d}.xyz")
            shutil.copy(self.image, self.out / f"i{n}.nrrd")
        words = ["segment", "i0.nrrd", "i1.nrrd", "--points", "marks_{frame:02d}.xyz", "--init", "tag", "--max-steps", "2", "-o", "f{frame}.vdb"]
        self.run_covol(*words)
        inputs = json.loads(vdb.readMetadata(str(self.out / "f1.vdb"))["covol_inputs"])
        self.assertEqual(sorted(one["name"] for one in inputs), ["i0.nrrd", "i1.nrrd", "marks_00.xyz", "marks_01.xyz"])
        away = self.out / "away"
        away.mkdir()
        (self.out / "f1.vdb").rename(away / "f1.vdb")
        self.assertIn("bit-identical", self.run_covol("rerun", "away/f1.vdb", "--inputs", ".").stdout)

    def test_names_in_metadata_do_not_reach_the_terminal(self):
        facts = self.make()
        self.write(version=ESC, instruction_set=ESC)
        self.untouched("rerun", "t.vdb", code=0, expected_text="\\u001b]0;title\\u0007")
        self.write(options=facts["options"] | {"command": ESC})
        self.untouched("rerun", "t.vdb", expected_text="\\u001b")
        self.write(given=facts["given"] + [ESC], options=facts["options"] | {ESC: 1})
        self.untouched("rerun", "t.vdb", expected_text="\\u001b")

    def test_a_kill_leaves_no_child_and_no_folder(self):
        facts = self.make()
        self.write(options=facts["options"] | {"max-steps": 10**8, "tolerance": 0}, given=facts["given"] + ["tolerance"])
        before = self.files()
        run = subprocess.Popen([COVOL, "rerun", "t.vdb", "-o", "again.vdb"], cwd=self.out, stderr=subprocess.PIPE, text=True)
        while "running" not in run.stderr.readline():
            self.assertIsNone(run.poll())
        scratch = [name for name in self.files() if name.startswith(".covol-")]
        self.assertEqual(len(scratch), 1)

        def alive():
            found = []
            for entry in pathlib.Path("/proc").iterdir():
                if entry.name.isdigit():
                    try:
                        if scratch[0].encode() in (entry / "cmdline").read_bytes():
                            found.append(entry.name)
                    except OSError:
                        pass
            return found
        deadline = time.monotonic() + 30
        while not alive():
            self.assertLess(time.monotonic(), deadline, "the run within did not begin")
            time.sleep(0.01)
        time.sleep(0.5)
        run.send_signal(signal.SIGKILL)
        run.wait()
        run.stderr.read()  # returns when the inner run, which has the same stderr, ends
        deadline = time.monotonic() + 30
        while (alive() or self.files() != before) and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertEqual((alive(), self.files()), ([], before))


class Plans(Stranger):
    def plan(self, *more, command="segment", inputs=("ball.nrrd", "--points", "ball.xyz")):
        self.run_covol("brick", "plan", command, *inputs, "--model", "paper", "--max-steps", "2", "--brick-voxels", "4000", "-o", "plan", *more)
        return json.loads((self.out / "plan/plan.json").read_text())

    def write_plan(self, plan, text=None):
        (self.out / "plan/plan.json").write_text(text if text is not None else json.dumps(plan))

    def refused(self, plan, expected_text="", code=3):
        self.write_plan(plan)
        error = self.untouched("brick", "run", "plan", code=code, expected_text=expected_text)
        self.untouched("brick", "join", "plan", "-o", "x.vdb", code=code, expected_text=expected_text)
        return error

    def test_a_plan_is_settings_and_inputs(self):
        printed = self.run_covol("brick", "plan", "segment", "ball.nrrd", "--points", "ball.xyz", "--model", "paper", "--mesh", "m.ply", "-o", "plan",
                              "--json", "r.json", "--threads", "2", "--save-config", "c.toml", "--strict", code=5).stderr
        self.assertIn("brick join: --mesh", printed)
        job = json.loads((self.out / "plan/plan.json").read_text())["job"]
        self.assertEqual(job, {"command": "segment", "options": {"image": ["ball.nrrd"], "points": ["ball.xyz"], "model": ["paper"]}})

    def test_what_a_plan_may_not_request(self):
        plan = self.plan()
        options = plan["job"]["options"]
        for name in ("json", "save-config", "config", "checkpoint", "resume", "output", "mesh", "report", "mask", "keep-failed", "threads", "help"):
            with self.subTest(name):
                self.refused(plan | {"job": {"command": "segment", "options": options | {name: ["stolen.ply"]}}}, expected_text=name)
        for command in ("convert", "rerun", "--json=stolen", ""):
            self.refused(plan | {"job": {"command": command, "options": options}}, expected_text="expected segment or reconstruct")
        for job in (["segment", "ball.nrrd", "--json", "stolen"], {}, {"command": "segment"}, {"command": 1, "options": {}}, "segment",
                    {"command": "segment", "options": {"image": "ball.nrrd"}}, {"command": "segment", "options": {"image": [1]}},
                    {"command": "segment", "options": {"image": []}}, {"command": "segment", "options": {"theta": ["0.5", "0.5"]}}):
            with self.subTest(job=job):
                self.refused(plan | {"job": job})

    def test_values_are_no_options(self):
        plan = self.plan()
        for value in ("--json=stolen.json", "--save-config=stolen.sh", "--", "-o"):
            for job in ({"image": [value]}, {"image": ["ball.nrrd", value]}, {"points": [value]}):
                with self.subTest(job=job):
                    self.write_plan(plan | {"job": {"command": "segment", "options": plan["job"]["options"] | job}})
                    before = self.state()
                    for words in (["brick", "run", "plan"], ["brick", "join", "plan", "-o", "x.vdb"]):
                        done = subprocess.run([COVOL, *words], cwd=self.out, capture_output=True, timeout=120)
                        self.assertIn(done.returncode, (2, 3, 4), done.stderr)
                    self.assertEqual(self.state(), before)

    def test_a_plan_of_positions_alone(self):
        write_xyz(self.out / "--json=p.xyz", sphere_points(4400))
        self.run_covol("brick", "plan", "reconstruct", "--brick-voxels", "20000", "-o", "plan", "--", "--json=p.xyz")
        plan = json.loads((self.out / "plan/plan.json").read_text())
        plan["job"]["options"] = {"points": plan["job"]["options"]["points"]}
        self.write_plan(plan)
        self.run_covol("brick", "run", "plan", "--threads", "2")
        self.run_covol("brick", "join", "plan", "--threads", "2", "-o", "x.vdb", "--mesh", "x.ply")
        self.assertEqual([name for name in self.files() if name.startswith("--")], ["--json=p.xyz"])
        self.assertIn("x.ply", self.files())

    def test_numbers(self):
        plan = self.plan()
        brick = plan["bricks"][0]
        never = (-1, -2**31, 2**63, 2**64, 1e300, -1e300, 1.5, "1", None, [], {}, [1], [[0, 0, 0]])
        small = (0, 1e-300, 2**31 - 1, 2**31)

        def refused(changed, brick_alone=False):
            self.write_plan(plan | ({"bricks": [brick | changed, *plan["bricks"][1:]]} if brick_alone else changed))
            self.untouched("brick", "run", "plan", expected_text="plan")
        bad = {"voxel_size": never[:2] + never[4:6] + never[7:] + small + (True,), "overlap": never + small + (True,), "tolerance": never[:2] + never[5:6] + never[7:] + (0, True),
               "most_sweeps": never + (0, True), "most_voxels": never + (0, True), "has_sweeps": never + small[:1]}
        for name, values in bad.items():
            for value in values:
                with self.subTest(name=name, value=value):
                    refused({name: value})
            with self.subTest(name=name, missing=True):
                self.write_plan({key: value for key, value in plan.items() if key != name})
                self.untouched("brick", "run", "plan", expected_text="expected a plan")
        for name in ("origin", "min", "max"):
            for value in (*never[7:], 0, True, [0, 0], [0, 0, 0, 0], [0, 0, "0"], [None] * 3, [1e300] * 3, [-1e300] * 3, [2**63] * 3, *(
                    [[0.5] * 3, [2**31] * 3, [2**30] * 3] if name != "origin" else [])):
                with self.subTest(name=name, value=value):
                    refused({name: value})
        refused({"min": [1, 1, 1], "max": [0, 0, 0]})
        for name in ("min", "max"):
            for value in (*never[7:], 0, [0, 0], [0.5] * 3, [2**31] * 3, [2**20] * 3, [-2**20] * 3):
                with self.subTest(brick=name, value=value):
                    refused({name: value}, brick_alone=True)
        for value in never + (True,):
            with self.subTest(brick="active_voxels", value=value):
                refused({"active_voxels": value}, brick_alone=True)
        for value in (3, None, "0", {}, [-1], [len(plan["bricks"])], [2**64], [0.5], ["0"], [None], [1] * 1000):
            with self.subTest(brick="neighbours", value=value):
                refused({"neighbours": value}, brick_alone=True)
        for bricks in ([], {}, None, 3, [3], [{}]):
            self.write_plan(plan | {"bricks": bricks})
            self.untouched("brick", "run", "plan", expected_text="expected a plan")
        for edge in ({}, plan["edge"] | {"feature": 99}, plan["edge"] | {"feature": 0.5}, plan["edge"] | {"low": "a"}, plan["edge"] | {"edge_k": -1}):
            self.write_plan(plan | {"edge": edge})
            self.untouched("brick", "run", "plan", expected_text="expected a plan")
        text = json.dumps(plan)
        for name in ("voxel_size", "tolerance"):
            for number in ("NaN", "Infinity", "1e999", "-1e999"):
                self.write_plan(None, re.sub(f'"{name}": [^,]+', f'"{name}": {number}', text))
                self.untouched("brick", "run", "plan")
        self.write_plan(None, "[" * 300_000)
        self.untouched("brick", "run", "plan", expected_text="plan.json")

    def test_evidence_of_sweeps(self):
        plan = self.plan()
        self.run_covol("brick", "run", "plan")
        path = self.out / "plan/sweep-01/brick-00000.json"
        facts = json.loads(path.read_text())
        for name, values in {"same": (1, "a", None), "steps": ("a", -1, 1e300, 2**40, None), "seconds": ("a", None, []), "stop_reason": (1, None, {})}.items():
            for value in values:
                with self.subTest(name=name, value=value):
                    path.write_text(json.dumps(facts | {name: value}))
                    self.untouched("brick", "join", "plan", "-o", "x.vdb", expected_text="brick-00000.json")
        for text in ("", "[]", "[" * 100_000, "{}", "nonsense"):
            path.write_text(text)
            self.untouched("brick", "join", "plan", "-o", "x.vdb", expected_text="brick-00000.json")
        self.assertTrue(plan["bricks"])

    def test_links_lead_nowhere(self):
        self.plan()
        (self.out / "elsewhere").mkdir()
        (self.out / "plan/sweep-01").symlink_to(self.out / "elsewhere")
        self.untouched("brick", "run", "plan", code=4, expected_text="expected a folder, got a link")


class Checkpoints(Stranger):
    def test_folders_of_others(self):
        words = ["segment", "ball.nrrd", "--points", "ball.xyz", "--init", "tag", "--max-steps", "2", "-o", "c.vdb"]
        folder = self.out / "states"
        folder.mkdir()
        for name in ("flow-chart.vdb", "flow-1.vdb", "flow-01.vdb.bak", "flow-.state", "flow-02.txt"):
            (folder / name).write_text("mine")
        before = self.state()
        self.run_covol(*words, "--checkpoint", "states")
        (self.out / "c.vdb").unlink()
        self.assertEqual(self.state(), before)

    def test_a_job_that_is_not_this_one(self):
        words = ["segment", "ball.nrrd", "--points", "ball.xyz", "--init", "tag", "--max-steps", "2", "-o", "c.vdb", "--resume", "states"]
        folder = self.out / "states"
        folder.mkdir()
        for text in ("", ESC, "{" * 100_000, json.dumps({"version": "1", "options": {"json": "stolen"}})):
            (folder / "job.txt").write_text(text)
            self.untouched(*words, expected_text="other options")
        (folder / "job.txt").unlink()
        os.mkfifo(folder / "job.txt")  # a pipe without a writer: opening it for reading would block forever
        done = subprocess.run([COVOL, *words], cwd=self.out, capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 3, done.stderr)


class Configurations(Stranger):
    VALUES = ["$(touch stolen)", "`touch stolen`", "a\"b", "a'b", "a\\b", "two\nlines", "tab\there", ESC, "#no comment", "a, b", "[c]d", "=", " blank ",
              "ü\u202e", "$HOME", "!!", "true.csv", "5", "'", "\"", "\\", "\\n", "0x10", "a;touch stolen", "\x7f", "latin\udce9"]

    def test_what_is_saved_reads_back(self):
        for value in self.VALUES:
            with self.subTest(value):
                for path in ("c.toml", "d.toml"):
                    (self.out / path).unlink(missing_ok=True)
                name = f"m{value}.xyz"
                shutil.copy(self.points, os.path.join(os.fsencode(self.out), os.fsencode(name)))
                words = ["segment", "ball.nrrd", "--init", "tag", "--max-steps", "1", "-o", "c.vdb", "--quiet"]
                given = ["./" + name, "ball.xyz"]
                subprocess.run([COVOL, *words, "--points", *given, "--save-config", "c.toml"], cwd=self.out, check=True)
                subprocess.run([COVOL, "segment", "--config", "c.toml", "--quiet", "--save-config", "d.toml", "--json", "r.json"], cwd=self.out, check=True)
                # A configuration that was saved from a read one has the same bytes.
                self.assertEqual((self.out / "c.toml").read_bytes(), (self.out / "d.toml").read_bytes())
                printed = json.loads((self.out / "r.json").read_bytes().decode(errors="replace"))["options"]["points"]
                self.assertEqual(len(printed), 2)
                before = self.state()
                for shell in ("sh", "bash"):
                    subprocess.run([shell, "-c", ". ./c.toml"], cwd=self.out, capture_output=True, stdin=subprocess.DEVNULL, timeout=30)
                self.assertEqual(self.state(), before)
                os.unlink(os.path.join(os.fsencode(self.out), os.fsencode(name)))

    def test_toml_reads_it_too(self):
        try:
            import tomllib
        except ImportError:
            self.skipTest("no tomllib")
        shutil.copy(self.points, self.out / "$(x)\\\"\n.xyz")
        self.run_covol("segment", "ball.nrrd", "--points", "a=$(x)\\\"\n.xyz", "a=ball.xyz", "--theta", "0.5", "-o", "c.vdb", "--save-config", "c.toml")
        self.assertEqual(tomllib.loads((self.out / "c.toml").read_text()),
                         {"image": "ball.nrrd", "points": ["a=$(x)\\\"\n.xyz", "a=ball.xyz"], "output": "c.vdb", "theta": 0.5})

    def read(self, text, *more, code=0):
        (self.out / "c.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        words = ["segment", "ball.nrrd", "-o", "c.vdb", "--max-steps", "1", "--init", "tag", "--config", "c.toml", "--json", "r.json", *more]
        done = self.run_covol(*words, code=code)
        return json.loads((self.out / "r.json").read_text())["options"] if code == 0 else done.stderr

    def test_forms(self):
        for text in ('points = "ball.xyz"', "points='ball.xyz'", "points = ball.xyz # a comment", '\ufeff; INI\n[segment]\npoints=ball.xyz\n',
                     'points = [ "ball.xyz" , ]', 'points = [\n  # first\n  "ball.xyz", # and last\n]\n', 'segment.points = "ball.xyz"',
                     '[mesh]\nfar = [1]\n["segment"]\n"points" = "ball.xyz"', 'points = "b\\u0061ll.x\\U00000079z"\r\n', '[[segment]]\npoints = ball.xyz'):
            with self.subTest(text):
                self.assertEqual(self.read(text)["points"], ["ball.xyz"])
        options = self.read('points = ball.xyz\nhalf\nquiet = true\ntheta = 0.5')
        self.assertEqual((options["half"], options["theta"]), (True, 0.5))
        shutil.copy(self.points, self.out / "b.xyz")
        for text in ("points = ball.xyz, b.xyz", "points = ball.xyz b.xyz", 'points = "ball.xyz"\npoints = "b.xyz"', "points = ['ball.xyz', b.xyz]"):
            with self.subTest(text):
                self.assertEqual(self.read(text)["points"], ["ball.xyz", "b.xyz"])

    def test_mistakes_are_reported_with_their_line(self):
        for text in ('\npoints = "ball.xyz', 'points = "a\\qb"', "points = [", "points = [[1]]", "[segment", "points = [1 2]", "= 3", '\npoints = "a" x\n= 1',
                     'points = "\\u0000"', 'points = "\\ud800"', "points = []", "[[[segment]]]", 'points = """a"""', "config = other.toml", "save-config = stolen"):
            with self.subTest(text):
                error = self.read(text, code=2)
                self.assertRegex(error, "line [0-9]|configurable|config")
                self.assertNotIn("stolen", self.files())

    def test_small_files_take_little_memory(self):
        for name, text in {"nested": "a." * 100_000 + "b = 1", "section": "[" + "a." * 100_000 + "b]", "brackets": "[" * 200_000, "list": "points = " + "[" * 200_000,
                           "sections": "".join(f"[{'a.' * (n % 200)}b{n}]\n" for n in range(2000)), "quotes": "points = " + "\"a\"," * 50_000,
                           "blanks": "theta = 0.5\n" + " \n" * 100_000, "zeros": b"\0" * 200_000, "escapes": 'points = "' + "\\u0061" * 30_000}.items():
            with self.subTest(name):
                (self.out / "c.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
                done = subprocess.run([COVOL, "segment", "ball.nrrd", "-o", "c.vdb", "--config", "c.toml", "--quiet"], cwd=self.out, capture_output=True, timeout=60,
                                      preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30)))
                self.assertIn(done.returncode, (0, 2, 3, 4), done.stderr[:500])
                self.assertLess(len(done.stderr), 100_000)
        with open(self.out / "c.toml", "wb") as file:
            file.truncate(40 << 30)
        self.assertIn("1 MiB", self.run_covol("segment", "ball.nrrd", "-o", "c.vdb", "--config", "c.toml", code=2).stderr)


class Names(Stranger):
    def checked(self, *words, code=0, page=None):
        done = subprocess.run([COVOL, *map(str, words)], cwd=self.out, capture_output=True, timeout=300)
        printed = (done.stdout + done.stderr).decode()
        self.assertEqual(done.returncode, code, printed)
        self.assertIsNone(STEERS.search(printed), printed)
        if page:
            self.assertIsNone(STEERS.search((self.out / page).read_text().replace("\t", "")))
        return printed

    def test_structures(self):
        name = f"a{ESC}\n\u202eb/../x".replace("/", "_")
        write_xyz(self.out / "small.xyz", [tuple(c + (p - c) / 3 for p, c in zip(point, CENTER)) for point in sphere_points(600)])
        words = ["segment", "ball.nrrd", "--points", f"{name}=ball.xyz", "other=small.xyz", "--init", "tag", "--max-steps", "1", "-o", "s.vdb", "--mesh", "s.ply",
                 "--mask", "s.nii.gz", "--table", "s.csv", "--report", "s.html", "--usda", "s.usda", "--json", "r.json", "--evidence", "e.csv"]
        self.checked(*words, page="s.html")
        for file in self.files():
            self.assertIsNone(STEERS.search(file), file)
        for text in ("s.csv", "s.usda", "e.csv", *(name for name in self.files() if name.startswith("s_labels"))):
            self.assertIsNone(STEERS.search((self.out / text).read_text().replace("\t", "")), text)
        shown = json.loads((self.out / "r.json").read_text())["structures"][0]["name"]
        self.assertEqual(shown, "a\\u001b]0;title\\u0007\\u001b[31m\\u000a\\u202eb_.._x")
        for file in self.files():
            if file.endswith((".vdb", ".ply", ".nii.gz")):
                self.checked("info", file)
                self.checked("check", file)

    def test_paths(self):
        for name in (f"x{ESC}", "y\x9b31m", "z\u202egpj", "w\x7f"):
            with self.subTest(name):
                os.makedirs(self.out / name)
                shutil.copy(self.image, self.out / name / f"{name}.nrrd")
                shutil.copy(self.points, self.out / name / f"{name}.xyz")
                place = f"{name}/{name}"
                self.checked("segment", f"{place}.nrrd", "--points", f"{place}.xyz", "--init", "tag", "--max-steps", "1", "-o", f"{place}.vdb", "--report", f"{place}.html",
                             page=f"{place}.html")
                self.checked("rerun", f"{place}.vdb")
                self.checked("info", f"{place}.vdb")
                self.checked("info", f"{place}.xyz")
                self.checked("info", f"{place}.nrrd", "--json", "-")
                self.checked("info", f"{place}.none", code=4)
                self.checked("segment", f"{place}.nrrd", "--points", f"{place}.xyz", "--theta", ESC, "-o", "a.vdb", code=2)
                self.checked("segment", f"--{name}", code=2)
                self.checked(name, code=2)

    def test_latin_1(self):
        name = os.fsencode(self.out) + b"/caf\xe9\x9b.nrrd"
        shutil.copy(self.image, name)
        self.checked("info", os.fsdecode(name))
        self.checked("info", os.fsdecode(name) + "x", code=4)

    def test_grids(self):
        grid = vdb.createLevelSetSphere(5.0)
        grid.name = f"g{ESC}\nfake: line"
        grid["covol_unit"] = ESC
        vdb.write(str(self.out / "g.vdb"), [grid])
        printed = self.checked("info", "g.vdb")
        self.assertEqual(len(printed.splitlines()), 1)
        self.checked("check", "g.vdb")
        self.checked("info", "g.vdb", "--json", "-")
        self.checked("report", "g.vdb", "-o", "g.html", page="g.html")
        self.checked("render", "g.vdb", "-o", "g.png")
        self.checked("mesh", "g.vdb", "-o", "g.ply")
        header = (self.out / "g.ply").read_bytes().split(b"end_header")[0].decode()
        self.assertIsNone(STEERS.search(header), header)
        self.checked("mesh", "g.vdb:none", "-o", "g.ply", code=3)

    def test_labels_of_files(self):
        self.checked("segment", "ball.nrrd", "--points", "a=ball.xyz", "--init", "tag", "--max-steps", "1", "-o", "s.vdb", "--mask", "s.seg.nrrd")
        data = (self.out / "s.seg.nrrd").read_bytes()
        self.assertIn(b"Name:=a\n", data)
        (self.out / "p.seg.nrrd").write_bytes(data.replace(b"Name:=a\n", f"Name:=../{ESC}\u202e\n".encode()))
        self.checked("segment", "ball.nrrd", "--painted", "p.seg.nrrd", "-o", "p.vdb", "--mesh", "p.ply", "--max-steps", "1")
        self.checked("info", "p.seg.nrrd")


class Roles(Case):
    def test_each_option_has_one(self):
        described = json.loads(self.run_covol("--describe-options").stdout)
        roles = {}
        for command in described["commands"]:
            for group in command["groups"]:
                for option in group["options"]:
                    name = option["names"].split(", ")[-1].lstrip("-") or f"<{option['value']}>"
                    roles.setdefault(option["role"], set()).add((command["name"], name))
        names = {role: {name for _, name in found} for role, found in roles.items()}
        self.assertEqual(names["conduct"], {"checkpoint", "checkpoint-every", "resume", "help", "help-all", "also-at", "in-frame-of", "<plan|run|join ...>",
                                            "<COMMAND...>", "<OUT_FOLDER>"})
        self.assertEqual(names["output"], {"output", "mask", "rtstruct", "table", "evidence", "suggestions", "mesh", "density", "usda", "fields", "report", "keep-failed", "points", "labels",
                                           "<OUT>"})
        self.assertLessEqual({"points", "contours", "painted", "inside", "outside", "guess", "init", "like", "image", "band", "distance", "edge"}, names["input"])
        self.assertLessEqual({"theta", "rho", "voxel-size", "model", "half", "frame", "exterior-seed", "remove-outliers"}, names["setting"])


class Fuzzed(unittest.TestCase):
    def test_a_short_pass(self):
        done = subprocess.run([sys.executable, str(FUZZ / "provenance.py"), "--covol", COVOL, "--cases", "40", "--seed", "1"], capture_output=True, text=True, timeout=600)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, "40 cases")


if __name__ == "__main__":
    unittest.main()
