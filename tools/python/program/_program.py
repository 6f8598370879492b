"""Runs the program covol for the functions of this package, with their progress, messages, Ctrl-C and errors."""
import json
import os
import re
import shutil
import sys
import tempfile
import weakref

from . import _process
from ._errors import Error

_BESIDE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "program", "bin", "covol")
PROGRAM = os.environ.get("COVOL") or (_BESIDE if os.path.exists(_BESIDE) else None)
_FLAG = re.compile(r"--([a-z][a-z-]*)( (?=[\d.+-])[^\s;:,]+)?")
_CODES = {2: "invalid_options", 3: "invalid_input", 4: "io", 6: "numerical"}


class Folder:
    """A temporary folder for the files of a job, which is removed with the last object that needs it."""

    def __init__(self):
        self.path = tempfile.mkdtemp(prefix="covol-python-")
        self._finalizer = weakref.finalize(self, shutil.rmtree, self.path, True)

    def file(self, name):
        return os.path.join(self.path, name)


def main():
    """Entry point of the command `covol` of the installed package."""
    os.execv(_process.find_program(PROGRAM), ["covol", *sys.argv[1:]])


def run(words, call=None, folder=None):
    """Runs the program; its notes and warnings go to call.log, its stages to call.progress.

    Args:
        words: the program's arguments.
        folder: Folder that is removed from the paths in messages.

    Returns:
        list of its messages.

    Raises:
        Error; KeyboardInterrupt after Ctrl-C; what call.progress raises.
    """
    command = [*words]
    if call is not None and call.threads:
        command += ["--threads", call.threads]
    if call is not None and call.memory_limit:
        command += ["--memory-limit", call.memory_limit]
    lines = []
    try:
        process = _process.Process(_process.find_program(PROGRAM), command)
    except _process.Failed as failed:
        raise error_of(failed.code, str(failed)) from None
    try:
        for kind, value in process.follow():
            if kind == "stage":
                if call is not None and call.progress is not None:
                    call.progress(*value)
            elif kind != "wrote":
                lines.append(value.replace(folder.path + os.sep, "") if folder is not None else value)
                if call is not None:
                    call.log(kind == "warning", lines[-1])
        process.result()
    except _process.Interrupted:
        raise KeyboardInterrupt from None
    except _process.Failed as failed:
        raise error_of(failed.code, str(failed).replace(folder.path + os.sep, "") if folder is not None else str(failed)) from None
    except BaseException:
        process.cancel()
        try:
            process.result()
        except _process.Failed:
            pass
        raise
    return lines


def read_json(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def info_of(*words, call=None):
    """The output of `covol info` for a file, as a dict. Raises as run()."""
    folder = Folder()
    run(["info", *words, "--json", folder.file("info.json")], call, folder)
    return read_json(folder.file("info.json"))


def error_of(code, message):
    """The Error for a message of the program, with flags replaced by keywords."""
    found = _FLAG.search(message)
    field = found[1].replace("-", "_") if found else None
    kind = _CODES.get(code, "io")
    if kind == "invalid_input" and found and found.start() == 0:
        kind = "invalid_options"
    spelled = _FLAG.sub(lambda m: m[1].replace("-", "_") + (f" ={m[2]}" if m[2] else ""), message)
    return Error(spelled, kind, field)
