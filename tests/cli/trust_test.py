"""Untrusted files: provenance, plans and checkpoints are data, and cannot cause actions that the user did not request.

    COVOL=build/bin/covol python3 -m unittest tests/cli/trust_test.py
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import unittest

import pyopenvdb as vdb

from covol_case import COVOL, Case, sphere_points, write_xyz
from trust_case import ESC, STEERS, Stranger

FUZZ = pathlib.Path(__file__).resolve().parent.parent / "fuzz"


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
                              "--json", "r.json", "--threads", "2", "--save-config", "c.toml", "--strict").stderr
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
