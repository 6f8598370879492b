"""Runs the program covol as a process: its output as events, and its exit code. Uses only the standard library, and nothing else of
this package: the plugins for Blender and 3D Slicer contain a copy of this file."""
import os
import queue
import re
import shutil
import signal
import subprocess
import threading

_STAGE = re.compile(r"covol: ([^:]+?)(?: \(\d+\))?: +(\d+) %")
_PREFIX = {"covol: error: ": "error", "covol: warning: ": "warning", "covol: wrote ": "wrote", "covol: ": "note"}


class Failed(Exception):
    """The program failed with this exit code; str() is its message."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


class Interrupted(Failed):
    """The program was cancelled."""


def find_program(given=""):
    """The path of the program: the given one, the variable COVOL, or covol in PATH and in installation folders. Raises Failed."""
    for found in (given, os.environ.get("COVOL"), shutil.which("covol"), os.path.expanduser("~/.local/bin/covol")):
        if found and os.path.isfile(found) and os.access(found, os.X_OK):
            return os.path.abspath(found)
        if given:
            break
    raise Failed(4, (f"{given}: expected the program covol" if given else "the program covol was not found") +
                 "; install it (docs/install.md), and set the variable COVOL, or the plugin's setting, to its path")


class Process:
    """A running process of covol. Events are pairs: ("stage", (name, fraction)), ("note", text), ("warning", text), ("wrote", path)."""

    def __init__(self, program, words, folder=None):
        """@param folder  working directory; it is removed from the paths in messages"""
        # 3D Slicer and Blender set these variables to the paths of their own libraries, which the program must not load.
        environment = {key: value for key, value in os.environ.items() if key not in ("LD_LIBRARY_PATH", "LD_PRELOAD", "PYTHONHOME")}
        self._folder = os.fspath(folder) + os.sep if folder is not None else None
        self._events, self._failure = queue.Queue(), ""
        self._process = subprocess.Popen([program, *map(str, words)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                         stderr=subprocess.PIPE, text=True, encoding="utf-8", errors="replace", cwd=folder,
                                         env=environment)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stderr:
            line = line.rstrip("\n")
            if self._folder:
                line = line.replace(self._folder, "")
            stage = _STAGE.match(line)
            if stage:
                self._events.put(("stage", (stage[1], int(stage[2]) / 100)))
                continue
            prefix = next((p for p in _PREFIX if line.startswith(p)), "")
            if _PREFIX.get(prefix) == "error":
                self._failure = line[len(prefix):]
            elif line:
                self._events.put((_PREFIX.get(prefix, "note"), line[len(prefix):]))
        self._process.stderr.close()
        self._events.put(None)

    def follow(self):
        """Yields events until the program ends."""
        for event in iter(self._events.get, None):
            yield event
        self._events.put(None)

    def poll(self):
        """The events since the last call; None once the program has ended and all have been returned."""
        found = []
        while not self._events.empty():
            event = self._events.get()
            if event is None:
                self._events.put(None)
                return found or None
            found.append(event)
        return found

    def cancel(self):
        """Requests cancellation; the program removes its temporary files."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)

    def result(self):
        """Waits for the end. Raises Failed, Interrupted."""
        code = self._process.wait()
        self._reader.join()
        if code in (130, -signal.SIGINT):  # -SIGINT: the program had not installed its signal handler yet
            raise Interrupted(code, "cancelled")
        if code != 0:
            raise Failed(code, self._failure or (f"the program covol ended with exit code {code}" if code > 0 else f"signal {-code} ended the program covol"))
