"""The Debian packages that cpack makes: their contents, their dependencies, and that they run when unpacked into a folder.

    COVOL=build/bin/covol COVOL_BUILD=build python3 -m unittest tests/cli/packages_test.py

tests/packages_in_clean_root.sh installs them into a new Debian, which takes minutes.
"""
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = pathlib.Path(os.environ.get("COVOL_BUILD", "build")).resolve()
NAMES = ["covol", "libcovol-dev", "python3-covol"]


def completed(*words, **more):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, **more)
    if done.returncode != 0:
        raise AssertionError(f"{words} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done


def run(*words, **more):
    done = completed(*words, **more)
    return done.stdout + done.stderr


@unittest.skipUnless(shutil.which("dpkg-deb") and shutil.which("dpkg-shlibdeps"), "needs dpkg-dev")
class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.work = pathlib.Path(tempfile.mkdtemp(prefix="covol-packages-"))
        cls.addClassCleanup(shutil.rmtree, cls.work)
        # A build of the program alone has no such folder; cpack must create it.
        shutil.rmtree(BUILD / "made", ignore_errors=True)
        run("cpack", "-G", "DEB", "--config", BUILD / "CPackConfig.cmake", "-B", cls.work, cwd=BUILD)
        cls.debs = {path.name.split("_")[0]: path for path in cls.work.glob("*.deb")}
        assert sorted(cls.debs) == NAMES, cls.debs
        cls.root = cls.work / "root"
        for path in cls.debs.values():
            run("dpkg", "-x", path, cls.root)
        [library] = (cls.root / "usr/lib").rglob("libcovol.so.*.*.*")
        cls.lib = library.parent
        cls.modules = sorted(cls.lib.glob("covol-*/*.so"))
        cls.environment = {**os.environ, "LD_LIBRARY_PATH": str(cls.lib), "PYTHONDONTWRITEBYTECODE": "1",
                           "PYTHONPATH": str(cls.root / "usr/lib/python3/dist-packages")}

    def field(self, package, name):
        return run("dpkg-deb", "-f", self.debs[package], name).strip()

    def test_fields(self):
        version = self.field("covol", "Version")
        self.assertEqual(run(self.root / "usr/bin/covol", "--version", env=self.environment).split()[1], version)
        self.assertEqual([module.stem for module in self.modules], ["gdcm", "hdf5", "itk"])
        for library in ("libc6", "libopenvdb10.0", "libtbb12", "libtiff6", "libgdcm3.0", "libhdf5-103-1", "libinsighttoolkit5.2"):
            self.assertRegex(self.field("covol", "Depends"), rf"\b{re.escape(library)}\b")
        self.assertNotIn("python", self.field("covol", "Depends"))
        self.assertIn(f"covol (= {version})", self.field("libcovol-dev", "Depends"))
        python = self.field("python3-covol", "Depends")
        for dependency in (f"covol (= {version})", "python3-numpy", f"python3 (>= 3.{sys.version_info.minor}"):
            self.assertIn(dependency, python)
        for name in NAMES:
            self.assertEqual(self.field(name, "Architecture"), run("dpkg", "--print-architecture").strip())

    def test_nothing_is_in_two_packages(self):
        seen = {}
        for name, path in self.debs.items():
            for line in run("dpkg-deb", "-c", path).splitlines():
                file = line.split()[5]
                self.assertTrue(file.endswith("/") or file not in seen, f"{file} is in {name} and {seen.get(file)}")
                self.assertTrue(file.startswith(("./usr/", "./")) and line.split()[1] == "root/root", line)
                seen[file] = name
        owners = {end: {seen[file] for file in seen if file.endswith(end)} for end in
                  ("/bin/covol", ".h", "/libcovol.so", ".pyi", "covolConfig.cmake", "covol.pc", "covol-segment.1.gz", "_covol")}
        self.assertEqual(owners, {"/bin/covol": {"covol"}, ".h": {"libcovol-dev"}, "/libcovol.so": {"libcovol-dev"},
                                  ".pyi": {"python3-covol"}, "covolConfig.cmake": {"libcovol-dev"}, "covol.pc": {"libcovol-dev"},
                                  "covol-segment.1.gz": {"covol"}, "_covol": {"covol"}})

    @unittest.skipUnless(shutil.which("lintian"), "needs lintian")
    def test_lintian(self):
        done = subprocess.run(["lintian", "--allow-root", "--fail-on", "error", *map(str, self.debs.values())],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_libraries_are_found(self):
        for file in [self.root / "usr/bin/covol", *self.lib.glob("*.so*"), *self.modules, *self.root.rglob("_covol*.so")]:
            self.assertNotIn("not found", run("ldd", file, env=self.environment))
            self.assertNotRegex(run("readelf", "-d", file), "RPATH|RUNPATH")
        self.assertIn(str(self.lib), run("ldd", self.root / "usr/bin/covol", env=self.environment))

    def test_quickstart(self):
        out = self.work / "out"
        output = run("bash", ROOT / "houdini_free_examples/00_quickstart.sh",
                   env={**self.environment, "COVOL": str(self.root / "usr/bin/covol"), "COVOL_OUT": str(out)})
        self.assertIn("closed, genus 0", output)
        self.assertGreater((out / "quickstart/embryo.png").stat().st_size, 1000)

    def test_python(self):
        script = "import covol; i, p, l = covol.phantom('sphere', 32, 80); r = covol.segment(i, p); print(covol.__file__, r)"
        output = run("/usr/bin/python3", "-c", script, env=self.environment, cwd="/")
        self.assertIn(str(self.root), output)
        self.assertIn("covol.Result", output)

    @unittest.skipUnless(shutil.which("pkg-config"), "needs pkg-config")
    def test_pkg_config(self):
        source = self.work / "program.cpp"
        source.write_text('#include <covol/phantom.h>\n#include <cstdio>\n'
                          'int main() { std::printf("%zu", covol::list_phantom_kinds().size()); }\n')
        flags = run("pkg-config", "--cflags", "--libs", "covol",
                    env={**self.environment, "PKG_CONFIG_PATH": str(self.lib / "pkgconfig")}).split()
        run("c++", source, "-o", self.work / "program", *flags)
        self.assertGreater(int(run(self.work / "program", env=self.environment)), 3)

    def test_manual_pages(self):
        pages = sorted((self.root / "usr/share/man/man1").glob("*.gz"))
        described = json.loads(run(self.root / "usr/bin/covol", "--describe-options", env=self.environment))
        commands = [command["name"] for command in described["commands"]]
        self.assertGreater(len(commands), 15)
        for command in commands:
            self.assertIn(f"covol-{command}.1.gz", [page.name for page in pages])
        segment = gzip.decompress((self.root / "usr/share/man/man1/covol-segment.1.gz").read_bytes()).decode()
        self.assertIn("\\fB\\-\\-tag\\-distance\\fR", segment)
        if shutil.which("groff"):
            for page in pages:
                text = gzip.decompress(page.read_bytes()).decode()
                output = run("groff", "-man", "-Tutf8", "-ww", "-z", input=text)
                self.assertEqual(output, "", page.name)


@unittest.skipUnless((BUILD / "made/completions/covol").exists(), "needs the target covol_made")
class Completion(unittest.TestCase):
    """Checks the completions that each shell offers."""
    folder = BUILD / "made/completions"

    def bash(self, line):
        script = (f'source "{self.folder}/covol"; COMP_WORDS=({line} ""); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); '
                  f'[[ "{line}" == *" "?* && "{line[-1]}" != " " ]] && {{ unset "COMP_WORDS[COMP_CWORD]"; ((COMP_CWORD--)); }}; '
                  '_covol; printf "%s\\n" "${COMPREPLY[@]}"')
        return run("bash", "-c", script).split()

    def test_bash(self):
        self.assertEqual(self.bash("covol seg"), ["segment"])
        self.assertIn("reconstruct", self.bash("covol "))
        self.assertEqual(self.bash("covol segment --tag-d"), ["--tag-distance"])
        self.assertIn("--threads", self.bash("covol segment --"))
        self.assertEqual(self.bash("covol segment --model "), ["guided", "paper"])
        self.assertEqual(self.bash("covol segment --theta "), [])
        self.assertNotIn("--holes", self.bash("covol segment --ho"))
        self.assertIn("--holes", self.bash("covol reconstruct --ho"))

    @unittest.skipUnless(shutil.which("fish"), "needs fish")
    def test_fish(self):
        def fish(line):
            output = run("fish", "-c", f"source {self.folder}/covol.fish; complete -C '{line}'")
            return [offer.split("\t")[0] for offer in output.splitlines()]
        self.assertEqual(fish("covol seg"), ["segment"])
        self.assertIn("--tag-distance", fish("covol segment --tag"))
        self.assertEqual(fish("covol segment --model "), ["guided", "paper"])
        self.assertNotIn("--holes", fish("covol segment --ho"))

    @unittest.skipUnless(shutil.which("zsh"), "needs zsh")
    def test_zsh(self):
        run("zsh", "-n", self.folder / "_covol")
        text = (self.folder / "_covol").read_text()
        self.assertIn("'--model[", text)
        self.assertIn(":(guided paper)'", text)


if __name__ == "__main__":
    unittest.main()
