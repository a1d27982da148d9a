"""Tests of what a server can do that means ill, run in Blender by addon_test.py. A scene's file names
its server, and anybody may have made the file."""

import contextlib
import io
import threading
import time
import types
from unittest import mock

import bpy
import numpy as np
from in_blender import add_liquid, module, package
from liquid_testing import LiquidTest, state_of

SERVER = "evil.example:443"
COMMANDS = "\x1b[2J\r\n\x9b31m"  # to a terminal


def error_of(name, message):
    return getattr(package(), name)(package().Status.UNKNOWN, message)


def make_family(targets=(), parameters=(), points=()):
    return types.SimpleNamespace(
        up=package().Up.Z, duration=1.0, frames_per_second=24.0, version=1, targets=targets,
        parameters=parameters, points=points)


class FakeClient:
    """Stands in for the package's Client: a server that answers what a test says."""

    family_found = None
    message = "no frames"
    holds_up = None  # an event that answers wait for

    def __init__(self, *_arguments, **_options):
        pass

    def families(self):
        if self.holds_up:
            self.holds_up.wait(20.0)
        return ["drops"]

    def family(self, _name, _version):
        return self.family_found

    def frame(self, *_arguments, **_options):
        raise error_of("NotFound", self.message)


class HostileTest(LiquidTest):
    def setUp(self):
        super().setUp()
        patch = mock.patch.object(package(), "Client", FakeClient)
        patch.start()
        self.addCleanup(patch.stop)
        self.addCleanup(module("playback").forget)
        self.liquid = add_liquid(kind='SERVER', server=SERVER)
        with module("playback").held():
            self.liquid.liquidblend.family = "drops"

    def connect(self, *targets, **family):
        with mock.patch.object(FakeClient, "family_found", make_family(targets, **family)):
            bpy.ops.liquidblend.connect()

    def keys(self):
        return [control.key for control in self.liquid.liquidblend.controls]


class Names(HostileTest):
    def assert_refused(self, *targets, why, **family):
        """Nothing changes, and the panel tells why."""
        before, keys = list(self.liquid.keys()), self.keys()
        with self.assertRaisesRegex(RuntimeError, why):
            self.connect(*targets, **family)
        self.assertRegex(state_of(self.liquid).error, why)
        self.assertEqual((list(self.liquid.keys()), self.keys()), (before, keys))

    def test_do_not_replace_values_of_add_ons(self):
        self.connect("drops_b")
        self.liquid.cycles.use_camera_cull = True
        for name in ("cycles", "liquidblend"):
            self.assert_refused("drops_c", name, why=f"'{name}': an add-on's values")
            self.assertTrue(self.liquid.cycles.use_camera_cull)

    def test_do_not_replace_values_of_add_ons_that_are_gone(self):
        self.liquid["gone"] = {"size": 3.0}
        self.assert_refused("gone", why="'gone': the object has another custom property")
        self.assertEqual(self.liquid["gone"]["size"], 3.0)

    def test_do_not_change_the_users_own_properties(self):
        self.liquid["mass"] = 12.0
        self.assert_refused("mass", why="'mass': the object has another custom property")
        self.assertEqual(self.liquid["mass"], 12.0)

    def test_of_controls_that_are_there_no_more_are_known_again(self):
        self.connect("drops_b", "drops_c")
        self.liquid["drops_b"] = 0.5
        self.liquid["drops_c"] = 1  # as scripts do
        for targets in (("drops_b", "drops_c"), ("other",), (), ("drops_c", "drops_b")):
            self.connect(*targets)
            self.assertEqual(self.keys(), list(targets))
        self.assertEqual((self.liquid["drops_b"], self.liquid["drops_c"]), (0.5, 1.0))
        self.assertEqual(len(self.liquid.liquidblend.former_controls), 3)

    def test_that_blender_has_for_other_things_are_fit(self):
        self.connect("scale", "location")
        self.assertEqual(self.keys(), ["scale", "location"])
        self.assertEqual(tuple(self.liquid.scale), (1.0, 1.0, 1.0))

    def test_are_cut_between_characters(self):
        names = ("é" * 40, "水" * 40, "a" * 70)
        self.connect(*names)
        self.assertEqual(self.keys(), ["é" * 31, "水" * 21, "a" * 63])
        self.assertEqual([c.name for c in self.liquid.liquidblend.controls], list(names))

    def test_that_are_none_are_refused(self):
        for name in ("", COMMANDS, "a" * 100000):
            self.assert_refused("drops_b", name, why="that is no name")

    def test_are_a_thousand_at_most(self):
        self.connect(*(f"drops_{i}" for i in range(1000)))
        self.assert_refused(*(f"drops_{i}" for i in range(1001)), why="1001 weights")

    def test_of_ranges_without_numbers_are_refused(self):
        for number in (float("nan"), float("inf")):
            self.assert_refused(parameters=("height",), points=((number,), (1.0,)),
                                why="'height': its range")


class Words(HostileTest):
    def written(self, work):
        """What is written to stderr meanwhile."""
        with contextlib.redirect_stderr(io.StringIO()) as stderr:
            work()
        return stderr.getvalue()

    def assert_has_no_commands(self, text):
        self.assertIn("?[2J???31m", text)
        self.assertTrue(text.rstrip("\n").isprintable(), ascii(text))

    def assert_is_a_trace_without_commands(self, text):
        """A trace has lines, and a text may begin others."""
        self.assertIn("?[2J?\n?31m", text)
        self.assertTrue(all(line.isprintable() for line in text.split("\n")), ascii(text))

    def test_of_a_frame_that_is_missing(self):
        self.connect("drops_b")
        with mock.patch.object(FakeClient, "message", f"none{COMMANDS}"):
            self.assert_has_no_commands(self.written(lambda: self.scene.frame_set(7)))
        self.assert_has_no_commands(state_of(self.liquid).error)

    def test_of_a_connection_that_fails(self):
        def refuse(_client):
            raise error_of("PermissionDenied", COMMANDS)

        with mock.patch.object(FakeClient, "families", refuse):
            with self.assertRaises(RuntimeError) as raised:
                bpy.ops.liquidblend.connect()
        self.assertIn("?[2J???31m", str(raised.exception))
        self.assertNotIn("\x1b", str(raised.exception))
        self.assert_has_no_commands(state_of(self.liquid).error)

    def test_of_a_task(self):
        task = module("tasks").Task("send")
        task.run(lambda report: report(COMMANDS, 0.5))
        self.assert_has_no_commands(task.stage)

        def fail(_report):
            try:
                raise error_of("NotFound", COMMANDS)
            finally:
                raise TypeError("this is not expected")

        written = self.written(lambda: task.run(fail))
        self.assertIn("TypeError: this is not expected", written)
        self.assert_is_a_trace_without_commands(written)

    def test_of_a_handler_that_fails(self):
        def fail():
            raise error_of("NotFound", COMMANDS)

        written = self.written(lambda: module("handlers")._guarded(fail))
        self.assert_is_a_trace_without_commands(written)

    def test_of_families_are_suggested_if_they_are_names(self):
        settings = module("settings")
        settings.set_family_names(["drops", COMMANDS])
        self.assertEqual(settings._suggest_families(None, None, ""), ["drops"])


class Answers(HostileTest):
    def test_that_do_not_come_hold_up_the_window_for_a_while_only(self):
        connection, released = module("connection"), threading.Event()
        self.addCleanup(released.set)
        begin = time.monotonic()
        with mock.patch.object(FakeClient, "holds_up", released), \
                mock.patch.object(connection, "_ANSWER_S", 0.2):
            with self.assertRaisesRegex(RuntimeError, f"no answer of {SERVER} within 0.2 s"):
                bpy.ops.liquidblend.connect()
        self.assertLess(time.monotonic() - begin, 10.0)

    def test_that_time_is_up_at_once_leave_a_task_that_can_be_stopped(self):
        cancelled, num_waits, begin = [], [], time.monotonic()

        class Job:
            state = types.SimpleNamespace(done=False, waiting_for="", stage="queued", fraction=0.0)

            def wait(self, _progress, timeout):
                num_waits.append(timeout)
                if len(num_waits) > 100:
                    raise AssertionError("it asks without end")
                raise package().DeadlineExceeded(package().Status.DEADLINE_EXCEEDED, "at once")

            def cancel(self):
                cancelled.append(True)

        task, connection = module("tasks").Task("register"), module("connection")

        def report(stage, fraction):
            task.is_cancelled = len(num_waits) == 3
            task.report(stage, fraction)

        with mock.patch.object(connection, "_LOOK_S", 0.05):
            task.run(lambda _report: connection._watch(Job(), report))
        self.assertEqual((task.error, cancelled, len(num_waits)), ("stopped", [True], 3))
        self.assertGreaterEqual(time.monotonic() - begin, 0.15, "it asks without a pause")


class Triangles(LiquidTest):
    def test_with_a_vertex_twice_are_left_out(self):
        """Blender 3.4.1 crashes where it finds no edges."""
        positions = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        surface = module("surface")
        for triangles in ([[2, 2, 2]], [[0, 1, 1], [0, 0, 1], [1, 0, 1]],
                          [[0, 0, 0], [0, 1, 2], [3, 3, 1]]):
            whole = [t for t in triangles if len(set(t)) == 3]
            made = surface.make_surface({"positions": positions, "triangles": np.uint32(triangles),
                                         "normals": positions})
            self.assertEqual(made.triangles.tolist(), whole)
            mesh = bpy.data.meshes.new("test")
            surface.write_mesh(mesh, made, 'NORMALS')
            self.assertEqual(len(mesh.polygons), len(whole))
            self.assertFalse(mesh.validate())
            bpy.data.meshes.remove(mesh)
