"""timelapse() with the program: one run for all frames, in which each starts from the previous one."""
import os
import re
import shutil

from . import _program, _values
from ._errors import Error
from ._program import Folder, read_json

_ALONE = ("inside", "outside", "exterior_seed", "init", "guess", "painted")  # refused for a time-lapse: the program would use them for all frames


class Frames:
    """Collects the frames, which are passed to the program together.

    Attributes:
        started: whether a frame has been added, after which the marks of the first one are not needed again.
    """

    def __init__(self):
        self.folder, self._frames = Folder(), []

    @property
    def started(self):
        return bool(self._frames)

    def add(self, image, structures, start, options, call):
        """Adds a frame; start: as for --init, or None. @return its number. Raises Error, TypeError."""
        for own in structures.values():
            for kind in _ALONE:
                if own[kind] is not None and len(own[kind]):
                    raise Error(f"{kind}: for a time-lapse, this package, which runs the program covol, accepts only points and contours", "unsupported", kind)
        flags = _values.flags_of("timelapse", options)
        number = len(self._frames)
        for n, own in enumerate(structures.values()):
            for kind in ("points", "contours"):
                if number > 0 and len(own[kind]) > len(list(self._frames[0]["structures"].values())[n][kind]):
                    raise Error(f"{kind}: expected at most as many files of marks as for the first frame", "unsupported", kind)
        path = image._path(self.folder, f"frame_{number}.nrrd")
        self._frames.append({"path": path, "image": image, "structures": structures, "call": call,
                             "flags": [*flags, *([] if start is None else [f"--init={start}"])]})
        return number

    def follow(self, frames, go):
        """Yields for each frame, in order, the result of found() or its Error, as if each frame had been run separately.

        Args:
            go: adds a frame, and returns the number from add(), or an Error.
        """
        numbers = [go(frame) for frame in frames]
        results = self._run() if self._frames else []
        for number in numbers:
            yield number if isinstance(number, Error) else results[number]

    def _marks(self):
        """Command-line options. Marks of later frames are in files with the frame's number, for which the program accepts a pattern."""
        words = []
        for n, name in enumerate(self._frames[0]["structures"]):
            for kind in ("points", "contours"):
                for m in range(len(self._frames[0]["structures"][name][kind])):
                    paths = {}
                    for number, frame in enumerate(self._frames):
                        clouds = frame["structures"][name][kind]
                        if m < len(clouds):
                            paths[number] = clouds[m]._path(self.folder, f"given_{kind}_{n}_{m}_{number}", frame["image"])
                    if len(paths) == 1:
                        file = paths[0]
                    else:
                        file = self.folder.file(f"{kind}_{n}_{m}_{{frame}}{os.path.splitext(paths[0])[1]}")
                        for number, path in paths.items():
                            shutil.copyfile(path, file.replace("{frame}", str(number)))
                    words += [f"--{kind}", f"{name}={file}" if name else file]
        return words

    def _run(self):
        """The result of found(), or the Error, for each frame."""
        folder, first, failed = self.folder, self._frames[0], {}

        class Noted(_values.Call):  # stores the error of each frame that failed
            def __init__(self, call):
                super().__init__(call.progress, self.note, call.threads, call.memory_limit)
                self.given = call.log

            def note(self, is_warning, line):
                if found := re.fullmatch(r"frame (\d+) failed: (.*)", line, re.S):
                    failed[int(found[1])] = _program.error_of(3, found[2])
                self.given(is_warning, line)

        lines = []
        try:
            # A single frame is passed twice, because the program would not treat it as a time-lapse otherwise.
            paths = [frame["path"] for frame in self._frames]
            lines = _program.run(["segment", *(paths if len(paths) > 1 else 2 * paths), *self._marks(), *first["flags"], "-o",
                                 folder.file("surface.vdb"), "--mesh", folder.file("mesh.ply"), "--mask", folder.file("mask.nrrd"), "--json",
                                 folder.file("report.json")], Noted(first["call"]), folder)
        except Error as error:
            if not os.path.exists(folder.file("report.json")):
                return [failed.get(number, error) for number in range(len(self._frames))]
        report = read_json(folder.file("report.json"))
        digits = max(3, len(str(len(report["frames"]) - 1)))
        made = []
        for number in range(len(self._frames)):
            if number in failed:
                made.append(failed[number])
                continue
            own, tag = Folder(), f"_t{number:0{digits}}"
            for file in os.listdir(folder.path):
                if tag in file:
                    shutil.move(folder.file(file), own.file(file.replace(tag, "")))
            log = [line.split(": ", 1)[1] for line in lines if line.startswith(f"frame {number}: ")]
            made.append(self.found(own, report["frames"][number], self._frames[number]["image"], self._frames[number]["structures"], log))
        return made
