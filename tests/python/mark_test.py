"""covol.mark(): a study next to a notebook, and its representation there."""
import importlib.util
import json
import os
import pathlib
import re
import sys
import urllib.request

import numpy as np
import pytest

import covol

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cli"))
from live_client import Live, Page  # noqa: E402


@pytest.fixture
def study(sphere, program):
    image, points, _ = sphere
    with covol.mark(image.array, {"ball": points[::4]}, spacing=image.spacing, origin=image.origin, program=program,
                    notebook="http://localhost:8888") as made:
        yield made


def test_marks_and_result_follow_the_page(sphere, study):
    image, points, labels = sphere
    assert list(study.marks) == ["ball"]
    np.testing.assert_allclose(study.marks["ball"]["points"].array, points[::4], atol=1e-12)
    mask = study.result.mask
    assert mask.shape == labels.shape
    assert 2 * ((mask > 0) & (labels > 0)).sum() / ((mask > 0).sum() + (labels > 0).sum()) > 0.95
    assert study.result is study.result  # computed once, while the study is unchanged
    before = study.result
    live = Live(Page(study.url))
    live.add_mark(1, points[1].tolist())
    live.act(do="set_options", options={"voxel_size": 2 * image.spacing[0]})
    assert len(study.marks["ball"]["points"]) == len(points[::4]) + 1
    assert study.options == {"voxel_size": 2 * image.spacing[0]}
    assert study.result is not before
    assert len(study.result["ball"].mesh.faces) < len(before["ball"].mesh.faces)
    live.close()


def test_options_of_a_study(sphere, program, tmp_path):
    """Those of the last set_options that is not undone. The package of the wheel, which reads the journal, agrees."""
    path = pathlib.Path(__file__).resolve().parents[2] / "tools/python/program/_study.py"
    wheel = importlib.util.module_from_spec(importlib.util.spec_from_file_location("covol._study", path))
    wheel.__spec__.loader.exec_module(wheel)
    covol.mark(sphere[0], study=tmp_path, program=program, notebook=[]).close()
    journal = tmp_path / "journal.jsonl"
    header = journal.read_text().splitlines()[0] + "\n"
    action = lambda do, **fields: json.dumps({"do": do, **fields}) + "\n"
    options = lambda **fields: action("set_options", options=fields)
    undo, redo, name = action("undo"), action("redo"), action("add_structure", name="a")
    one, two = {"voxel_size": 2.0, "rho": 0.5}, {"mark_precision": 1.0, "model": "paper"}
    first, second = options(voxel_size=2, rho=0.5), options(**two)
    for actions, expected in ((name, {}), (first, one), (first + second, two), (first + second + undo, one),
                              (first + undo + redo, one), (first + second + undo + undo + undo, {}),
                              (first + name + undo + undo + redo, one), (first + second + undo + name + redo, one),
                              (first + options(), {}), (first + second[:-1], one)):
        journal.write_text(header + actions)
        for found in covol.read_study_options(tmp_path), wheel.read_options(tmp_path):
            assert found == expected and {type(value) for value in found.values()} <= {float, str}, actions
    for content, code in ((None, "io"), ("", "invalid_input"), ("{}\n", "invalid_input"),
                          (header.replace('"covol_study":1', '"covol_study":2'), "unsupported"),
                          (header + "nothing\n", "invalid_input"), (header + options(rho="x"), "invalid_input"),
                          (header + options(model="x"), "invalid_input"), (header + "{}\n", "invalid_input")):
        journal.unlink(missing_ok=True)
        if content is not None:
            journal.write_text(content)
        for read in covol.read_study_options, wheel.read_options:
            with pytest.raises(covol.Error, match="journal.jsonl") as error:
                read(tmp_path)
            assert error.value.code == code, content


def test_paint_and_guesses_give_the_same_as_the_page(sphere, program, tmp_path):
    image, _, labels = sphere
    covol.save_mask(tmp_path / "given.nrrd", labels, image)
    with covol.mark(image, study=tmp_path / "study", program=program, notebook=[]) as study:
        page = Page(study.url)
        live = Live(page)
        painted = live.add_structure("painted")
        status, text = page.post(f"/import?key=g&as=labels&name=given.nrrd", (tmp_path / "given.nrrd").read_bytes())
        assert status == 200, text
        middle = np.array(image.index_to_world([[20, 20, 20]])[0])
        for k in (14, 17, 20, 23, 26):
            height = (k - 20) * image.spacing[2]
            live.act(do="add_stroke", structure=painted, erases=False, radius=float(np.sqrt(0.64 - height ** 2)), axis=2, at=k,
                     world=[(middle + [0, 0, height]).tolist()])
        volumes = {s: live.wait_for(s, "refined", 1 if s != painted else 7)["volume"] for s in (painted, json.loads(text)["id"])}
        assert set(study.marks["painted"]) == {"painted"} and set(study.marks["label1"]) == {"guess"}
        alone = {name: covol.structures(image, {name: marks})[name].report["surface"]["volume"] for name, marks in study.marks.items()}
        assert alone["painted"] == pytest.approx(volumes[painted], rel=1e-3)
        assert alone["label1"] == pytest.approx(volumes[json.loads(text)["id"]], rel=1e-3)
        live.close()
    assert (tmp_path / "study" / "journal.jsonl").exists()


def test_the_cell_holds_a_frame_that_the_notebook_alone_may_show(study):
    cell = study._repr_html_()
    frame, page = re.search(r'src="([^"]+)"', cell).group(1), re.search(r'href="([^"]+)"', cell).group(1)
    assert frame.startswith("http://localhost:") and page.startswith("http://127.0.0.1:")
    assert "<script" not in cell
    known = Page(study.url)
    policy = known.get("/")[1]["Content-Security-Policy"]
    assert policy.endswith("frame-ancestors http://localhost:8888"), policy
    path = frame[frame.index("/?"):]
    headers = {"Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "iframe"}
    status, answer, _ = known.get(path, cookie=False, Sec_Fetch_Site="same-site", **headers)
    assert status == 200 and "SameSite=Strict" in answer["Set-Cookie"] and "frame-ancestors http://localhost:8888" in answer["Content-Security-Policy"]
    assert known.get(path, cookie=False, Sec_Fetch_Site="cross-site", **headers)[0] == 403
    assert known.get("/image", Sec_Fetch_Site="same-site", **headers)[0] == 403


def test_it_ends_with_its_files(sphere, program):
    image, points, _ = sphere
    study = covol.mark(image.array, points, spacing=image.spacing, origin=image.origin, program=program)
    folder, url = study.folder, study.url
    assert study.is_open and os.path.isdir(folder)
    study.close()
    study.close()
    assert not study.is_open and not os.path.exists(folder)
    with pytest.raises(OSError):
        urllib.request.urlopen(url, timeout=5)
    assert "closed" in study._repr_html_() and "closed" in repr(study)


def test_what_cannot_be_shown(sphere, program, tmp_path):
    image, points, _ = sphere
    with pytest.raises(covol.Error) as error:
        covol.mark(image, [[1, 2]], program=program)
    assert error.value.field == "marks"
    with pytest.raises(covol.Error, match="outside"):
        covol.mark(image, points + 1000, program=program)
    with pytest.raises(covol.Error, match="frame_origins"):
        covol.mark(image, program=program, notebook="https://evil.example/*")
    with pytest.raises(OSError):
        covol.mark(image, program=tmp_path / "none")


def test_an_array_comes_back_as_it_was(tmp_path):
    from covol._files import write_nrrd
    turn = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    for kind in (np.uint8, np.int16, np.float32, np.float64):
        array = (np.arange(60).reshape(3, 4, 5) - (0 if kind == np.uint8 else 7)).astype(kind)
        image = covol.Image(array, spacing=(0.5, 0.25, 2), origin=(1, 2, 3), direction=turn, unit="um")
        write_nrrd(tmp_path / "a.nrrd", image)
        back = covol.read_image(tmp_path / "a.nrrd")
        assert np.array_equal(back.array, array)
        np.testing.assert_allclose(back.spacing, image.spacing)
        np.testing.assert_allclose(back.direction, turn, atol=1e-12)
        assert back.unit == "um"
