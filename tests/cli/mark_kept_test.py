"""Surfaces of a study of `covol mark` that is opened again: loaded if still valid, else recomputed.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_kept_test.py
"""
import json
import signal

from covol_case import SIZE
from mark_test import MARKS, MarkCase


class Kept(MarkCase):
    def end(self, program):
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(timeout=30), 0)

    def file(self):
        return self.out / "ball.nrrd.covol" / "surfaces" / "1.surface"

    def begin(self):
        """The refined result and its mesh, after the program has ended."""
        program, page = self.start()
        live = self.open(page)
        structure = self.marked(live)
        result = live.wait_for(structure, "refined", len(MARKS) + 1)
        mesh = page.get(f"/mesh?structure={structure}&version={result['version']}")[2]
        self.end(program)
        self.assertTrue(self.file().is_file())
        return result, mesh

    def again(self):
        """The results that a page gets at once, and those that it gets later."""
        program, page = self.start()
        live = self.open(page)
        structure, = live.state["structures"]
        at_once = structure["result"]
        mesh = page.get(f"/mesh?structure=1&version={at_once['version']}")[2] if at_once and at_once["version"] else None
        refined = live.wait_for(1, "refined", 1)
        after = page.get(f"/mesh?structure=1&version={refined['version']}")[2]
        self.end(program)
        return at_once, mesh, refined, after

    def test_it_is_there_at_once_and_found_anew(self):
        result, mesh = self.begin()
        at_once, kept, refined, after = self.again()
        for name in ("triangles", "volume", "area", "extent", "mean", "sd", "expected", "warnings"):
            self.assertEqual(at_once[name], result[name], name)
            self.assertEqual(refined[name], result[name], name)
        self.assertEqual(kept, mesh)
        self.assertEqual(after, mesh)
        self.assertEqual(refined["version"], at_once["version"])  # equal, so that pages need not request the mesh again
        self.assertEqual(at_once["stage"], "first")

    def test_other_marks_have_another_surface(self):
        self.begin()
        program, page = self.start()
        live = self.open(page)
        live.act(do="remove_mark", structure=1, mark=live.state["structures"][0]["marks"][0]["id"])
        program.kill()  # before or after the program saves the new surface, by chance; both are accepted
        program.wait()
        _, page = self.start()
        result = self.open(page).state["structures"][0]["result"]
        self.assertTrue(result is None or result["seq"] == len(MARKS) + 2 or result["stage"] == "working", result)

    def test_a_file_that_is_damaged_is_found_anew(self):
        result, mesh = self.begin()
        whole = self.file().read_bytes()
        head, body = whole.split(b"\n", 1)
        facts = json.loads(head)

        def with_head(**changes):
            return json.dumps(facts | changes).encode() + b"\n" + body

        damaged = [b"", b"{}", head, whole[:-1], whole + b"x", head + b"\n" + body[:-4] + b"\xff\xff\xff\xff", with_head(of="other"),
                   with_head(vertices=2 ** 63), with_head(vertices=-1), with_head(corners=0), with_head(origin=[1, 2]), with_head(figures={}),
                   with_head(figures=facts["figures"] | {"volume": "<b>"}), with_head(figures=facts["figures"] | {"warnings": [3]}),
                   with_head(figures=facts["figures"] | {"extent": [1, 2]}), b"\xff" * 100, head + b"\n" + b"\x00\x00\xc0\x7f" + body[4:]]
        for n, content in enumerate(damaged):
            with self.subTest(n):
                self.file().write_bytes(content)
                at_once, _, refined, after = self.again()
                self.assertTrue(at_once is None or at_once["stage"] in ("working", "first", "refined"))
                self.assertEqual(refined["volume"], result["volume"])
                self.assertEqual(after, mesh)

    def test_another_image_in_its_place_has_its_own_surface(self):
        result, _ = self.begin()
        data = bytearray(self.stack.read_bytes())
        data[-SIZE_OF_SLICES:] = bytes(SIZE_OF_SLICES)  # the upper slices become black, and cut the ball
        self.stack.write_bytes(bytes(data))
        at_once, _, refined, _ = self.again()
        self.assertNotEqual(refined["mean"], result["mean"])
        self.assertTrue(at_once is None or at_once["mean"] != result["mean"])


SIZE_OF_SLICES = SIZE * SIZE * (2 * SIZE // 5)
