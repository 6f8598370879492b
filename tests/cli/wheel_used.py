"""Uses the installed wheel in a folder where the program has made p.nrrd, p.csv, s.vdb, s.ply, s.nrrd and s.json of one job.

Prints {"package": folder, "checks": {what: whether it holds}} as JSON. For comparisons the files are read here by other code than
the package's.
"""
import json
import logging
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import threading

import numpy as np

import covol

checks = {}


def error(call, *words, **keywords):
    """(code, field) of the covol.Error that a call raises."""
    try:
        call(*words, **keywords)
    except covol.Error as found:
        pickle.loads(pickle.dumps(found))
        return found.code, found.field
    return None


def raises(kind, call, *words, **keywords):
    try:
        call(*words, **keywords)
    except kind:
        return True
    return False


expected = json.loads(pathlib.Path("s.json").read_text())
image, marks = covol.read_image("p.nrrd"), covol.read_points("p.csv")
voxels = np.array(image.array)
checks["image"] = image.shape == (40, 40, 40) and image.dtype == voxels.dtype == np.uint8 and not image.array.flags.writeable
checks["image geometry"] = np.allclose(image.world_to_index(image.index_to_world([[1, 2, 3]])), [[1, 2, 3]])
checks["points"] = len(marks) == 120 and marks.array.shape == (120, 3) and marks.space == "world"

# segment() from files and from arrays gives exactly the result of the program covol (s.json, s.ply, s.nrrd).
by_files = covol.segment("p.nrrd", "p.csv")
by_arrays = covol.segment(voxels, np.asarray(marks), spacing=image.spacing, origin=image.origin, direction=image.direction)
data = pathlib.Path("s.ply").read_bytes()
head = data[:data.index(b"end_header\n")].decode()
count = int(head.split("element vertex ")[1].split()[0])
for name, result in (("files", by_files), ("arrays", by_arrays)):
    checks[f"report by {name}"] = result.report["surface"] == expected["surface"]
    checks[f"mesh by {name}"] = len(result.mesh.vertices) == count and result.mesh.faces.max() == count - 1
    result.mesh.save("again.ply")
    checks[f"volume by {name}"] = abs(result.mesh.measure()["volume"] / expected["surface"]["volume"] - 1) < 1e-5
    result.save(f"{name}.nrrd")
    checks[f"mask by {name}"] = covol.compare(f"{name}.nrrd", "s.nrrd")["dice"] == 1
    checks[f"level set by {name}"] = covol.compare(result.surface, "s.vdb")["hausdorff"] < 1e-12
checks["mask"] = by_arrays.mask.dtype == np.uint8 and by_arrays.mask.shape == voxels.shape and 0 < by_arrays.mask.sum() < voxels.size
checks["box"] = all(a < b for a, b in zip(*by_files.surface.box)) and by_files.surface.voxel_size > 0
checks["normals"] = np.allclose(np.linalg.norm(by_files.mesh.normals, axis=1), 1, atol=1e-3)
checks["log"] = isinstance(by_files.log, list) and by_files.warnings == by_files.report["warnings"]
checks["suggest"] = all(s.area >= 0 for s in by_files.suggest(2)) and len(by_files.suggest(2)) <= 2
checks["html"] = "covol.Result" in by_files._repr_html_() and "volume" in repr(by_files)

# Further arguments of segment(), and the other functions.
checks["index space"] = np.array_equal(covol.segment(voxels, image.world_to_index(marks)[:, ::-1], points_space="index", spacing=image.spacing,
                                                     origin=image.origin).mask, by_arrays.mask)
checks["zyx"] = np.array_equal(covol.segment(image, np.asarray(marks)[:, ::-1], points_order="zyx").mask, by_arrays.mask)
checks["int64"] = np.array_equal(covol.segment(voxels.astype(np.int64), marks, spacing=image.spacing, origin=image.origin).mask, by_arrays.mask)
checks["options"] = covol.options()["theta"] == 1.0 and covol.options()["voxel_size"] is None
coarse = covol.segment(image, marks, voxel_size="2vx", model="guided", init="tag", exterior_seed=[image.origin])
checks["given options"] = coarse.report["grid"]["voxel_size"] > 1.9 * by_files.report["grid"]["voxel_size"]
inside = covol.segment(image, inside=[np.mean(np.asarray(marks), 0)], outside=[image.origin], guess=by_files)
checks["guess and seeds"] = covol.compare(inside, by_files)["dice"] > 0.98
cloud = covol.reconstruct(marks)
checks["reconstruct"] = cloud.report["surface"]["closed"] and error(lambda: cloud.mask)[0] == "invalid_input"
checks["normals of a cloud"] = covol.reconstruct(np.asarray(marks), normals=np.asarray(marks) - np.mean(marks, 0)).report["surface"]["closed"]
two = covol.structures(image, {"a b": np.asarray(marks), "c": {"points": np.asarray(marks) * 0.6}})
checks["structures"] = list(two) == ["a b", "c"] and set(np.unique(two.mask)) == {0, 1, 2} and len(two.overlaps) == 1
checks["structures' meshes"] = all(two[n].mesh.measure()["closed"] for n in two) and len(two["c"].marks) == 120
checks["structures' masks"] = np.array_equal(two["c"].mask > 0, two.mask == two["c"].label)
ball = covol.mesh(by_files, target_edge="3vx")
checks["mesh"] = 0 < len(ball.faces) < len(by_files.mesh.faces) and ball.measure()["closed"]
checks["own mesh"] = covol.compare(covol.Mesh(ball.vertices, ball.faces), ball)["dice"] == 1
checks["mask of a level set"] = set(np.unique(covol.mask("s.vdb", image, label=7))) == {0, 7}
checks["distances"] = covol.distances(marks, by_files)["mean"] < 0.5 * by_files.report["grid"]["voxel_size"]
phantom, places, truth = covol.phantom("torus", 32, 50)
checks["phantom"] = phantom.shape == truth.shape == (32, 32, 32) and places.shape == (50, 3) and truth.max() == 1
covol.save_mask("labels.nii.gz", np.where(truth > 0, 300, 0), phantom)
checks["save_mask"] = covol.read_image("labels.nii.gz").array.max() == 300

# A time-lapse of four frames: the second is invalid, the body moves along z by one voxel between the others, and the
# last has marks of its own.
where = dict(spacing=image.spacing, origin=image.origin)
further = [np.roll(voxels, n, axis=0) for n in (1, 2)]
places, step = np.asarray(marks), np.array([0, 0, image.spacing[2]])
lapse = list(covol.timelapse(iter([voxels, np.zeros((0, 3, 3)), further[0], (further[1], places + 2 * step)]), places, **where))
checks["time-lapse"] = np.array_equal(lapse[0].mask, by_arrays.mask) and lapse[0].report["surface"] == expected["surface"]
checks["a frame that fails"] = isinstance(lapse[1], covol.Error) and lapse[1].code == "invalid_input"
heights = [r.mesh.vertices[:, 2].mean() for r in (lapse[0], *lapse[2:])]
checks["it is followed"] = np.allclose(np.diff(heights), step[2], atol=0.2 * step[2])
checks["marks of frames"] = [r.report["input"]["points"]["count"] for r in (lapse[0], *lapse[2:])] == [120, 0, 120]
both = list(covol.timelapse([voxels, further[0]], {"a": places, "b": {"points": places * 0.6}}, **where))
checks["structures of frames"] = [list(found) for found in both] == [["a", "b"]] * 2 and set(np.unique(both[1].mask)) == {0, 1, 2}
checks["no frame succeeds"] = [e.code for e in covol.timelapse([voxels, voxels], places + 1e4, **where)] == ["invalid_input"] * 2

# An unknown argument raises TypeError; an invalid one raises covol.Error with a code and the name of the argument.
checks["option that is none"] = raises(TypeError, covol.segment, image, marks, tag_distanc=3)
checks["bad option"] = error(covol.segment, image, marks, theta=2) == ("invalid_options", "theta")
checks["bad length"] = error(covol.segment, image, marks, tau="3px") == ("invalid_options", "tau")
checks["outside"] = error(covol.segment, image, np.asarray(marks) + 1e4)[0] == "invalid_input"
checks["no file"] = error(covol.segment, "none.tif", marks)[0] == "io"
checks["shape"] = error(covol.segment, image, np.zeros((3, 2))) == ("invalid_input", "points")
seeds = list(covol.timelapse([voxels], {"points": np.asarray(marks), "inside": [np.mean(np.asarray(marks), 0)]}))
checks["seeds of a time-lapse"] = [e.code for e in seeds] == ["unsupported"]
set_options = [{"do": "set_options", "options": options} for options in ({"rho": 0.5}, {})]
journal = ({"covol_study": 1}, *set_options, {"do": "undo"})
pathlib.Path("journal.jsonl").write_text("".join(json.dumps(line) + "\n" for line in journal))
checks["read_study_options"] = covol.read_study_options(".") == {"rho": 0.5}
checks["options of no study"] = error(covol.read_study_options, "none")[0] == "io"
checks["read_study"] = error(covol.read_study, "none")[0] == "unsupported"

# The log, the callback for progress, exceptions that it raises, and Ctrl-C.
lines = []
handler = logging.Handler()
handler.emit = lambda record: lines.append((record.levelno, record.getMessage()))
logging.getLogger("covol").addHandler(handler)
logging.getLogger("covol").setLevel(logging.INFO)
covol.segment(image, marks)
checks["logger"] = any("voxel size" in text or "voxel_size" in text or "surface" in text for _, text in lines)
long = dict(init="tag", max_steps=100000, tolerance=1e-12, tau=0.0001)
large, many, _ = covol.phantom("sphere", 128, 3000)
seen = []


def stop(stage, fraction):
    seen.append((stage, fraction))
    raise LookupError


checks["progress"] = raises(LookupError, covol.segment, large, many, progress=stop, **long) and bool(seen[0][0]) and 0 <= seen[0][1] <= 1
timer = threading.Timer(1.5, os.kill, (os.getpid(), signal.SIGINT))
timer.start()
checks["Ctrl-C"] = raises(KeyboardInterrupt, covol.segment, large, many, **long)
study = covol.mark(image, {"ball": np.asarray(marks)}, notebook=[])
checks["mark"] = study.is_open and study.url.startswith("http://127.0.0.1:") and covol.compare(study.result["ball"], by_files)["dice"] > 0.99
study.close()
made = subprocess.run([sys.executable, "-c", "import covol; print(covol.phantom('sphere', 16, 20)[0]._folder.path)"],
                      capture_output=True, text=True, check=True).stdout.strip()
checks["files are gone"] = "covol-python-" in made and not os.path.exists(made)
print(json.dumps({"package": os.path.dirname(covol.__file__), "checks": {name: bool(fine) for name, fine in checks.items()}}))
