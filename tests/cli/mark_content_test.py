"""Contents of a study of `covol mark` other than clicks: guesses, labels, marks of files, paint, options, statistics.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_content_test.py
"""
import json
import math
import signal
import zlib

from covol_case import CENTER, H, RADIUS, SIZE, ball_bytes, radius_of, write_nrrd
from mark_test import MARKS, MarkCase

MIDDLE = (SIZE - 1) / 2


def mask_bytes(of):
    """Labels by a function `of` the distance from the middle, in voxels, and of i."""
    return bytes(of(math.dist((i, j, k), (MIDDLE,) * 3), i) for k in range(SIZE) for j in range(SIZE) for i in range(SIZE))


def world(i, j, k):
    return [c + H * (v - MIDDLE) for c, v in zip(CENTER, (i, j, k))]


class ContentCase(MarkCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.small = cls.inputs / "small.nrrd"
        write_nrrd(cls.small, (SIZE,) * 3, mask_bytes(lambda r, i: int(r < 9)))
        cls.halves = cls.inputs / "halves.nrrd"
        write_nrrd(cls.halves, (SIZE,) * 3, mask_bytes(lambda r, i: 0 if r > 11 or abs(i - MIDDLE) < 2 else 3 if i < MIDDLE else 8))
        cls.marks = cls.inputs / "marks.csv"
        cls.marks.write_text("x,y,z\n" + "".join("%r,%r,%r\n" % mark for mark in MARKS))

    def end(self, program):
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(timeout=30), 0)

    def voxels(self, name):
        data = (self.out / name).read_bytes() if isinstance(name, str) else name
        return zlib.decompress(data.split(b"\n\n", 1)[1], 47)

    def same_without_a_page(self, page, program, *options):
        """The page exports the same files as the program makes from the study."""
        exported = page.get("/export?structure=0&format=mask.nrrd")[2]
        self.end(program)
        self.run_covol("segment", "--study", "ball.nrrd.covol", "-o", "s.vdb", "--mask", "s.nrrd", *options)
        self.assertEqual(self.voxels("s.nrrd"), self.voxels(exported))


class Content(ContentCase):
    def test_a_guess_is_corrected_as_segment_does_and_undone(self):
        program, page = self.start("--guess", f"ball={self.small}")
        live = self.open(page)
        structure = live.state["structures"][0]
        self.assertEqual((structure["name"], structure["guess"]), ("ball", {"name": "small.nrrd", "label": 0}))
        alone = live.wait_for(structure["id"], "refined", 2)
        self.assertAlmostEqual(radius_of(alone["volume"]), 9 * H, delta=0.1)
        for mark in MARKS[:6]:
            live.add_mark(structure["id"], mark)
        corrected = live.wait_for(structure["id"], "refined", 8)
        self.assertGreater(corrected["volume"], alone["volume"])
        self.run_covol("segment", self.stack, "--guess", self.small, "--points", self.csv(MARKS[:6]), "-o", "g.vdb", "--json", "g.json")
        plain = json.loads((self.out / "g.json").read_text())
        self.assertAlmostEqual(corrected["volume"], plain["surface"]["volume"], delta=1e-3 * corrected["volume"])
        patches, _ = live.act(do="remove_guess", structure=structure["id"])
        self.assertIsNone(patches[0]["structures"][0]["guess"])
        patches, _ = live.act(do="undo")
        self.assertEqual(patches[0]["structures"][0]["guess"]["name"], "small.nrrd")
        live.wait_for(structure["id"], "refined", 10)
        self.same_without_a_page(page, program)
        # The journal names the mask relative to the study's folder, with a digest. If the file has another digest, it
        # is an error.
        line = json.loads(self.journal()[2])
        self.assertEqual((self.out / "ball.nrrd.covol" / line["path"]).resolve(), self.small.resolve())
        broken = [text if n != 2 else json.dumps({**line, "digest": "xxh128:0"}) for n, text in enumerate(self.journal())]
        (self.out / "ball.nrrd.covol" / "journal.jsonl").write_text("\n".join(broken) + "\n")
        self.assertIn("has changed since", self.run_covol("segment", "--study", "ball.nrrd.covol", "-o", "s.vdb", code=3).stderr)

    def csv(self, marks):
        path = self.out / "some.csv"
        path.write_text("x,y,z\n" + "".join("%r,%r,%r\n" % mark for mark in marks))
        return path

    def test_labels_become_structures_that_keep_their_values(self):
        program, page = self.start("--labels", self.halves)
        live = self.open(page)
        self.assertEqual([s["name"] for s in live.state["structures"]], ["label3", "label8"])
        for structure in live.state["structures"]:
            result = live.wait_for(structure["id"], "refined", 1)
            self.assertGreater(result["volume"], 0.7 * 2 / 3 * math.pi * (11 * H) ** 3 - 4 * math.pi * (11 * H) ** 2 * H)
        self.same_without_a_page(page, program)
        self.assertEqual(set(self.voxels("s.nrrd")), {0, 3, 8})
        # The same command on the existing study does not add the structures again.
        program, page = self.start("--labels", self.halves)
        self.assertEqual(len(self.open(page).state["structures"]), 2)
        self.end(program)
        self.assertIn("its labels are structures", program.stderr.read())

    def test_marks_of_a_file_are_one_action(self):
        program, page = self.start("--points", f"ball={self.marks}")
        live = self.open(page)
        structure, = live.state["structures"]
        self.assertEqual(len(structure["marks"]), len(MARKS))
        for mark, wanted in zip(structure["marks"], MARKS):
            self.assertLess(math.dist(mark["world"], wanted), 1e-9)
        live.wait_for(structure["id"], "refined", 2)
        patches, _ = live.act(do="undo")
        self.assertEqual(patches[0]["structures"][0]["marks"], [])
        live.act(do="redo")
        self.end(program)
        program, page = self.start("--points", self.marks)
        self.assertEqual(len(self.open(page).state["structures"][0]["marks"]), len(MARKS))
        self.end(program)
        self.assertIn("not added again", program.stderr.read())
        live_names = self.run_covol("mark", self.stack, "--no-browser", "--points", f"ball={self.inputs / 'none.csv'}", code=4)
        self.assertIn("none.csv", live_names.stderr)

    def test_paint_is_what_painted_labels_are(self):
        program, page = self.start()
        live = self.open(page)
        structure = live.add_structure("ball")
        radius = RADIUS
        # Strokes that cover the whole cross-section of the ball on five slices.
        for k in (12, 16, 20, 24, 28):
            cut = math.sqrt(max(0, radius ** 2 - (H * (k - MIDDLE)) ** 2))
            patches, done = live.act(do="add_stroke", structure=structure, erases=False, radius=cut, axis=2, at=k, world=[world(MIDDLE, MIDDLE, k)])
            self.assertIn("id", done)
        self.assertEqual(len(patches[0]["structures"][0]["strokes"]), 5)
        result = live.wait_for(structure, "refined", 6)
        self.assertAlmostEqual(radius_of(result["volume"]), RADIUS, delta=0.05 * RADIUS)
        # A label image with the same voxels painted gives the same volume.
        cuts = {k: math.sqrt(max(0, radius ** 2 - (H * (k - MIDDLE)) ** 2)) / H for k in (12, 16, 20, 24, 28)}
        labels = bytes(int(k in cuts and math.dist((i, j), (MIDDLE,) * 2) <= cuts[k]) for k in range(SIZE) for j in range(SIZE) for i in range(SIZE))
        write_nrrd(self.out / "painted.nrrd", (SIZE,) * 3, labels)
        self.run_covol("segment", self.stack, "--painted", "painted.nrrd", "-o", "p.vdb", "--json", "p.json")
        plain = json.loads((self.out / "p.json").read_text())
        self.assertAlmostEqual(result["volume"], plain["surface"]["volume"], delta=2e-3 * result["volume"])
        patches, _ = live.act(do="undo")
        self.assertEqual(len(patches[0]["structures"][0]["strokes"]), 4)
        live.act(do="redo")
        live.wait_for(structure, "refined", 8)
        _, answer = live.act(do="add_stroke", structure=structure, erases=False, radius=1e9, world=[world(5, 5, 5)] * 90_000)
        self.assertIn("too many voxels", answer["why"])
        self.same_without_a_page(page, program)

    def test_options_of_a_study(self):
        program, page = self.start()
        live = self.open(page)
        structure = self.marked(live)
        fine = live.wait_for(structure, "refined", len(MARKS) + 1)
        patches, _ = live.act(do="set_options", options={"voxel_size": 2 * H})
        self.assertEqual(patches[0]["options"], {"voxel_size": 2 * H})
        coarse = live.wait_for(structure, "refined", len(MARKS) + 2)
        self.assertLess(coarse["triangles"], 0.5 * fine["triangles"])
        self.assertEqual(self.open(page).state["options"], {"voxel_size": 2 * H})
        _, answer = live.act(do="set_options", options={"rho": 7})
        self.assertIn("'rho'", answer["why"])
        self.same_without_a_page(page, program, "--json", "s.json")
        self.assertEqual(json.loads((self.out / "s.json").read_text())["structures"][0]["resolved"]["voxel_size"], 2 * H)
        self.run_covol("segment", "--study", "ball.nrrd.covol", "-o", "s.vdb", "--voxel-size", H, "--json", "f.json")
        self.assertEqual(json.loads((self.out / "f.json").read_text())["structures"][0]["resolved"]["voxel_size"], H)

    def test_mean_and_deviation_inside(self):
        program, page = self.start()
        live = self.open(page)
        structure = self.marked(live)
        result = live.wait_for(structure, "refined", len(MARKS) + 1)
        self.assertGreater(result["mean"], 190)
        self.assertLess(result["mean"], 220)
        self.assertGreater(result["sd"], 1)
        table = page.get("/export?structure=0&format=table.csv")[2].decode().splitlines()
        row = dict(zip(table[0].split(","), table[1].split(",")))
        self.assertAlmostEqual(float(row["intensity_mean"]), result["mean"], places=2)
        self.end(program)
        self.run_covol("segment", "--study", "ball.nrrd.covol", "-o", "s.vdb", "--json", "s.json")
        inside = json.loads((self.out / "s.json").read_text())["structures"][0]["intensity"]
        self.assertAlmostEqual(inside["mean"], result["mean"], places=6)
        self.assertAlmostEqual(inside["standard_deviation"], result["sd"], places=6)
        data = [v for v, m in zip(ball_bytes(), mask_bytes(lambda r, i: int(r < RADIUS / H))) if m]
        self.assertAlmostEqual(inside["mean"], sum(data) / len(data), delta=3)


class Files(ContentCase):
    """Files that are uploaded by the page."""

    def send(self, page, name, body, **query):
        return page.post("/import?" + "&".join(f"{key}={value}" for key, value in ({"key": f"k{name}{len(body)}", "as": "guess", "name": name} | query).items()), body)

    def test_marks_masks_and_labels(self):
        program, page = self.start()
        live = self.open(page)
        structure = live.add_structure("ball")
        status, text = self.send(page, "marks.csv", self.marks.read_bytes(), **{"as": "points", "structure": structure})
        self.assertEqual(status, 200, text)
        patch = live.receive()["patch"]
        self.assertEqual(len(patch["structures"][0]["marks"]), len(MARKS))
        # The page sends the same file again, as it does if it has not received the response: the marks are added only
        # once.
        self.assertEqual(self.send(page, "marks.csv", self.marks.read_bytes(), **{"as": "points", "structure": structure})[0], 200)
        self.assertEqual(len(self.open(page).state["structures"][0]["marks"]), len(MARKS))
        status, text = self.send(page, "../../small.nrrd", self.small.read_bytes(), structure=structure)
        self.assertEqual(status, 200, text)
        status, text = self.send(page, "halves.nrrd", self.halves.read_bytes(), **{"as": "labels"})
        self.assertEqual(status, 200, text)
        state = self.open(page).state
        self.assertEqual([s["name"] for s in state["structures"]], ["ball", "label3", "label8"])
        kept = sorted(path.name for path in (self.out / "ball.nrrd.covol" / "files").iterdir())
        self.assertEqual(len(kept), 2)
        self.assertRegex(kept[0], r"^[0-9a-f]{32}\.nrrd$")
        self.assertEqual({path for path in self.out.iterdir()}, {self.stack, self.out / "ball.nrrd.covol"})
        for each in state["structures"]:
            live.wait_for(each["id"], "refined", state["seq"] - 2 if each["id"] == structure else 1)
        self.same_without_a_page(page, program)

    def test_kinds_and_lines_of_marks(self):
        program, page = self.start()
        live = self.open(page)
        structure = live.add_structure("ball")
        for mark in MARKS:
            live.add_mark(structure, mark)
        live.add_mark(structure, CENTER, "inside")
        live.add_mark(structure, world(2, 2, 2), "outside")
        exported = page.get(f"/export?structure={structure}&format=marks.csv")[2]
        # segment reads the exported table with the same kinds of marks as the page: volumes are equal.
        result = live.wait_for(structure, "refined", len(MARKS) + 3)
        (self.out / "exported.csv").write_bytes(exported)
        self.run_covol("segment", self.stack, "--points", "exported.csv", "-o", "e.vdb", "--json", "e.json")
        report = json.loads((self.out / "e.json").read_text())
        self.assertAlmostEqual(report["surface"]["volume"], result["volume"], delta=1e-3 * result["volume"])
        self.assertEqual(report["input"]["points"]["count"], len(MARKS))
        other = live.add_structure("other")
        self.assertEqual(self.send(page, "marks.csv", exported, **{"as": "points", "structure": other})[0], 200)
        patch = live.receive()
        while "patch" not in patch or len(patch["patch"]["structures"][0]["marks"]) == 0:
            patch = live.receive()
        marks = patch["patch"]["structures"][0]["marks"]
        plain = [(m["kind"], m["world"]) for m in next(s for s in self.open(page).state["structures"] if s["id"] == structure)["marks"]]
        self.assertEqual(sorted(m["kind"] for m in marks), sorted(kind for kind, _ in plain))
        for mark in marks:  # the table has six digits
            self.assertLess(min(math.dist(mark["world"], place) for kind, place in plain if kind == mark["kind"]), 1e-4)
        # Shapes of napari: a polygon within a slice becomes an outline; the corners of a path across slices become
        # marks.
        ring = [(17, MIDDLE + 8 * math.sin(n * math.pi / 6), MIDDLE + 8 * math.cos(n * math.pi / 6)) for n in range(12)]
        slanted = [(10 + n, 18 + n, 16 + 2 * n) for n in range(4)]
        rows = [f"{shape},{kind},{n},{z},{y},{x}" for shape, (kind, line) in enumerate((("polygon", ring), ("path", slanted))) for n, (z, y, x) in enumerate(line)]
        shapes = "index,shape-type,vertex-index,axis-0,axis-1,axis-2\n" + "\n".join(rows) + "\n"
        third = live.add_structure("third")
        self.assertEqual(self.send(page, "shapes.csv", shapes.encode(), **{"as": "points", "structure": third})[0], 200)
        state = next(s for s in self.open(page).state["structures"] if s["id"] == third)
        outline, = state["outlines"]
        self.assertEqual((outline["axis"], outline["at"], outline["closed"], len(outline["world"])), (2, 17, True, 12))
        self.assertEqual(len(state["marks"]), 4)
        live.act(do="undo")
        state = next(s for s in self.open(page).state["structures"] if s["id"] == third)
        self.assertEqual((state["marks"], state["outlines"]), ([], []))

    def test_what_is_refused_leaves_nothing(self):
        secret = self.out / "secret.raw"
        secret.write_bytes(bytes(SIZE ** 3))
        _, page = self.start()
        structure = self.open(page).add_structure("ball")
        head = self.small.read_bytes().split(b"\n\n", 1)[0]
        for name, body, query, why in (
                ("x.exe", b"MZ", {}, "whose name ends in one of"), ("x", b"MZ", {}, "whose name ends in one of"),
                ("x.csv", self.marks.read_bytes(), {}, "whose name ends in one of"),
                ("x.h5", b"\x89HDF", {}, "whose name ends in one of"),
                ("x.nrrd", b"nonsense", {}, "x"), ("x.csv", b"no,marks\n", {"as": "points"}, ""),
                ("x.csv", b"x,y,z\n1e9,0,0\n", {"as": "points"}, "outside"),
                ("x.csv", b"x,y,z\n" * 800_000, {"as": "points"}, "at most 4 MiB"),
                ("x.nrrd", head + b"\ndata file: " + str(secret).encode() + b"\n\n", {}, "refers to others"),
                ("x.nrrd", self.small.read_bytes(), {"as": "secret"}, "expected points, guess or labels"),
                ("x.nrrd", self.small.read_bytes(), {"structure": 99}, "no structure 99")):
            status, text = self.send(page, name, body, **({"structure": structure} | query))
            self.assertEqual(status, 400, (name, text))
            self.assertIn(why if why != "x" else "", text)
            self.assertNotIn("\x1b", text)
        files = self.out / "ball.nrrd.covol" / "files"
        self.assertEqual(list(files.iterdir()) if files.exists() else [], [])
        # Actions that a page sends must not name files, which the program would read.
        live = self.open(page)
        for action in ({"do": "set_guess", "structure": structure, "path": "/etc/passwd", "digest": "xxh128:0", "label": 0},
                       {"do": "add_labels", "path": "/etc/passwd", "digest": "xxh128:0", "labels": [{"label": 1, "name": "a"}]}):
            _, answer = live.act(**action)
            self.assertIn("cannot name files", answer["why"])
        self.assertEqual(len(self.journal()), 2)
        for key in ("k" * 101, "a%0Ab", "%C3%A4"):
            status, text = page.post(f"/import?key={key}&as=points&name=a.csv&structure={structure}", self.marks.read_bytes())
            self.assertEqual(status, 400, key)
            self.assertIn("'key'", text)
        self.assertEqual(len(self.journal()), 2)
        # Uploads are refused without the right Origin and cookie, so that pages of other sites cannot upload.
        good = f"/import?key=k&as=guess&name=a.nrrd&structure={structure}"
        body = self.small.read_bytes()
        self.assertEqual(page.post(good, body, Origin=None)[0], 403)
        self.assertEqual(page.post(good, body, Origin="http://evil.example")[0], 403)
        self.assertEqual(page.post(good, body, Cookie="a=b")[0], 403)
        self.assertEqual(page.post(good, b"", **{"Content-Length": str((256 << 20) + 1)})[0], 413)
        self.assertEqual(page.post(good, b"", **{"Content-Length": None})[0], 411)
        self.assertEqual(page.post("/elsewhere?key=k", body)[0], 404)
