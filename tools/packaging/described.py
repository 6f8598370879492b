"""Reads the output of `covol --describe-options` for the scripts in this folder. Standard library only."""
import json
import re
import subprocess
import sys


class Option:
    """An option of a command; a positional has no flags."""

    def __init__(self, described):
        self.flags = [flag.strip() for flag in described["names"].split(",") if flag]
        self.value, self.text = described["value"], described["text"]
        self.default, self.required = described["default"], described["required"]

    @property
    def takes_value(self):
        return bool(self.value) and not self.value.startswith("[=")

    @property
    def is_list(self):
        """Whether the flag or positional may have several values."""
        return self.value.endswith("...")

    @property
    def words(self):
        """The possible values of a choice; empty for other types."""
        return self.value.split("|") if re.fullmatch(r"[a-z0-9-]+(\|[a-z0-9-]+)+", self.value) else []

    @property
    def is_file(self):
        """Whether the value is, or may be, a file name."""
        return not self.words and bool(re.search(r"FILE|IMAGE|OUT|IN\b|^[AB]$|START|FOLDER|\.vdb", self.value))


class Command:
    def __init__(self, name, description, groups):
        self.name, self.description = name, description
        self.groups = [(group["name"], [Option(o) for o in group["options"]]) for group in groups]

    @property
    def options(self):
        return [option for _, options in self.groups for option in options]

    @property
    def flags(self):
        return [option for option in self.options if option.flags]

    @property
    def positionals(self):
        return [option for option in self.options if not option.flags]


class Program:
    """@param source  path of the program, or - to read its description from standard input"""

    def __init__(self, source):
        run = lambda *words: subprocess.run([source, *words], capture_output=True, text=True, check=True).stdout
        described = json.loads(sys.stdin.read() if source == "-" else run("--describe-options"))
        self.version = "" if source == "-" else run("--version").split()[1]
        self.common = Command("", "", described["common"])
        self.commands = [Command(c["name"], c["description"], c["groups"]) for c in described["commands"]]
