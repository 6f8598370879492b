"""covol.mark(): shows the page of `covol mark` in a notebook, and returns its marks as arrays."""
import atexit
import html
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import weakref

import numpy as np

from . import _covol, _files, _inputs
from ._errors import Error

_PATIENCE = 30  # maximum time in seconds for the program to end


def _program(given):
    found = given or os.environ.get("COVOL") or getattr(_covol, "PROGRAM", None) or shutil.which("covol")
    if not found:
        raise Error("mark: the program covol was not found; install it, or name it with program=", "io", "program")
    return os.path.abspath(os.fspath(found))


def _notebooks():
    """Origins of the notebook servers of this user that run on this machine."""
    try:
        from jupyter_server.serverapp import list_running_servers
        ports = {int(server["port"]) for server in list_running_servers()}
    except Exception:  # noqa: BLE001 - list_running_servers() reads files of Jupyter, which may be invalid
        ports = set()
    return [f"http://localhost:{port}" for port in sorted(ports or {8888})]


def _end(process, folder):
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    process.stdout.close()
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


class Study:
    """A study that is marked on a page, in a notebook's output or in a browser, and its current state.

    Attributes:
        url: the page's address, including its secret: everyone who has it can change the study while the page is served.
        folder: of the study.
        image: the Image.
    """

    def __init__(self, volume, marks, study, program, notebook, height, geometry):
        self._own = tempfile.mkdtemp(prefix="covol-mark-")
        try:
            self.image = _inputs.image(volume, **geometry)
            self.folder = os.path.abspath(os.fspath(study)) if study is not None else os.path.join(self._own, "study")
            if _inputs.is_path(volume):
                path = os.path.abspath(os.fspath(volume))
            else:  # stored in the study, which can then be opened again without the array
                os.makedirs(self.folder, exist_ok=True)
                path = os.path.join(self.folder, "volume.nrrd")
                _files.write_nrrd(path, self.image)
            self._height = int(height)
            origins = [notebook] if isinstance(notebook, str) else _notebooks() if notebook is None else list(notebook)
            command = [_program(program), "mark", path, self.folder, "--no-browser", "--quiet"]
            for origin in origins:
                command += ["--in-frame-of", origin.rstrip("/")]
            if _inputs.is_path(volume) and geometry.get("spacing") is not None:
                command += ["--spacing", ",".join(repr(float(x)) for x in np.broadcast_to(geometry["spacing"], 3))]
            for name, places in _named(marks).items():
                file = os.path.join(self._own, f"marks{len(command)}.csv")
                _files.write_positions(file, places)
                command += ["--points", f"{name}={file}"]
            # The program runs in a session of its own, so that Ctrl-C in a notebook stops the cell, but not the page.
            with open(os.path.join(self._own, "output.txt"), "w+") as printed:
                self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=printed, text=True, start_new_session=True)
                line = self._process.stdout.readline()
                if not line.startswith("open "):
                    _end(self._process, None)
                    printed.seek(0)
                    raise Error(printed.read().strip() or "mark: the program ended", "io")
        except BaseException:
            shutil.rmtree(self._own, ignore_errors=True)
            raise
        self.url = line.split()[1]
        host = origins[0].split("://", 1)[-1].split(":")[0] if origins else "127.0.0.1"
        self._framed = self.url.replace("127.0.0.1", "localhost", 1) if host == "localhost" else self.url
        self._known = None
        self._finalizer = weakref.finalize(self, _end, self._process, self._own)
        atexit.register(self._finalizer)

    @property
    def is_open(self):
        """Whether the page is served."""
        return self._process.poll() is None

    @property
    def marks(self):
        """The current structures and their marks, as from read_study(); not available with the wheel, which lacks it."""
        return _covol.read_study(self.folder)

    @property
    def options(self):
        """The study's current options, as from read_study_options()."""
        return _covol.read_study_options(self.folder)

    @property
    def result(self):
        """The current surfaces of all structures that have marks: Structures, with `mask`. Computed if the study has changed."""
        journal = pathlib.Path(self.folder) / "journal.jsonl"
        size = journal.stat().st_size  # changes with each action, because actions are only appended to the journal
        if self._known is None or self._known[0] != size:
            from . import Structures, structures
            if hasattr(_covol, "solve_study"):  # solved by the program covol, which reads the study itself
                self._known = size, Structures(*_covol.solve_study(self.image, self.folder, {}, _inputs.call()))
            else:
                self._known = size, structures(self.image, self.marks, **self.options)
        return self._known[1]

    def close(self):
        """Ends the program. A study in a temporary folder is deleted."""
        self._finalizer()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __repr__(self):
        return f"<covol.Study: {self.folder}, {'open' if self.is_open else 'closed'}>"

    def _repr_html_(self):
        if not self.is_open:
            return "<p>This study is closed.</p>"
        frame, page = html.escape(self._framed, quote=True), html.escape(self.url, quote=True)
        return (f'<iframe src="{frame}" title="covol mark" style="width:100%;height:{self._height}px;border:0" '
                f'allow="fullscreen"></iframe><p><a href="{page}" target="_blank" rel="noreferrer">in a window of its own</a></p>')


def _named(marks):
    """Points of each structure, (n, 3), by its name."""
    if marks is None:
        return {}
    given = marks if isinstance(marks, dict) else {"structure 1": marks}
    named = {}
    for name, value in given.items():
        value = value.get("points") if isinstance(value, dict) else value
        places = np.asarray(value, float)
        if places.ndim != 2 or places.shape[1] != 3:
            raise Error(f"marks: expected shape (n, 3), got {places.shape}", "invalid_input", "marks")
        named[str(name)] = places
    return named


def mark(volume, marks=None, *, study=None, spacing=None, origin=None, direction=None, affine=None, notebook=None, program=None,
         height=760):
    """Shows the page of `covol mark` in a notebook's output cell, and returns its marks as arrays.

    Args:
        volume: as the image of segment(); an array is written to a temporary file.
        marks: points on the surface, shape (n, 3), world units; or a dict of these by the structures' names.
        study: folder of the study; None: a temporary one, which close() removes.
        spacing, origin, direction, affine: see segment().
        notebook: origin of the notebook, "http://localhost:8888", or a list of origins: only pages of these origins may show the
            page in a frame. None: those of the notebook servers that run on this machine, or that one if there are none.
        program: path of the program covol; None: the variable COVOL, or covol in PATH.
        height: of the output cell, pixels.

    Returns:
        Study, which a notebook displays. `study.marks` and `study.result.mask` give the current state; `study.close()` ends it.

    Raises:
        Error: as read_image() and the program; "io" if the program is not found.
    """
    return Study(volume, marks, study, program, notebook, height,
                 {"spacing": spacing, "origin": origin, "direction": direction, "affine": affine})
