"""The help of each command; its groups do not appear in option files. Standard library only.

    COVOL=build/bin/covol python3 -m unittest tests/cli/help_test.py
"""
import json
import re
import unittest

from covol_case import COMMANDS, Case

# Commands of which --help lists a selection of the options.
LONG = ["segment", "reconstruct", "distance", "band", "evolve", "convert", "render", "report"]
MAX_SELECTED = 14  # maximum number of options in such a selection, without --help and --help-all


class Help(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.first, cls.all = {}, {}

    def setUp(self):
        super().setUp()
        for command in COMMANDS:
            if command not in self.first:
                self.first[command] = self.run_covol(command, "--help").stdout
                self.all[command] = self.run_covol(command, "--help-all").stdout
        self.described = json.loads(self.run_covol("--describe-options").stdout)

    @staticmethod
    def options_of(text):
        """{group: first names of its options}"""
        groups = {}
        for line in text.splitlines():
            if re.fullmatch(r"[A-Z][\w ]*:", line):
                group = groups.setdefault(line[:-1], [])
            elif entry := re.match(r"  (\S+)", line):
                if not line.startswith(" " * 3):
                    group.append(entry[1].rstrip(","))
        return groups

    def groups_of(self, command):
        return next(c for c in self.described["commands"] if c["name"] == command)["groups"]

    def test_every_command_is_described(self):
        self.assertEqual([c["name"] for c in self.described["commands"]], COMMANDS)

    def test_every_option_stands_in_a_group(self):
        for command in COMMANDS:
            groups = {g["name"]: [o["names"] for o in g["options"]] for g in self.groups_of(command)}
            self.assertNotIn("Options", groups, command)
            self.assertEqual(groups["Help"], ["-h, --help", "--help-all"], command)

    def test_help_all_shows_every_option(self):
        for command in COMMANDS:
            shown = self.options_of(self.all[command])
            for group in self.groups_of(command):
                expected = [(o["names"] or o["value"]).split()[0].rstrip(",").split("[=")[0] for o in group["options"]]
                self.assertEqual([name.split("[=")[0] for name in shown[group["name"]]], expected, command)
            self.assertIn("--threads", shown["Options of every command"], command)

    def test_help_shows_a_selection_and_states_it(self):
        for command in COMMANDS:
            shown = sum(map(len, self.options_of(self.first[command]).values()))
            count = sum(len(g["options"]) for g in self.groups_of(command))
            if command in LONG:
                self.assertLessEqual(shown - 2, MAX_SELECTED, command)
                self.assertIn(f"covol {command} --help-all shows {count - shown} more options.", self.first[command])
            else:
                self.assertEqual(shown, count, command)
                self.assertNotIn("more options", self.first[command])

    def test_help_shows_what_is_required(self):
        for command in COMMANDS:
            for group in self.groups_of(command):
                for option in group["options"]:
                    if option["required"]:
                        self.assertIn((option["names"] + " " + option["value"]).strip(), self.first[command], command)

    def test_lines_are_short(self):
        for text in list(self.first.values()) + list(self.all.values()):
            self.assertLessEqual(max(map(len, text.splitlines())), 110)

    def test_of_the_program(self):
        text = self.run_covol("--help").stdout
        self.assertEqual(self.options_of(text)["Commands"], COMMANDS)
        self.assertNotIn("describe-options", text)
        everything = self.run_covol("--help-all").stdout
        for command in COMMANDS:
            self.assertIn(f"Usage: covol {command}", everything)

    def test_a_single_step_has_its_own_defaults(self):
        self.assertIn("weight of curvature [1vx]", self.first["evolve"])
        self.assertIn("weight of curvature [0.25vx after tagging, for contours or a guess, 0.1vx after growth, else 1vx]",
                      " ".join(self.all["segment"].split()))


class OptionFiles(Case):
    def lines(self, path):
        return [line for line in (self.out / path).read_text().splitlines() if line and not line.startswith("#")]

    def test_saved_options_are_one_list(self):
        # Options of five groups, in an order other than that in which the program defines them.
        self.run_covol("segment", self.image, "--up", "y", "--sigma", "1vx", "--points", self.points, "--delta", "2vx", "-o", "s.vdb",
                       "--mesh", "m.ply", "--epsilon", "0.02", "--save-config", "c.toml")
        self.assertNotRegex((self.out / "c.toml").read_text(), r"(?m)^# [\w ]+ Options$")
        self.assertEqual([line.split("=")[0] for line in self.lines("c.toml")],
                         ["image", "points", "output", "mesh", "delta", "epsilon", "sigma", "up"])

    def test_a_file_of_an_earlier_version(self):
        # The comments of this configuration are descriptions of options that have changed since. Comments are ignored.
        (self.out / "old.toml").write_text(
            '# covol 1.0.0, segment\n# Image and points together: the surface of a structure\n\n'
            '# 3D image: TIFF, NRRD, NIfTI, MetaImage; several are the frames of a time-lapse\n'
            f'image="{self.image}"\n\n# point clouds: XYZ, CSV, PLY, OBJ, OFF; with names, ve=FILE exe=FILE, several structures\n'
            f'points="{self.points}"\n\n# the surface as a level set, .vdb\noutput="s.vdb"\n\n# weight of the points, 0 to 1\ntheta=0.5\n\n'
            '# weight of curvature [0.5vx after tagging or a guess, else 1vx]\ndelta="2vx"\n')
        report = self.report("segment", "--config", "old.toml", "--save-config", "new.toml")
        self.assertEqual(report["resolved"]["theta"], 0.5)
        self.assertEqual(self.lines("new.toml"), self.lines("old.toml"))


if __name__ == "__main__":
    unittest.main()
