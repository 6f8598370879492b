"""timelapse() by the program: all frames in one run of it, which starts each from the one before."""
import os
import re
import shutil

from . import _program, _values
from ._errors import Error
from ._program import Folder, read_json

_ALONE = ("inside", "outside", "exterior_seed", "init", "guess", "painted")  # of a single image; the program has them for all frames


class Frames:
    """Collects the frames; the program takes them together.

    Attributes:
        started: a frame is there, so that the marks of the first one are not asked for again.
    """

    def __init__(self):
        self.folder, self._frames = Folder(), []

    @property
    def started(self):
        return bool(self._frames)

    def add(self, image, structures, start, options, call):
        """One frame; start: as --init has it, or None. @return its number. Raises Error, TypeError."""
        for own in structures.values():
            for kind in _ALONE:
                if own[kind] is not None and len(own[kind]):
                    raise Error(f"{kind}: the package that runs the program takes points and contours alone for a time-lapse", "unsupported", kind)
        flags = _values.flags_of("timelapse", options)
        number = len(self._frames)
        for n, own in enumerate(structures.values()):
            for kind in ("points", "contours"):
                if number > 0 and len(own[kind]) > len(list(self._frames[0]["structures"].values())[n][kind]):
                    raise Error(f"{kind}: expected marks of no more files than the first frame has", "unsupported", kind)
        path = image._path(self.folder, f"frame_{number}.nrrd")
        self._frames.append({"path": path, "image": image, "structures": structures, "call": call,
                             "flags": [*flags, *([] if start is None else [f"--init={start}"])]})
        return number

    def follow(self, frames, go):
        """What go() gives of each frame, in their order, as if each ran by itself: what found() makes of its files, or its Error.

        Args:
            go: of a frame: add()'s number, or an Error.
        """
        numbers = [go(frame) for frame in frames]
        results = self._run() if self._frames else []
        for number in numbers:
            yield number if isinstance(number, Error) else results[number]

    def _marks(self):
        """Flags. Marks of later frames lie in files with the frame's number, for which the program takes a pattern."""
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
        """Of each frame found(), or the Error."""
        folder, first, failed = self.folder, self._frames[0], {}

        class Noted(_values.Call):  # what is said of a frame that failed
            def __init__(self, call):
                super().__init__(call.progress, self.note, call.threads, call.memory_limit)
                self.given = call.log

            def note(self, is_warning, line):
                if found := re.fullmatch(r"frame (\d+) failed: (.*)", line, re.S):
                    failed[int(found[1])] = _program.error_of(3, found[2])
                self.given(is_warning, line)

        said = []
        try:
            # One frame alone is named twice, for the program would not take it for a time-lapse.
            paths = [frame["path"] for frame in self._frames]
            said = _program.run(["segment", *(paths if len(paths) > 1 else 2 * paths), *self._marks(), *first["flags"], "-o",
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
            log = [line.split(": ", 1)[1] for line in said if line.startswith(f"frame {number}: ")]
            made.append(self.found(own, report["frames"][number], self._frames[number]["image"], self._frames[number]["structures"], log))
        return made
