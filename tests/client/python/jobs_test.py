"""Jobs: imports and registrations with progress, failures, Ctrl-C."""

import os
import pathlib
import signal
import socket
import subprocess
import sys
import time
import unittest
import unittest.mock

import liquidblend
from service import DATA, FAST, PATIENCE, Server, copy_frames, service

PACKAGE = pathlib.Path(__file__).resolve().parents[3] / "client" / "python"
CLIP = DATA / "dam_break_clip"


def setUpModule():
    client = service().client
    for job in [client.import_animation(f"dam_{k}", CLIP / f"w{k}_p{k}") for k in range(2)]:
        job.wait(timeout=PATIENCE)


# Beginning of a program that presses Ctrl-C on itself when its main thread is within a function, and can
# wait until another process is stopped.
INTERRUPTION = """
import glob, os, signal, socket, sys, threading, time

def press_ctrl_c_in(file, function):
    main = threading.get_ident()

    def watch():
        while True:
            code = sys._current_frames()[main].f_code
            if code.co_name == function and os.path.basename(code.co_filename) == file:
                return os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.001)

    threading.Thread(target=watch, daemon=True).start()

def await_stopped(pid):
    def is_stopped(path):
        try:
            with open(path) as stat:
                return stat.read().rsplit(")", 1)[1].split()[0] == "T"
        except OSError:
            return False

    while not all(map(is_stopped, glob.glob(f"/proc/{pid}/task/*/stat"))):
        time.sleep(0.001)
"""


def interrupted(code):
    """Runs Python that presses Ctrl-C on itself; returns its exit code and errors."""
    process = subprocess.Popen(
        [sys.executable, "-B", "-c", INTERRUPTION + code],
        env={**os.environ, "PYTHONPATH": str(PACKAGE)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        _, errors = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise
    return process.returncode, errors


class JobTest(unittest.TestCase):
    def setUp(self):
        self.client = service().client

    def test_an_import_tells_what_it_makes(self):
        folder = service().folder / "four"
        copy_frames(CLIP / "w0_p0", folder, range(13, 17))
        job = self.client.import_animation("four", folder, allow_gaps=False, up=liquidblend.Up.Z)
        states = list(job)
        self.assertEqual(states[-1].subject, "four")
        self.assertTrue(states[-1].done)
        self.assertEqual(states[-1].status, liquidblend.Status.OK)
        self.assertEqual(self.client.animation("four")["numFrames"], 4)
        self.assertIn(job.name, self.client.operations())
        self.client.delete_animation("four")
        self.assertNotIn("four", self.client.animations())

    def test_an_import_of_nothing_is_refused_before_it_is_sent(self):
        with self.assertRaisesRegex(liquidblend.NotFound, "/nowhere"):
            self.client.import_animation("none", "/nowhere")

    def test_a_registration_with_all_that_it_takes(self):
        pair = liquidblend.Correspondence((0.1, 0, 0.2), 0.1, (0.1, 0, 0.2), 0.1, hard=True)
        job = self.client.register(
            "dam",
            "dam_0",
            ["dam_1"],
            correspondences=[pair],
            parameters={"width": [5, 7]},
            options={**FAST, "automatic_correspondences": False},
            priority=3,
        )
        states = []
        last = job.wait(states.append, timeout=PATIENCE)
        self.assertEqual(last, job.state)
        self.assertEqual(last.version, 1)
        self.assertIn(last.grade, set(liquidblend.Grade) - {liquidblend.Grade.UNKNOWN})
        fractions = [state.fraction for state in states]
        self.assertEqual(fractions, sorted(fractions))
        self.assertGreater(len(set(fractions)), 2, "no progress was seen")
        family = self.client.family("dam")
        self.assertEqual(family.parameters, ("width",))
        self.assertEqual(family.points, ((5,), (7,)))
        report = family.raw["reports"][0]["correspondences"]
        self.assertEqual(len(report), 1, "the user's, and no automatic one")
        by_point = self.client.frame("dam", parameters={"width": 5.5}, time=0.2)
        by_weight = self.client.frame("dam", 0.25, 0.2)
        self.assertEqual(by_point.weights, (0.25,))
        self.assertEqual(by_point.to_ply(), by_weight.to_ply())
        with self.assertRaises(liquidblend.OutOfRange) as raised:
            self.client.frame("dam", parameters={"width": 9})
        self.assertEqual(raised.exception.reason, "OUTSIDE_HULL")

    def test_a_failed_job_raises_its_reason(self):
        folder = service().folder / "few"
        copy_frames(CLIP / "w0_p0", folder / "dam", range(13, 17))
        copy_frames(DATA / "two_drops" / "A", folder / "drops", range(1, 5))
        for name in ("dam", "drops"):
            self.client.import_animation(f"few_{name}", folder / name).wait(timeout=PATIENCE)
        job = self.client.register(
            "unlike",
            "few_drops",
            "few_dam",
            options=FAST,
            required_grade=liquidblend.Grade.GOOD,
        )
        with self.assertRaises(liquidblend.FailedPrecondition) as raised:
            job.wait(timeout=PATIENCE)
        self.assertEqual(raised.exception.reason, "VERDICT_TOO_LOW")
        self.assertIn("few_dam", raised.exception.message)
        self.assertEqual(self.client.job(job.name).state.reason, "VERDICT_TOO_LOW")

    def test_wrong_requests_are_named(self):
        for arguments, named in (
            ({"options": {"seeds": 7}}, "'seeds'"),
            ({"options": {"max_iterations": "many"}}, "max_iterations: 'many'"),
            ({"parameters": {"width": [1]}}, "width has 1 values for 2 animations"),
            ({"required_grade": liquidblend.Grade.TOO_DIFFERENT}, "required_grade is 3"),
        ):
            with self.assertRaisesRegex(liquidblend.InvalidArgument, named):
                self.client.register("new", "dam_0", "dam_1", **arguments)


class WaitingTest(unittest.TestCase):
    """How waiting for a job ends that is never done: no worker is there for it."""

    @classmethod
    def setUpClass(cls):
        cls.server = Server("--workers", "0")
        cls.addClassCleanup(cls.server.stop)
        cls.client = liquidblend.connect(cls.server.target)
        cls.job = cls.client.import_animation("dam", CLIP / "w0_p0")

    def test_after_the_timeout_the_job_goes_on(self):
        with self.assertRaises(liquidblend.DeadlineExceeded):
            self.job.wait(timeout=0.1)
        with self.assertRaises(TimeoutError):
            self.job.wait(timeout=0)
        self.assertFalse(self.job.poll().done)

    def test_an_exception_of_progress_ends_it(self):
        class Enough(Exception):
            pass

        def progress(state):
            raise Enough(state.name)

        with self.assertRaisesRegex(Enough, self.job.name):
            self.job.wait(progress)
        self.assertFalse(self.job.poll().done)

    def test_ctrl_c_ends_it(self):
        code, errors = interrupted(
            "import liquidblend\n"
            f"client = liquidblend.connect({self.server.target!r})\n"
            f"job = client.job({self.job.name!r})\n"
            "press_ctrl_c_in('jobs.py', '_states')\n"
            "job.wait()\n"
        )
        self.assertIn("KeyboardInterrupt", errors)
        self.assertEqual(code, -signal.SIGINT, errors)
        self.assertFalse(self.job.poll().done)

    def test_a_cancelled_job_says_so(self):
        job = self.client.import_animation("cancelled", CLIP / "w0_p0")
        job.cancel()
        with self.assertRaises(liquidblend.Cancelled):
            job.wait(timeout=PATIENCE)


class SilentServerTest(unittest.TestCase):
    """A server that falls silent when a job is done, before it tells that it serves the version."""

    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.addClassCleanup(cls.server.stop)
        cls.client = liquidblend.connect(cls.server.target)
        for k in range(2):
            job = cls.client.import_animation(f"dam_{k}", CLIP / f"w{k}_p{k}")
            job.wait(timeout=PATIENCE)
        cls.job = cls.client.register("dam", "dam_0", "dam_1", options=FAST)
        cls.job.wait(timeout=PATIENCE)

    def setUp(self):
        self.addCleanup(os.kill, self.server.pid, signal.SIGCONT)

    def fall_silent(self, state):
        if state.done:
            os.kill(self.server.pid, signal.SIGSTOP)
            os.waitid(os.P_PID, self.server.pid, os.WSTOPPED)  # till then it may answer

    def test_is_not_waited_for_after_the_timeout(self):
        begin = time.monotonic()
        with self.assertRaises(liquidblend.DeadlineExceeded) as raised:
            self.client.job(self.job.name).wait(self.fall_silent, timeout=1)
        self.assertLess(time.monotonic() - begin, 20)
        self.assertIn(
            f"{self.job.name} has published version 1 of dam, but not every server is known to "
            f"serve it yet: the server at {self.server.target} has not said",
            raised.exception.message,
        )

    def test_has_a_moment_to_answer_also_after_a_timeout_of_nothing(self):
        with unittest.mock.patch("liquidblend.jobs._SHORTEST_WATCH", PATIENCE):
            self.assertEqual(self.client.job(self.job.name).wait(timeout=0).version, 1)

    def test_is_not_waited_for_after_ctrl_c(self):
        code, errors = interrupted(
            "import liquidblend\n"
            f"client = liquidblend.connect({self.server.target!r})\n"
            f"job = client.job({self.job.name!r})\n"
            "def fall_silent(state):\n"
            f"    os.kill({self.server.pid}, signal.SIGSTOP)\n"
            f"    await_stopped({self.server.pid})\n"
            "    press_ctrl_c_in('_calls.py', 'wait')\n"
            "job.wait(fall_silent)\n"
        )
        self.assertIn("KeyboardInterrupt", errors)
        self.assertEqual(code, -signal.SIGINT, errors)


class InterruptTest(unittest.TestCase):
    """Ctrl-C while a call of the library waits for a server."""

    def test_ends_calls_that_wait_for_a_server(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            target = f"127.0.0.1:{silent.getsockname()[1]}"
            code, errors = interrupted(
                "import liquidblend\n"
                "press_ctrl_c_in('_calls.py', 'wait')\n"
                f"liquidblend.connect({target!r}, connect_timeout=600)\n"
            )
        self.assertIn("KeyboardInterrupt", errors)
        self.assertEqual(code, -signal.SIGINT, errors)

    def test_ends_a_stream_that_waits_and_the_client_goes_on(self):
        code, errors = interrupted(
            "import liquidblend\n"
            f"client = liquidblend.connect({service().target!r})\n"
            "how = {'live': True, 'loop': True, 'frames_per_second': 0.001}\n"
            "stream = client.stream('two_drops', 0, **how)\n"
            "next(stream)\n"
            "try:\n"
            "    press_ctrl_c_in('_calls.py', 'wait')\n"
            "    next(stream)\n"
            "except KeyboardInterrupt:\n"
            "    assert stream.closed\n"
            "    assert 'two_drops' in client.families()\n"
            "else:\n"
            "    sys.exit('the stream has not waited')\n"
        )
        self.assertEqual(code, 0, errors)

    def test_ends_the_opening_of_a_stream_without_a_connection(self):
        server = Server("--workers", "0")
        self.addCleanup(server.stop)
        port = server.target.rpartition(":")[2]
        code, errors = interrupted(
            "import liquidblend\n"
            f"client = liquidblend.connect({server.target!r})\n"
            f"os.kill({server.pid}, signal.SIGKILL)\n"
            "silent = None\n"
            "while silent is None:\n"
            "    try:\n"
            f"        silent = socket.create_server(('127.0.0.1', {port}))\n"
            "    except OSError:\n"
            "        time.sleep(0.01)\n"
            "press_ctrl_c_in('_calls.py', 'wait')\n"
            "while True:  # the first may not know yet that the connection is lost\n"
            "    client.stream('two_drops', 0)\n"
        )
        self.assertIn("KeyboardInterrupt", errors)
        self.assertEqual(code, -signal.SIGINT, errors)
