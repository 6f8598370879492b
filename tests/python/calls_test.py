"""How calls behave: progress, Ctrl-C, other threads, errors."""
import json
import logging
import os
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import covol


def work(**more):
    """A job that takes some seconds: a flow to a sphere in noise."""
    image, points, _ = covol.phantom("sphere", 128, 3000)
    return covol.segment(image, points, init="tag", max_steps=5000, tolerance=1e-12, tau=0.001, **more)


def test_progress(sphere):
    image, points, _ = sphere
    here, seen = threading.get_ident(), []
    covol.segment(image, points, progress=lambda stage, fraction: seen.append((threading.get_ident(), stage, fraction)))
    assert seen and all(thread == here for thread, _, _ in seen)
    assert all(0 <= fraction <= 1 and stage for _, stage, fraction in seen)


def test_progress_that_raises():
    def stop(stage, fraction):
        raise LookupError("enough")

    began = time.monotonic()
    with pytest.raises(LookupError, match="enough"):
        work(progress=stop)
    assert time.monotonic() - began < 20


INTERRUPTED = """
import os, signal, threading, time
import covol
from calls_test import work

def interrupt():
    time.sleep(0.3)
    print("sent", time.monotonic(), flush=True)
    os.kill(os.getpid(), signal.SIGINT)

begun = []
def progress(stage, fraction):
    if not begun:
        begun.append(threading.Thread(target=interrupt))
        begun[0].start()
try:
    work(progress=progress)
except KeyboardInterrupt:
    print("interrupted", time.monotonic(), flush=True)
"""


def test_ctrl_c():
    done = subprocess.run([sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=120,
                          cwd=os.path.dirname(__file__))
    times = {line.split()[0]: float(line.split()[1]) for line in done.stdout.splitlines()}
    assert done.returncode == 0 and set(times) == {"sent", "interrupted"}, done.stdout + done.stderr
    assert times["interrupted"] - times["sent"] < 5


def test_other_threads_go_on():
    """A thread that counts is not blocked by one that computes."""
    counts, stop = [0], threading.Event()
    longest = [0.0]

    def count():
        last = time.monotonic()
        while not stop.is_set():
            counts[0] += 1
            time.sleep(0.005)
            now = time.monotonic()
            longest[0], last = max(longest[0], now - last), now

    thread = threading.Thread(target=count)
    thread.start()
    began = time.monotonic()
    image, points, _ = covol.phantom("sphere", 100, 3000)
    covol.segment(image, points, init="tag", max_steps=30, tolerance=1e-12)
    seconds = time.monotonic() - began
    stop.set()
    thread.join()
    assert seconds > 0.3 and counts[0] > 3 and longest[0] < 0.5 * seconds, (seconds, counts, longest)


def test_two_calls_at_once(sphere):
    image, points, _ = sphere
    masks = [None, None]

    def run(n):
        masks[n] = covol.segment(image, points, threads=n + 1).mask

    threads = [threading.Thread(target=run, args=(n,)) for n in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(*masks)


@pytest.mark.parametrize("options, code, field", [
    ({"tau": -1}, "invalid_options", "tau"), ({"tau": "3px"}, "invalid_options", "tau"), ({"tau": []}, "invalid_options", "tau"),
    ({"theta": 2}, "invalid_options", "theta"), ({"model": "other"}, "invalid_options", "model"),
    ({"max_steps": 1.5}, "invalid_options", "max_steps"), ({"max_steps": "many"}, "invalid_options", "max_steps"),
    ({"hole_distance": -1}, "invalid_options", "hole_distance"),
    ({"voxel_size": 0}, "invalid_options", "voxel_size"), ({"roi": (0, 0, 0)}, "invalid_options", "roi"),
    ({"init": "spher:1"}, "invalid_options", "init"), ({"threads": -1}, "invalid_options", "threads"),
    ({"points_space": "here"}, "invalid_options", "points_space"), ({"points": np.zeros((3, 2))}, "invalid_input", "points"),
    ({"points": [[0, 0, np.inf]]}, "invalid_input", "points"), ({"points": [["a", "b", "c"]]}, "invalid_input", "points"),
    ({"inside": [[1, 2]]}, "invalid_input", "inside"), ({"progress": 3}, "invalid_options", "progress"),
])
def test_errors(sphere, options, code, field):
    image, points, _ = sphere
    with pytest.raises(covol.Error) as error:
        covol.segment(image, **{"points": points, **options})
    assert (error.value.code, error.value.field) == (code, field), error.value
    again = pickle.loads(pickle.dumps(error.value))
    assert (str(again), again.code, again.field) == (str(error.value), code, field)


def test_an_error_names_what_would_help(sphere):
    image, points, _ = sphere
    voxels = image.world_to_index(points)  # indices z, y, x, which are wrong as world positions
    with pytest.raises(covol.Error) as error:
        covol.segment(image, voxels)
    assert error.value.field == "points_space" and "points_space = 'index'" in str(error.value)
    assert covol.segment(image, voxels, points_space="index", points_order="zyx").report["surface"]["closed"]


def test_an_unknown_option(sphere):
    with pytest.raises(TypeError, match="did you mean 'delta'"):
        covol.segment(sphere[0], sphere[1], detla=1)


def test_missing_files():
    for read in (covol.read_image, covol.read_points, covol.read_mesh, covol.read_level_set):
        with pytest.raises(covol.Error) as error:
            read("/nowhere/a.vdb" if read is not covol.read_points else "/nowhere/a.csv")
        assert error.value.code == "io" or read is covol.read_mesh


def test_choices_are_logged(sphere, caplog):
    image, points, _ = sphere
    with caplog.at_level(logging.INFO, "covol"):
        result = covol.segment(image, points)
    assert [record.message for record in caplog.records if record.name == "covol"] == result.log
    assert any("voxel_size" in line for line in result.log)


def test_a_study_gives_the_same_as_its_marks(sphere, tmp_path):
    image, points, _ = sphere
    some = points[::len(points) // 40]
    size = image.array.shape[::-1]
    lines = [{"covol_study": 1, "image": {"path": "x.tif", "size": size, "spacing": list(image.spacing), "origin": list(image.origin),
                                          "direction": np.asarray(image.direction).tolist()}},
             {"do": "add_structure", "name": "ball"}, {"do": "add_structure", "name": "nothing yet"}]
    lines += [{"do": "add_mark", "structure": 1, "kind": "surface", "world": mark.tolist()} for mark in some]
    lines += [{"do": "add_mark", "structure": 1, "kind": "outside", "world": some[0].tolist()}, {"do": "undo"}]
    (tmp_path / "journal.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    study = covol.read_study(tmp_path)
    assert list(study) == ["ball"] and list(study["ball"]) == ["points"]
    ours, theirs = covol.structures(image, study), covol.structures(image, {"ball": {"points": some}})
    assert np.array_equal(ours["ball"].mesh.vertices, theirs["ball"].mesh.vertices)
    with pytest.raises(covol.Error) as error:
        covol.read_study(tmp_path / "nowhere")
    assert error.value.code == "io"
