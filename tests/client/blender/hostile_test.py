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
    job = None

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

    def import_animation(self, *_arguments, **_options):
        if self.holds_up:
            self.holds_up.wait(20.0)
        return self.job

    def register(self, *_arguments, **_options):
        return self.job


class FakeJob:
    """A job of a server that answers what a test says."""

    name = "operations/evil-1"

    def __init__(self, **state):
        state = {"done": False, "waiting_for": "", "stage": "queued", "fraction": 0.0, **state}
        self.state = types.SimpleNamespace(version=1, grade=package().Grade.GOOD, **state)
        self.timeouts = []  # of the waits
        self.is_cancelled = threading.Event()
        self.holds_up = threading.Event()  # what the waits wait for
        self.holds_up_cancel = None

    def wait(self, progress=None, timeout=None):
        self.timeouts.append(timeout)
        self.holds_up.wait(20.0)
        return self.state

    def cancel(self):
        if self.holds_up_cancel:
            self.holds_up_cancel.wait(20.0)
        self.is_cancelled.set()


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

    def test_of_scenes_of_older_add_ons_are_known_again(self):
        """They kept the custom properties of a former family, and no list of them."""
        for name, targets, family in (
                ("drops_b", ["drops_b"], {}),
                ("height", [], {"parameters": ("height",), "points": ((1.0,), (3.0,))})):
            self.connect(*targets, **family)
            self.liquid[name] = 1.5
            self.connect("other")
            self.liquid.liquidblend.former_controls.clear()
            self.connect(*targets, **family)
            self.assertEqual(self.keys(), [name])
            self.assertEqual(self.liquid[name], 1.5)

    def test_that_a_script_animates_before_it_connects_are_fit(self):
        keyed, driven, in_strip = 'drops_"b"', "drops_c", "drops_d"
        for name in (keyed, driven, in_strip):
            self.liquid[name] = 0.5
        self.liquid.keyframe_insert(f'["{in_strip}"]', frame=1)
        animation = self.liquid.animation_data
        animation.nla_tracks.new().strips.new("strip", 1, animation.action)
        animation.action = None
        self.liquid.keyframe_insert(f'["{bpy.utils.escape_identifier(keyed)}"]', frame=1)
        self.liquid.driver_add(f'["{driven}"]').driver.expression = "0.5"
        self.connect(keyed, driven, in_strip)
        self.assertEqual(self.keys(), [keyed, driven, in_strip])
        self.assertEqual([self.liquid[name] for name in self.keys()], 3 * [0.5])
        self.assertEqual(len(animation.action.fcurves) + len(animation.drivers), 2)

    def test_that_are_animated_are_fit_for_numbers_only(self):
        self.liquid["row"], self.liquid["text"] = [1.0, 2.0], "words"
        self.liquid.keyframe_insert('["row"]', frame=1)
        self.liquid.id_properties_ui("text").update(description="Parameter text")
        self.liquid["mass"] = 12.0
        self.liquid.id_properties_ui("mass").update(description="Mass: Parameter of an add-on")
        for name in ("row", "text", "mass"):
            self.assert_refused(name, why=f"'{name}': the object has another custom property")
        self.assertEqual(list(self.liquid["row"]), [1.0, 2.0])

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


class Stop(HostileTest):
    """The button, in Blender's window, while a server does not answer."""

    def setUp(self):
        super().setUp()
        tasks = module("tasks")
        timers = types.SimpleNamespace(register=lambda *_arguments, **_options: None)
        app = types.SimpleNamespace(background=False, timers=timers)
        self.job, released = FakeJob(), threading.Event()
        self.job.holds_up = self.released = released
        for patch in (mock.patch.object(tasks, "bpy", types.SimpleNamespace(app=app)),
                      mock.patch.object(FakeClient, "job", self.job)):
            patch.start()
            self.addCleanup(patch.stop)
        self.addCleanup(released.set)

    def start(self, work, is_begun):
        """Starts a task, and waits until it has come so far."""
        module("tasks").start("test", work)
        self.wait_until(is_begun)

    def start_import(self, is_begun):
        origin = module("ask").server_of(self.liquid.liquidblend)
        self.start(lambda report: module("connection").import_animation(
            origin, "drops", "folder", {}, report), is_begun)

    def start_registration(self, is_begun=None):
        origin = module("ask").server_of(self.liquid.liquidblend)
        connection = module("connection")
        request = connection.Registration("drops", "a", ["b"], [], 'NEW')
        self.start(lambda report: connection.register(origin, request, report),
                   is_begun or (lambda: self.job.timeouts))

    def wait_until(self, condition):
        deadline = time.monotonic() + 10.0
        while not condition():
            self.assertLess(time.monotonic(), deadline, module("tasks").current.stage)
            time.sleep(0.01)

    def stop(self):
        """What the panel says afterwards."""
        self.assertEqual(bpy.ops.liquidblend.stop(), {'FINISHED'})
        self.wait_until(lambda: not module("tasks").is_running())
        return module("tasks").current.error

    def test_ends_an_upload_that_is_not_read(self):
        with mock.patch.object(FakeClient, "holds_up", self.released):
            self.start_import(lambda: module("tasks").current.stage == "upload")
            self.assertRegex(self.stop(), "^stopped; the upload may go on.* may import it")
        self.assertFalse(self.job.is_cancelled.is_set())
        self.released.set()
        self.assertTrue(self.job.is_cancelled.wait(10.0), "the import goes on after the upload")
        self.assertEqual(self.job.timeouts, [], "it is waited for")

    def test_ends_a_wait_for_a_job(self):
        self.start_registration()
        self.assertEqual(self.stop(), "stopped")
        self.assertTrue(self.job.is_cancelled.is_set())

    def test_tells_of_a_job_that_is_not_cancelled(self):
        self.job.holds_up_cancel = self.released
        with mock.patch.object(module("connection"), "_CANCEL_S", 0.1):
            self.start_registration()
            self.assertEqual(self.stop(), "stopped; operations/evil-1 may go on at the server")

    def test_tells_of_a_job_that_is_done_but_not_served(self):
        self.job.state.done = True
        self.start_registration()
        self.assertEqual(self.stop(), "stopped; operations/evil-1 is done at the server")
        self.assertFalse(self.job.is_cancelled.is_set())

    def test_leaves_a_place_for_the_next_task(self):
        for _ in range(2):
            self.job.timeouts.clear()
            self.start_registration()
            self.assertEqual(self.stop(), "stopped")
        self.released.set()
        self.start_registration(lambda: not module("tasks").is_running())
        self.assertEqual(module("tasks").current.result, "family drops, version 1: good")

    def test_ends_a_job_whose_server_says_at_once_that_its_time_is_up(self):
        timeouts, begin = self.job.timeouts, time.monotonic()

        def wait(_progress=None, timeout=None):
            timeouts.append(timeout)
            raise error_of("DeadlineExceeded", "at once")

        self.job.wait = wait
        with mock.patch.object(module("connection"), "_LOOK_S", 0.05):
            self.start_registration(lambda: len(timeouts) > 2)
            self.assertEqual(self.stop(), "stopped")
            most = 2.0 + (time.monotonic() - begin) / 0.05
        self.assertTrue(self.job.is_cancelled.is_set())
        self.assertLessEqual(len(timeouts), most, "it asks without a pause")

    def test_is_not_needed_while_servers_load_a_version(self):
        """The job is done, and they may take longer for it than from one look to the next."""
        timeouts = self.job.timeouts

        def wait(_progress=None, timeout=None):
            timeouts.append(timeout)
            self.job.state.done = True
            if len(timeouts) == 1:
                raise error_of("DeadlineExceeded", "not served yet")
            return self.job.state

        self.job.wait = wait
        self.start_registration(lambda: not module("tasks").is_running())
        self.assertEqual(module("tasks").current.result, "family drops, version 1: good")
        self.assertEqual(len(timeouts), 2)
        self.assertGreaterEqual(timeouts[1], 30.0)


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
