"""The example programs run, and show what they say."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from service import DATA, NUM_FRAMES, copy_frames, read_ply, service

PACKAGE = pathlib.Path(__file__).resolve().parents[3] / "client" / "python"


def started(example, *arguments):
    environment = {
        **os.environ,
        "PYTHONPATH": str(PACKAGE),
        "LIQUIDBLEND_SERVER": service().target,
    }
    command = [sys.executable, "-B", PACKAGE / "examples" / example, *map(str, arguments)]
    return subprocess.run(command, env=environment, capture_output=True, text=True)


def run(example, *arguments):
    done = started(example, *arguments)
    if done.returncode != 0:
        raise AssertionError(f"{example}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def distances(truth, weights, num_frames):
    """The mean distance by weight."""
    flags = ["--weights", weights, "--frames", num_frames]
    text = run("compare_with_truth.py", "two_drops", truth, *flags)
    found = re.findall(r"^weight (\S+): ([\d.]+), at most", text, re.MULTILINE)
    return {float(weight): float(distance) for weight, distance in found}


def program_of_page():
    """The first of docs/python.md, for the tests' server."""
    page = (PACKAGE.parents[1] / "docs" / "python.md").read_text()
    program = re.search(r"```python\n(.*?)```", page, re.DOTALL).group(1)
    assert '"127.0.0.1:50051"' in program
    return program.replace("127.0.0.1:50051", service().target)


class ExamplesTest(unittest.TestCase):
    def test_the_program_of_the_page_runs(self):
        environment = {**os.environ, "PYTHONPATH": str(PACKAGE)}
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-B", "-c", program_of_page()]
            done = subprocess.run(
                command, env=environment, cwd=folder, capture_output=True, text=True
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            vertices, triangles = read_ply(pathlib.Path(folder) / "frame.ply")
        shapes, *frames = done.stdout.splitlines()
        self.assertEqual(shapes, f"({len(vertices)}, 3) ({len(triangles)}, 3)")
        self.assertEqual(len(frames), NUM_FRAMES)
        self.assertRegex(frames[1], r"^0.042 s, highest at 1\.\d\d m$")

    def test_a_blend_is_nearer_to_the_truth_than_its_inputs(self):
        far = distances(DATA / "two_drops" / "MID", "0,0.5,1", 2)
        self.assertEqual(set(far), {0, 0.5, 1})
        self.assertLess(far[0.5], 0.5 * min(far[0], far[1]))
        self.assertGreater(min(far[0], far[1]), 0.2, "the inputs are no truth")

    def test_weight_0_is_the_source(self):
        self.assertLess(distances(DATA / "two_drops" / "A", "0", 1)[0], 0.05)

    def test_volumes_are_those_of_the_liquid(self):
        lines = run("volumes.py", "two_drops", "--fps", 8).splitlines()[1:]
        self.assertEqual(len(lines), (NUM_FRAMES - 1) * 8 // 24 + 1)
        volumes = [float(number) for line in lines for number in re.findall(r"([\d.]+) m3", line)]
        self.assertEqual(len(volumes), 3 * len(lines))
        # A pool of 4.4 x 2.4 x 0.7 m and two drops of radius 0.36 m; the simulation gains some.
        self.assertGreater(min(volumes), 7.3)
        self.assertLess(max(volumes), 9.5)

    def test_help_is_the_text_at_their_beginning(self):
        for example in ("compare_with_truth.py", "register.py", "volumes.py"):
            text = (PACKAGE / "examples" / example).read_text()
            beginning = re.search(r'"""(.*?)"""', text, re.DOTALL).group(1)
            self.assertIn(beginning, run(example, "--help"), example)

    def test_an_option_without_a_value_is_named(self):
        for option in ("seed", "=7"):
            done = started("register.py", "example", "folder", "--option", option)
            self.assertEqual(done.returncode, 2)
            self.assertIn(f"{option!r} is not NAME=VALUE", done.stderr)

    def test_errors_of_the_server_are_one_line(self):
        for command in (
            ["volumes.py", "none"],
            ["compare_with_truth.py", "none", DATA / "two_drops" / "MID"],
            ["register.py", "example", "/nowhere"],
        ):
            done = started(*command)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, rf"^{command[0]}: NOT_FOUND: .*\n$")

    def test_registers_with_progress(self):
        folders = [service().folder / "example" / name for name in ("w0_p0", "w1_p1")]
        for folder in folders:
            copy_frames(DATA / "dam_break_clip" / folder.name, folder, range(13, 17))
        text = run("register.py", "example", *folders, "--option", "max_iterations=1")
        # Which stages it sees depends on how long they take.
        self.assertRegex(text, r"example_0: +\d+ % (?s:.*)example: 100 % done\n")
        self.assertRegex(text, r"example version 1: (GOOD|DOUBTFUL|TOO_DIFFERENT)\n$")
        self.assertIn("example", service().client.families())
