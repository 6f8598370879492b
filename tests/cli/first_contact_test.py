"""The first contact with covol: covol without a command, covol help, covol demo, covol doctor. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/first_contact_test.py
"""
import json
import os
import pathlib
import pty
import re
import signal
import subprocess
import unittest

from covol_case import COMMANDS, COVOL, Case
from live_client import Live
from mark_test import PageCase

SAMPLES = pathlib.Path(__file__).resolve().parents[2] / "houdini_free_examples/data"


class Words(Case):
    def on_terminal(self, *words):
        """The output of a command on a terminal, and its exit code."""
        near, far = pty.openpty()
        try:
            process = subprocess.Popen([COVOL, *words], stdin=far, stdout=far, stderr=far, cwd=self.out)
        finally:
            os.close(far)
        output = b""
        try:
            while part := os.read(near, 65536):
                output += part
        except OSError:  # EIO: the program has closed the terminal
            pass
        os.close(near)
        return output.decode().replace("\r", ""), process.wait(60)

    def test_without_a_command(self):
        output, code = self.on_terminal()
        self.assertEqual(code, 2)
        lines = output.strip().splitlines()
        self.assertEqual([line.split()[1] for line in lines], ["demo", "mark", "segment", "help"])
        self.assertIn("--report", lines[2])
        self.assertLessEqual(max(map(len, lines)), 100)
        self.assertNotIn("error", output)
        # Without a terminal, as in a script, a missing command is an error.
        self.refuse(code=2, expected_text="covol --help")

    def test_help_begins_with_what_to_do(self):
        text = self.run_covol("--help").stdout
        self.assertLess(text.index("covol mark stack.tif"), text.index("Commands:"))
        self.assertLess(text.index("--report cell.html"), text.index("Commands:"))
        self.assertIn("--report", self.run_covol("segment", "--help").stdout)

    def test_help_as_a_command(self):
        self.assertEqual(self.run_covol("help").stdout, self.run_covol("--help").stdout)
        for command in COMMANDS:
            self.assertEqual(self.run_covol("help", command).stdout, self.run_covol(command, "--help").stdout)
        self.refuse("help", "segmnet", code=2, expected_text="segment")
        self.refuse("help", "segment", "mesh", code=2, expected_text="expected one command")

    def test_the_version_states_the_build(self):
        first, second = self.run_covol("--version").stdout.splitlines()
        self.assertRegex(first, r"^covol \d+\.\d+\.\d+$")
        self.assertRegex(second, r"^(GCC|Clang) \d+\.\d+.*, (x86_64|aarch64), OpenVDB \d+\.\d+\.\d+")


class Demo(PageCase):
    def start(self, *words, **more):
        return self.serve("demo", *words, **more)

    def end(self, program):
        program.send_signal(signal.SIGINT)
        output = program.stderr.read()
        self.assertEqual(program.wait(60), 0, output)
        return output

    def test_a_surface_without_a_click(self):
        program, page = self.start()
        live = Live(page)
        self.addCleanup(live.close)
        [structure] = live.state["structures"]
        self.assertEqual((structure["name"], len(structure["marks"])), ("embryo", 398))
        result = live.wait_for(structure["id"], "refined", 1)
        self.assertGreater(result["volume"], 3e6)  # 4.0e6 cubic pixels according to the quickstart
        output = self.end(program)
        folder = self.out / "covol_demo"
        for name in ("celegans_embryo.tif", "celegans_marks.csv"):
            self.assertEqual((folder / name).read_bytes(), (SAMPLES / name).read_bytes())
        self.assertTrue((folder / "README.md").exists() and (folder / "celegans_embryo.tif.covol").is_dir())
        # The message names a command that does the same without a page; here it is only planned, not run.
        command = output.split("from the command line: covol ")[1].splitlines()[0].split()
        self.assertEqual(self.run_covol("plan", *command, "--quiet").returncode, 0)
        program, page = self.start()  # a second run continues the study, and does not add the marks again
        again = Live(page)
        self.addCleanup(again.close)
        self.assertEqual(len(again.state["structures"][0]["marks"]), 398)
        self.end(program)

    def test_nothing_of_others_is_replaced(self):
        (self.out / "covol_demo").mkdir()
        (self.out / "covol_demo/celegans_marks.csv").write_text("mine")
        self.assertIn("covol demo FOLDER", self.run_covol("demo", "--no-browser", code=3).stderr)
        self.assertEqual([p.name for p in (self.out / "covol_demo").iterdir()], ["celegans_marks.csv"])
        self.assertEqual((self.out / "covol_demo/celegans_marks.csv").read_text(), "mine")
        (self.out / "file").write_text("")
        self.assertIn("the folder cannot be created", self.run_covol("demo", "file", "--no-browser", code=4).stderr)


class Doctor(Case):
    def test_what_is_there(self):
        output = self.run_covol("doctor", "--json", "r.json").stdout
        found = json.loads((self.out / "r.json").read_text())["doctor"]
        self.assertEqual({part["name"]: part["problem"] for part in found["readers"]},
                         {"itk": "", "gdcm": "", "hdf5": "", "covol-reader": ""})
        self.assertTrue(any("libopenvdb.so" in path for path in found["libraries"]))
        self.assertGreater(found["memory"]["free_bytes"], 0)
        self.assertGreater(found["scratch"]["free_bytes"], 0)
        self.assertEqual(pathlib.Path(found["program"]), pathlib.Path(COVOL).resolve())
        counts = {folder: int(count) for count, folder in re.findall(r"^  (\d+) in (/.*)$", output, re.M)}
        self.assertEqual(sum(counts.values()), len(found["libraries"]))
        for folder in counts:  # no folder lies in another one, else its libraries would be counted twice
            self.assertEqual([other for other in counts if other != folder and other.startswith(folder + "/")], [])
        for word in ("instruction set", "GiB free", "browser: ", "reader hdf5: found"):
            self.assertIn(word, output)

    def test_a_browser(self):
        tools = self.out / "bin"
        tools.mkdir()
        (tools / "xdg-open").write_text("#!/bin/sh\n")
        (tools / "xdg-open").chmod(0o755)

        def browser(**more):
            environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}
            done = subprocess.run([COVOL, "doctor"], capture_output=True, text=True, env={**environment, **more}, check=True)
            return next(line for line in done.stdout.splitlines() if line.startswith("browser: "))

        self.assertEqual(browser(PATH=str(tools), DISPLAY=":0"), f"browser: opened by {tools}/xdg-open")
        self.assertIn("no display", browser(PATH=str(tools)))
        self.assertIn("no xdg-open", browser(PATH=str(self.out), DISPLAY=":0"))

    def test_what_is_wrong_is_a_warning(self):
        environment = {**os.environ, "TMPDIR": str(self.out / "nowhere")}
        done = subprocess.run([COVOL, "doctor", "--strict"], capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 5, done.stderr)
        self.assertIn("set TMPDIR", done.stderr)
        self.assertIn("browser: ", done.stdout)


if __name__ == "__main__":
    unittest.main()
