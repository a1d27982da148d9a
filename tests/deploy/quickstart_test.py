#!/usr/bin/python3
"""What deploy/quickstart.sh does with a folder that is there: quickstart_test.py CHECKOUT PROGRAMS

PROGRAMS is the folder of a build's programs. tests/cold_build.sh runs it where nothing is there.
"""

import contextlib
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

PROGRAMS = pathlib.Path(sys.argv.pop(2)).resolve()
CHECKOUT = pathlib.Path(sys.argv.pop(1)).resolve()
TWO_DROPS = CHECKOUT / "tests" / "data" / "two_drops"
NUM_FRAMES = 40  # the pictures are of times up to 1.5 s


@contextlib.contextmanager
def serving(data):
    """A server on a store; gives what runs the command there, and the server's process."""
    server = subprocess.Popen([PROGRAMS / "liquidblend-server", "--data", data,
                               "--listen", "127.0.0.1:0"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        line = server.stdout.readline()
        target = line.removeprefix("listening on ").strip()

        def command(*arguments):
            return subprocess.run([PROGRAMS / "liquidblend", "--server", target, *arguments],
                                  capture_output=True, text=True, check=False)

        yield command, server
    finally:
        server.terminate()
        server.communicate()


def run_quickstart(out):
    # A picture of the page is left out: it takes a browser.
    return subprocess.run([CHECKOUT / "deploy" / "quickstart.sh", "--programs", PROGRAMS],
                          env={**os.environ, "OUT": str(out), "CHROMIUM": "/bin/false"},
                          stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)


class Quickstart(unittest.TestCase):
    """Its store is there, with the first frames and one iteration, and an animation of the user's.
    """

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.out = pathlib.Path(folder.name)
        with serving(cls.out / "data") as (command, _):
            for name, source in (("drops_a", "A"), ("drops_b", "B"), ("mine", "A")):
                frames = cls.out / name
                frames.mkdir()
                shutil.copy(TWO_DROPS / source / "meta.json", frames)
                for number in range(1, NUM_FRAMES + 1):
                    for path in (TWO_DROPS / source).glob(f"*_{number:04d}.*"):
                        shutil.copy(path, frames)
                command("import", name, frames).check_returncode()
            made = command("register", "two_drops", "--source", "drops_a", "--target", "drops_b",
                           "--iterations", "1", "--wait")
            if made.returncode not in (0, 6):  # 6: the verdict
                raise AssertionError(made.stderr)
            cls.listed = command("list").stdout

    def test_keeps_what_is_in_its_store(self):
        done = run_quickstart(self.out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        for name in ("animations/drops_a", "animations/drops_b", "families/two_drops"):
            self.assertIn(f"{name} is there already, and stays as it is", done.stdout)
        self.assertTrue((self.out / "blend.png").exists())
        with serving(self.out / "data") as (command, _):
            self.assertEqual(command("list").stdout, self.listed)
            self.assertEqual(command("inspect", "animations/mine").returncode, 0)

    def test_leaves_a_store_alone_that_a_server_uses(self):
        with serving(self.out / "data") as (command, server):
            done = run_quickstart(self.out)
            self.assertEqual(done.returncode, 2, done.stdout)
            self.assertIn(f"a server runs on {self.out}/data already, process {server.pid}",
                          done.stderr)
            self.assertEqual(command("list").stdout, self.listed)

    def test_leaves_a_folder_alone_that_is_no_store(self):
        other = self.out / "other"
        (other / "data").mkdir(parents=True)
        (other / "data" / "thesis.tex").write_text("mine")
        done = run_quickstart(other)
        self.assertEqual(done.returncode, 2, done.stdout)
        self.assertIn(f"{other}/data is there and is no store of liquidblend", done.stderr)
        self.assertEqual([str(path.relative_to(other)) for path in sorted(other.rglob("*"))],
                         ["data", "data/thesis.tex"])


unittest.main()
