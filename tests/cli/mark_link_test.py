"""What the page of `covol mark` keeps after a lost connection, after a reload, and with a second page; and the page on a phone.

    COVOL=build/bin/covol python3 -m unittest tests/cli/mark_link_test.py
"""
import time

from mark_page_case import BALL, By, Keys, PageCase

EVIL = "<img src=x onerror=alert(1)><script>alert(2)</script>\"&amp;'"


class Link(PageCase):
    def test_a_program_that_was_killed_takes_what_was_kept(self):
        self.open()
        self.may_fail = True  # the browser logs as an error that the server does not respond
        self.mark_ball(2)
        self.server.kill()
        self.wait("return mark.state.get('link') === 'lost'")
        self.click(2, [30, 40, 30])
        self.keys("N")
        self.click(2, [60, 60, 30])
        self.click(2, [64, 60, 30])
        self.assertEqual([len(s["marks"]) for s in self.structures()], [3, 2])
        self.assertIn("4 actions are kept and will be sent", self.driver.find_element(By.CSS_SELECTOR, ".link").text)
        self.server.start()
        self.wait("return mark.state.get('link') === 'refused'")
        self.assertIn("open the address that it printed", self.driver.find_element(By.CSS_SELECTOR, ".link").text)
        self.driver.get(self.server.url)
        self.ready()
        self.settled()
        self.assertEqual([len(s["marks"]) for s in self.structures()], [3, 2])
        journal = self.server.journal()
        self.assertEqual([a["do"] for a in journal],
                         ["add_structure", "add_mark", "add_mark", "add_mark", "add_structure", "add_mark", "add_mark"])
        self.assertEqual(len({a["key"] for a in journal}), len(journal))
        self.assertEqual(self.js("return Object.keys(localStorage).filter((name) => name.startsWith('covol-mark/actions/')).length"), 0)

    def test_an_action_that_is_sent_twice_counts_once(self):
        self.open()
        self.mark_ball(2)
        self.js("mark.connection.socket.send(JSON.stringify({key: 'x-1', do: 'add_mark', structure: mark.study.structures[0].id, kind: 'surface', world: [0, 20, 30]}))")
        self.wait("return mark.study.structures[0].marks.length === 3")
        # If the response is lost, the action stays in localStorage, and the next page sends it again. The test puts it
        # there.
        self.js("localStorage.setItem('covol-mark/actions/ball.nrrd/x-1', JSON.stringify({time: 1, action: {key: 'x-1', do: 'add_mark', structure: mark.study.structures[0].id, kind: 'surface', world: [0, 20, 30]}}))")
        self.driver.refresh()
        self.ready()
        self.settled()
        self.assertEqual(len(self.marks()), 3)

    def test_what_is_refused_is_taken_back(self):
        self.open()
        self.mark_ball(1)
        structure = self.structures()[0]["id"]
        self.js("mark.study.act({do: 'move_mark', structure: arguments[0], mark: 999, world: [0, 20, 30]})", structure)
        self.js("mark.study.act({do: 'rename', structure: 77, name: 'x'})")
        self.settled()
        self.assertEqual([t.text for t in self.driver.find_elements(By.CSS_SELECTOR, ".toast.failed")], ["'structure 1' has no mark 999", "there is no structure 77"])
        self.assertEqual(len(self.marks()), 1)

    def test_a_reload_keeps_the_view(self):
        self.open()
        self.mark_ball(8)
        self.surface()
        self.keys("N", "t")
        self.settled()
        self.slices(12, 23, 34)
        self.js("mark.panels[1].zoomAt(3, 100, 90); mark.state.set({window: {black: 100, white: 700}})")
        canvas = self.driver.find_element(By.CSS_SELECTOR, ".three canvas")
        self.actions().move_to_element(canvas).click_and_hold().move_by_offset(60, 20).release().perform()
        self.keys("o")
        kept = "return JSON.stringify([mark.state.get('slices'), mark.state.get('views'), mark.state.get('window'), mark.state.get('tool'), mark.state.get('active'), mark.state.get('theme'), mark.view.camera.position.toArray().map((v) => v.toFixed(3))])"
        self.slices(12, 23, 34)
        before = self.js(kept)
        time.sleep(0.5)
        self.driver.refresh()
        self.ready()
        self.wait("return mark.meshes.items.size === 1")
        self.assertEqual(self.js(kept), before)

    def test_marks_do_not_flicker_while_they_are_saved(self):
        self.open()
        self.slices(*BALL)
        self.js("window.counts = []; mark.study.on('change', () => counts.push(mark.study.structures.reduce((sum, s) => sum + s.marks.length, 0)))")
        for n in range(5):
            self.click(2, [20 + 8 * n, 20, 30])
        self.settled()
        counts = self.js("return counts")
        self.assertEqual(counts, sorted(counts))
        self.assertEqual(counts[-1], 5)

    def test_names_with_markup_stay_text(self):
        name = EVIL.replace("/", "")  # file names cannot contain a slash
        self.open(name=name)
        self.assertEqual(self.driver.find_element(By.CSS_SELECTOR, "h1").text, name + ".nrrd")
        self.mark_ball(1)
        self.keys(Keys.F2)
        field = self.driver.switch_to.active_element
        field.send_keys(EVIL + Keys.ENTER)
        self.settled()
        self.assertEqual(self.structures()[0]["name"], EVIL)
        self.assertEqual(self.driver.find_element(By.CSS_SELECTOR, ".structure .name").text, EVIL)
        self.mark_ball(8)
        self.surface()
        self.driver.find_element(By.CSS_SELECTOR, "[aria-label=export]").click()
        self.assertIn(EVIL, self.driver.find_element(By.CSS_SELECTOR, ".menu h3 span:last-child").text)
        self.assertEqual(self.js("return document.querySelectorAll('#page img, #page script').length"), 0)
        links = [link.get_attribute("href").split("/export")[1] for link in self.driver.find_elements(By.CSS_SELECTOR, ".menu a")]
        self.assertIn("?structure=0&format=mask.nii.gz", [link for link in links if "structure=0" in link])
        self.assertIn("?structure=1&format=surface.vdb", links)

    def test_a_file_that_only_its_user_can_read_leads_to_the_page(self):
        """How covol mark opens the browser: the address is a secret, and must not be on a command line."""
        self.open()
        link = self.server.folder / "open.html"
        link.write_text(f'<!doctype html><meta http-equiv="refresh" content="0;url={self.server.url}">')
        self.driver.delete_all_cookies()
        self.driver.get(link.as_uri())
        self.wait("return Boolean(mark)")
        self.ready()
        self.assertNotIn("token", self.driver.current_url)

    def test_two_pages_show_the_same(self):
        self.open()
        self.mark_ball(2)
        first = self.driver.current_window_handle
        self.driver.switch_to.new_window("tab")
        self.driver.get(self.server.url)
        self.ready()
        self.assertEqual(len(self.marks()), 2)
        self.slices(*BALL)
        self.click(2, [40, 40, 30])
        self.settled()
        self.driver.close()
        self.driver.switch_to.window(first)
        self.wait("return mark.study.structures[0].marks.length === 3")

    def test_a_phone_and_fingers(self):
        self.open()
        self.slices(*BALL)
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 400, "height": 800, "deviceScaleFactor": 2, "mobile": True})
        self.driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
        self.addCleanup(self.driver.execute_cdp_cmd, "Emulation.clearDeviceMetricsOverride", {})
        self.addCleanup(self.driver.execute_cdp_cmd, "Emulation.setTouchEmulationEnabled", {"enabled": False})
        self.wait("return innerWidth <= 400")
        self.assertLessEqual(self.js("return document.documentElement.scrollWidth"), 400)
        touch = lambda kind, *spots: self.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y, "id": n} for n, (x, y) in enumerate(spots)]})
        x, y = self.spot(2, [30, 40, 30])
        touch("touchStart", (x, y))
        touch("touchEnd")
        self.settled()
        self.near(self.marks()[0]["index"], [30, 40, 30], 2)
        touch("touchStart", (x, y))
        touch("touchStart", (x, y), (x + 40, y))
        for n in range(1, 9):
            touch("touchMove", (x - 5 * n, y), (x + 40 + 5 * n, y))
        touch("touchEnd")
        self.assertAlmostEqual(self.js("return mark.state.get('views')[2].zoom"), 3, delta=0.3)
        self.assertEqual(len(self.marks()), 1)
