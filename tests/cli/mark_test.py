"""`covol mark`: the program behind the page, by requests and messages.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_test.py
"""
import json
import math
import os
import random
import shutil
import signal
import socket
import struct
import subprocess
import time

from covol_case import CENTER, COVOL, H, RADIUS, SIZE, Case, ball_bytes, radius_of, sphere_points, write_nrrd
from live_client import Live, Page

MARKS = sphere_points(25)


class PageCase(Case):
    """A program that serves a page."""

    def serve(self, *words, **more):
        """The running program, and its page."""
        program = subprocess.Popen([COVOL, *map(str, words), "--no-browser"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True, cwd=self.out, **more)
        self.addCleanup(self.stop, program)
        line = program.stdout.readline()
        self.assertTrue(line.startswith("open http://127.0.0.1:"), line + (program.stderr.read() if not line else ""))
        return program, Page(line.split()[1])

    def stop(self, program):
        if program.poll() is None:
            program.kill()
        program.wait()
        program.stdout.close()
        program.stderr.close()


class MarkCase(PageCase):
    def setUp(self):
        super().setUp()
        self.stack = self.out / "ball.nrrd"
        shutil.copy(self.image, self.stack)

    def start(self, *options):
        """A running program and its page."""
        return self.serve("mark", self.stack, *options)

    def open(self, page, **options):
        """The page's WebSocket, closed at the end."""
        live = Live(page, **options)
        self.addCleanup(live.close)
        return live

    def marked(self, live, name="nucleus", marks=MARKS):
        structure = live.add_structure(name)
        for mark in marks:
            live.add_mark(structure, mark)
        return structure

    def journal(self):
        return (self.out / "ball.nrrd.covol" / "journal.jsonl").read_text().splitlines()


class Study(MarkCase):
    def test_from_clicks_to_files(self):
        _, page = self.start()
        live = self.open(page)
        self.assertEqual(live.state["structures"], [])
        structure = self.marked(live)
        result = live.wait_for(structure, "refined", len(MARKS) + 1)
        self.assertAlmostEqual(radius_of(result["volume"]), RADIUS, delta=0.1 * H)
        for extent in result["extent"]:
            self.assertAlmostEqual(extent, 2 * RADIUS, delta=0.5 * H)
        status, _, mesh = page.get(f"/mesh?structure={structure}&version={result['version']}")
        self.assertEqual(status, 200)
        vertices, triangles, *box = struct.unpack("<2I6f", mesh[:32])
        self.assertEqual(triangles, result["triangles"])
        for axis in range(3):
            self.assertAlmostEqual(box[3 + axis] - box[axis], result["extent"][axis], places=4)
        self.assertEqual(page.get(f"/mesh?structure={structure}&version={result['version'] + 1}")[0], 404)
        for format in ("mask.nii.gz", "mask.nrrd", "mask.tif", "mesh.ply", "mesh.stl", "surface.vdb", "marks.csv", "table.csv"):
            status, headers, body = page.get(f"/export?structure=0&format={format}")
            self.assertEqual(status, 200, (format, body))
            self.assertIn('filename="nucleus', headers["Content-Disposition"])
            self.assertGreater(len(body), 50)
        self.assertEqual(page.get("/export?structure=0&format=passwd")[0], 400)
        self.assertEqual(page.get("/export?structure=9&format=mask.nrrd")[0], 400)

    def test_the_program_gives_the_same_bits_without_a_page(self):
        program, page = self.start()
        live = self.open(page)
        one = self.marked(live, "one")
        other = self.marked(live, "a wider one", [tuple(c + 1.2 * (x - c) for x, c in zip(mark, CENTER)) for mark in MARKS])
        for structure in (one, other):
            live.wait_for(structure, "refined", len(MARKS))
        exported = page.get("/export?structure=0&format=mask.nrrd")[2]
        volumes = page.get("/export?structure=0&format=table.csv")[2]
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(timeout=30), 0)
        self.run_covol("segment", "--study", "ball.nrrd.covol", "-o", "s.vdb", "--mask", "s.nrrd", "--mesh", "s.ply",
                       "--table", "s.csv")
        voxels = (lambda data: data.split(b"\n\n", 1)[1])
        self.assertEqual(voxels((self.out / "s.nrrd").read_bytes()), voxels(exported))
        untimed = (lambda table: [row.rsplit(b",", 1)[0] for row in table.splitlines()])
        self.assertEqual(untimed((self.out / "s.csv").read_bytes()), untimed(volumes))
        self.assertIn("image of another size", self.run_covol("mark", self.other_image(), "ball.nrrd.covol", code=3).stderr)

    def other_image(self):
        path = self.out / "small.nrrd"
        write_nrrd(path, (8, 8, 8), bytes(512))
        return path

    def test_two_pages_see_each_others_changes(self):
        _, page = self.start()
        one, other = self.open(page), self.open(page)
        structure = one.add_structure("one")
        self.assertEqual(other.receive()["patch"]["structures"][0]["id"], structure)
        mark = other.add_mark(structure, MARKS[0])
        patch = one.receive()["patch"]
        self.assertEqual([m["id"] for m in patch["structures"][0]["marks"]], [mark])
        third = self.open(page)
        self.assertEqual(third.state["structures"][0]["marks"], patch["structures"][0]["marks"])

    def test_undo_redo_and_what_is_refused(self):
        _, page = self.start()
        live = self.open(page)
        structure = self.marked(live, marks=MARKS[:2])
        patches, _ = live.act(do="undo")
        self.assertEqual(len(patches[0]["structures"][0]["marks"]), 1)
        self.assertTrue(patches[0]["can_redo"])
        patches, _ = live.act(do="redo")
        self.assertEqual(len(patches[0]["structures"][0]["marks"]), 2)
        for bad, why in (({"do": "add_mark", "structure": structure, "kind": "surface", "world": [1e9, 0, 0]}, "outside of the image"),
                         ({"do": "add_mark", "structure": 77, "kind": "surface", "world": list(CENTER)}, "no structure 77"),
                         ({"do": "rename", "structure": structure, "name": ""}, "needs a name"),
                         ({"do": "sing"}, "expected the name of an action, got 'sing'")):
            patches, answer = live.act(**bad)
            self.assertEqual(patches, [])
            self.assertIn(why, answer["why"])
        live.send_text("nonsense")
        while "failed" not in (answer := live.receive()):
            self.assertIn("result", answer)  # results for the marks may arrive first
        self.assertIsNone(answer["failed"])
        live.act(do="lock", structure=structure, locked=True)
        _, answer = live.act(do="add_mark", structure=structure, kind="surface", world=list(MARKS[3]))
        self.assertIn("is locked", answer["why"])
        patches, _ = live.act(do="remove_structure", structure=structure)
        self.assertEqual(patches, [])
        self.assertEqual(len(self.journal()), 1 + 3 + 2 + 1)

    def test_too_few_marks_and_suggestions(self):
        _, page = self.start()
        live = self.open(page)
        structure = self.marked(live, marks=MARKS[:3])
        self.assertEqual(live.wait_for(structure, "empty", 4)["message"], "1 more mark is needed for a surface")
        for mark in MARKS[3:]:
            live.add_mark(structure, mark)
        live.wait_for(structure, "refined", len(MARKS) + 1)
        live.send_text(json.dumps({"key": "s", "ask": "suggest", "structure": structure}))
        suggested = live.receive()["suggestions"]
        self.assertEqual(suggested["structure"], structure)
        self.assertGreater(len(suggested["places"]), 0)
        for place in suggested["places"]:
            self.assertAlmostEqual(math.dist(place["world"], CENTER), RADIUS, delta=H)

    def test_slices(self):
        _, page = self.start()
        facts = page.json("/image")
        self.assertEqual((facts["size"], facts["low"], facts["high"]), ([SIZE] * 3, 20, 220))
        data = ball_bytes()
        for axis, at in ((0, 12), (1, 30), (2, 17)):
            status, headers, body = page.get(f"/slice?axis={axis}&at={at}&step=1")
            self.assertEqual((status, headers["X-Width"], headers["X-Height"]), (200, str(SIZE), str(SIZE)))
            right, down = [[1, 2], [0, 2], [0, 1]][axis]
            for x, y in ((3, 4), (20, 19), (14, 22)):
                index = [at] * 3
                index[right], index[down] = x, y
                value = data[index[0] + SIZE * (index[1] + SIZE * index[2])]
                code, = struct.unpack_from("<H", body, 2 * (y * SIZE + x))
                self.assertAlmostEqual(20 + code / 65535 * 200, value, delta=0.01)
        self.assertEqual(page.get("/slice?axis=2&at=17&step=3")[1]["X-Width"], str((SIZE + 2) // 3))
        for bad in ("axis=3&at=1&step=1", "axis=2&at=40&step=1", "axis=2&at=-1&step=1", "axis=2&at=1&step=0", "axis=2", "axis=x&at=1&step=1"):
            self.assertEqual(page.get("/slice?" + bad)[0], 400, bad)


class Safe(MarkCase):
    def test_allowed_requests(self):
        _, page = self.start()
        stranger = {"cookie": False}
        self.assertEqual(page.get("/", **stranger)[0], 403)
        self.assertEqual(page.get("/?token=" + "0" * len(page.token), **stranger)[0], 403)
        self.assertEqual(page.get("/image", **stranger)[0], 403)
        self.assertEqual(page.get("/image", Host="covol.example")[0], 403)
        self.assertEqual(page.get("/image", Origin="http://covol.example")[0], 403)
        self.assertEqual(page.get("/image", Sec_Fetch_Site="cross-site")[0], 403)
        self.assertEqual(self.open(page, origin="http://127.0.0.1.covol.example").status, 403)
        self.assertEqual(self.open(page, cookie="covol=1").status, 403)
        self.assertEqual(page.get("/../../etc/passwd")[0], 404)
        status, headers, body = page.get("/")
        self.assertEqual(status, 200)
        policy = headers["Content-Security-Policy"]
        self.assertTrue(policy.startswith("default-src 'none'"), policy)
        self.assertNotIn("unsafe", policy)
        self.assertNotIn(b"{{", body)
        # The server accepts connections only at 127.0.0.1, not at the machine's other addresses.
        for address in {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)} - {"127.0.0.1"}:
            if address.startswith("127."):
                continue
            with self.assertRaises(OSError):
                socket.create_connection((address, page.address[1]), timeout=5).close()

    def test_one_program_at_a_time(self):
        _, page = self.start()
        self.assertIn("another program has this study open",
                      self.run_covol("mark", self.stack, "--no-browser", code=4).stderr)
        self.assertEqual(page.json("/image")["size"], [SIZE] * 3)

    def test_wherever_it_is_killed_what_was_confirmed_is_there(self):
        rng = random.Random(5)
        confirmed = 0
        for _ in range(int(os.environ.get("COVOL_KILLS", "8"))):
            program, page = self.start()
            live = self.open(page)
            self.assertGreaterEqual(live.state["seq"], confirmed)
            structures = [s["id"] for s in live.state["structures"]] or [live.add_structure("one")]
            end = time.monotonic() + rng.uniform(0.05, 0.6)
            while time.monotonic() < end:
                live.add_mark(structures[0], MARKS[rng.randrange(len(MARKS))])
            confirmed = live.act(do="undo")[1]["seq"]
            live.send_text(json.dumps({"key": "last", "do": "add_mark", "structure": structures[0], "kind": "inside", "world": list(CENTER)}))
            program.send_signal(signal.SIGKILL)
            program.wait()
        _, page = self.start()
        self.assertGreaterEqual(self.open(page).state["seq"], confirmed)
