#!/usr/bin/python3
"""Tests which folders deploy/images/prebuild.sh replaces: prebuild_test.py CHECKOUT"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

CHECKOUT = pathlib.Path(sys.argv.pop(1)).resolve()
PROGRAMS = ["liquidblend", "liquidblend-admin", "liquidblend-server", "liquidblend-worker",
            "liquidblend_vdb.so"]
TESTS = ["e2e_kill_test", "e2e_tests.txt", "liblb_fault_layer.so", "steady_client", "suite.sh"]
# Stand in for what configures, compiles and installs tests.
CMAKE = f"""#!/bin/sh
[ "$1" = --install ] || exit 0
for last; do :; done
mkdir -p "$last/tests" && cd "$last/tests" && touch {' '.join(TESTS)}
"""
NINJA = f"""#!/bin/sh
mkdir -p build/release/bin
for name in {' '.join(PROGRAMS)}; do cp /bin/true build/release/bin/$name; done
"""


def names_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


MADE = sorted(["bin", "tests", *(f"bin/{name}" for name in PROGRAMS),
               *(f"tests/{name}" for name in TESTS)])


class Prebuild(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.script = self.folder / "deploy" / "images" / "prebuild.sh"
        self.script.parent.mkdir(parents=True)
        shutil.copy(CHECKOUT / "deploy" / "images" / "prebuild.sh", self.script)
        self.out = self.folder / "out"
        for name, text in (("cmake", CMAKE), ("ninja", NINJA)):
            program = self.folder / "path" / name
            program.parent.mkdir(exist_ok=True)
            program.write_text(text)
            program.chmod(0o755)

    def run_into(self, *folder):
        path = f"{self.folder / 'path'}:{os.environ['PATH']}"
        return subprocess.run([self.script, *folder], env={**os.environ, "PATH": path},
                              capture_output=True, text=True, check=False)

    def assert_makes(self, folder):
        done = self.run_into(folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(names_in(self.folder / folder), MADE)

    def add(self, name, text=""):
        path = self.out / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def test_makes_a_folder_and_fills_an_empty_one(self):
        self.assert_makes("build/prebuilt")
        self.out.mkdir()
        self.assert_makes("out")

    def test_replaces_what_it_has_made(self):
        self.assert_makes("out")
        self.add("tests/e2e_of_before_test")
        self.add("bin/liquidblend", "of before")
        self.assert_makes("out")
        self.assertNotEqual((self.out / "bin" / "liquidblend").read_bytes(), b"of before")

    def test_goes_on_where_it_was_interrupted(self):
        self.add("bin/liquidblend")
        self.assert_makes("out")

    def test_leaves_folders_of_others_as_they_are(self):
        for other in ("bin/python", "share/notes", "notes", "tests/mine_test.py", "bin/e2e_a_test",
                      "bin/liquidblend/notes"):
            with self.subTest(other=other):
                self.add("tests/suite.sh")
                self.add(other, "mine")
                before = names_in(self.out)
                done = self.run_into(self.out)
                self.assertEqual(done.returncode, 2, done.stdout)
                self.assertRegex(done.stderr, r"out holds \S+, which is not made here")
                self.assertEqual(names_in(self.out), before)
                self.assertEqual((self.out / other).read_text(), "mine")
                self.assertFalse((self.folder / "build").exists(), "it has compiled before")
                shutil.rmtree(self.out)


unittest.main()
