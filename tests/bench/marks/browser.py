"""The page of `covol mark` in headless Chromium, for measurements: real mouse and wheel events, and the page's own clock."""
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cli"))
from mark_page_case import CHROMIUM, DRIVER, ActionChains, WebDriverWait, start_chromium, webdriver  # noqa: E402


class Program:
    """`covol mark`, with a study in a temporary folder unless one is given."""

    def __init__(self, covol, image, options=(), study=None):
        self.folder = tempfile.TemporaryDirectory()
        self.began = time.perf_counter()
        self.process = subprocess.Popen([covol, "mark", str(image), study or self.folder.name + "/study", "--no-browser", *map(str, options)],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.url = self.process.stdout.readline().split()[1]

    def peak(self):
        """Peak of resident memory, MB."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0]) / 1024

    def close(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self.folder.cleanup()


class Browser:
    def __init__(self):
        if not (webdriver and CHROMIUM and DRIVER):
            raise SystemExit("skipped: chromium, chromium-driver or python3-selenium is not installed")
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self.driver = start_chromium(self.profile.name)

    def open(self, url):
        self.driver.get(url)
        self.wait("return Boolean(window.covolMark) && mark.state.get('link') === 'open' && mark.panels.every((p) => p.slice)")

    def js(self, script, *arguments):
        return self.driver.execute_script("const mark = window.covolMark;" + script, *arguments)

    def wait(self, script, *arguments, seconds=60):
        return WebDriverWait(self.driver, seconds, 0.02).until(lambda _: self.js(script, *arguments))

    def actions(self):
        return ActionChains(self.driver, duration=0)

    def go(self, index):
        """Shows the slices through a voxel."""
        self.js("mark.state.set({slices: mark.space.voxelAt(arguments[0])})", index)
        self.wait("return mark.panels.every((p) => p.shownAt === p.at)")

    def click(self, axis, index):
        spot = self.js("const p = mark.panels[arguments[0]]; p.draw(); return p.pixelOf(mark.space.toWorld(arguments[1]))", axis, index)
        chain = self.actions()
        chain.w3c_actions.pointer_action.move_to_location(*map(round, spot))
        chain.click().perform()

    def print_memory(self, program):
        own, whole = self.memory()
        print(f"memory: the program {program.peak():.0f} MB at most, the page's process {own:.0f} MB, the browser with all its processes {whole:.0f} MB")

    def memory(self):
        """Resident memory of the page's own process, and of all processes of the browser, MB."""
        own, whole, pid = 0, 0, self.driver.service.process.pid
        children = {}
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
                # Pss: memory that several processes share is divided among them, so that it is counted once.
                used = sum(int(line.split()[1]) for line in (entry / "smaps_rollup").read_text().splitlines() if line.startswith("Pss:")) / 1024
            except (OSError, ValueError):
                continue
            children.setdefault(parent, []).append((int(entry.name), command, used))
        waiting = [pid]
        while waiting:
            for child, command, used in children.get(waiting.pop(), []):
                whole += used
                if "--type=renderer" in command:
                    own = max(own, used)
                waiting.append(child)
        return own, whole

    def close(self):
        self.driver.quit()
        self.profile.cleanup()
