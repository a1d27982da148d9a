"""Tests of the add-on, run in Blender by run.sh, and of the modules named at the end."""

import json
import os
import shutil
import sys
import time
import types
import unittest
from unittest import mock

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from in_blender import (add_camera, add_liquid, arrays_of, attribute_of, empty_scene,  # noqa: E402
                        module, package, render_picture, set_up_cycles)
from liquid_testing import (ARGUMENTS, FPS, LiquidTest, add_two_drops, client,  # noqa: E402
                            expected, in_folder, run, state_of)


def edge_uses(triangles):
    """How often each undirected edge is used, and whether directions cancel out."""
    forth = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    sign = np.where(forth[:, 0] < forth[:, 1], 1, -1)
    _, at = np.unique(np.sort(forth, axis=1), axis=0, return_inverse=True)
    return np.bincount(at), np.bincount(at, weights=sign)


def volume_of(positions, triangles):
    a, b, c = (positions[triangles[:, i]].astype(float) for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


class Registration(LiquidTest):
    def test_unregisters_and_registers_again(self):
        for _ in range(2):
            self.assertTrue(hasattr(bpy.types.Object, "liquidblend"))
            bpy.ops.preferences.addon_disable(module="liquidblend_blender")
            self.assertFalse(hasattr(bpy.types.Object, "liquidblend"))
            for handlers in (bpy.app.handlers.frame_change_post, bpy.app.handlers.load_post,
                             bpy.app.handlers.depsgraph_update_post):
                self.assertEqual([h for h in handlers if "liquidblend" in h.__module__], [])
            self.assertNotIn("add", dir(bpy.ops.liquidblend))
            bpy.ops.preferences.addon_enable(module="liquidblend_blender")

    def test_the_zip_has_the_package(self):
        self.assertIn("vendor", package().__file__)


class Frames(LiquidTest):
    def test_are_those_of_the_server(self):
        object = add_two_drops()
        for frame in (1, 12, 23):
            self.scene.frame_set(frame)
            self.assert_shows(object, expected(frame))
            self.assertFalse(object.data.validate(), "validate() had to repair the mesh")

    def test_between_whole_frames(self):
        object = add_two_drops()
        shown = []
        for subframe in (0.0, 0.5):
            self.scene.frame_set(20, subframe=subframe)
            self.assert_shows(object, expected(20 + subframe))
            shown.append(arrays_of(object.data)[0].tobytes())
        self.assertNotEqual(*shown)

    def test_stand_still_before_and_after(self):
        object = add_two_drops()
        last = client().family("two_drops").duration
        self.scene.frame_set(-5)
        self.assert_shows(object, expected(1))
        self.assertEqual(np.abs(attribute_of(object.data, "velocity", 3, "vector")).max(), 0.0)
        self.scene.frame_set(1000)
        self.assert_shows(object, client().frame("two_drops", 0.0, last))

    def test_follow_start_offset_speed_and_frame_rate(self):
        object = add_two_drops()
        settings = object.liquidblend
        settings.start_frame, settings.offset_s, settings.speed = 11.0, 0.25, -0.5
        self.scene.render.fps, self.scene.render.fps_base = 30, 1.001
        self.scene.frame_set(16)
        time_s = 0.25 - 0.5 * 5.0 * 1.001 / 30.0
        frame = client().frame("two_drops", 0.0, settings_time(object, 16), velocities=True)
        self.assertAlmostEqual(frame.time, time_s, places=5)
        self.assert_shows(object, frame)
        shown = attribute_of(object.data, "velocity", 3, "vector")
        np.testing.assert_array_equal(shown, frame.velocities * np.float32(-0.5))

    def test_have_the_surface_that_was_asked_for(self):
        object = add_two_drops()
        settings = object.liquidblend
        settings.level_of_detail, settings.rest_positions = 1, True
        settings.smoothing_passes, settings.shading = 3, 'NORMALS'
        self.scene.frame_set(20)
        frame = expected(20, level_of_detail=1, smoothing_passes=3, normals=True,
                         velocities=True, rest_positions=True)
        self.assert_shows(object, frame)
        rest = attribute_of(object.data, "rest_position", 3, "vector")
        np.testing.assert_array_equal(rest, frame.rest_positions[:, :3])
        times = attribute_of(object.data, "rest_time", 1, "value")
        np.testing.assert_array_equal(times[:, 0], frame.rest_positions[:, 3])
        self.assert_normals(object.data, frame.normals)

    def assert_normals(self, mesh, normals):
        if hasattr(mesh, "calc_normals_split"):
            mesh.calc_normals_split()
        shown = np.empty((len(mesh.loops), 3), np.float32)
        mesh.loops.foreach_get("normal", shown.ravel())
        corners = arrays_of(mesh)[1].ravel()
        # Blender keeps them as angles of 16 bits.
        self.assertLess(np.abs(shown - normals[corners]).max(), 1e-3)

    def test_turn_up_to_z(self):
        object = add_two_drops()
        self.scene.frame_set(20)
        before, triangles = arrays_of(object.data)
        object.liquidblend.up = 'y'
        after, _ = arrays_of(object.data)
        np.testing.assert_array_equal(after, before[:, [0, 2, 1]] * np.float32([1, -1, 1]))
        self.assertAlmostEqual(volume_of(after, triangles), volume_of(before, triangles), places=3)

    def test_are_closed_with_edges_of_their_own(self):
        object = add_two_drops()
        self.scene.frame_set(20)
        uses, sums = edge_uses(arrays_of(object.data)[1])
        self.assertEqual((uses.min(), uses.max(), np.abs(sums).max()), (2, 2, 0))
        self.assertEqual(len(object.data.edges), len(uses))

    def test_of_a_file_are_those_of_the_server(self):
        object = add_liquid(kind='FILE', filepath=ARGUMENTS.file)
        key = object.liquidblend.controls[0].key
        for frame, weight in ((1.0, 0.0), (20.5, 0.5)):
            object[key] = weight
            self.scene.frame_set(int(frame), subframe=frame % 1)
            self.assert_shows(object, expected(frame, weight))


def settings_time(object, frame):
    return module("ask").time_mapping(object.liquidblend, bpy.context.scene).time_of(frame)


class Surfaces(unittest.TestCase):
    TETRAHEDRON = np.uint32([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    CORNERS = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])

    def write(self, triangles, positions=CORNERS):
        mesh = bpy.data.meshes.new("test")
        self.addCleanup(bpy.data.meshes.remove, mesh)
        made = module("surface").make_surface({"positions": positions, "triangles": triangles})
        module("surface").write_mesh(mesh, made)
        self.assertFalse(mesh.validate(), "validate() had to repair the mesh")
        return made, mesh

    def test_have_the_edges_that_blender_finds(self):
        made, mesh = self.write(self.TETRAHEDRON)
        self.assertIsNotNone(made.edges)
        ours = {tuple(sorted(edge.vertices)) for edge in mesh.edges}
        corners = [tuple(sorted(mesh.edges[loop.edge_index].vertices)) for loop in mesh.loops]
        mesh.update(calc_edges=True)
        self.assertEqual(ours, {tuple(sorted(edge.vertices)) for edge in mesh.edges})
        triangles = [tuple(t) for t in self.TETRAHEDRON]
        wanted = [tuple(sorted((t[i], t[(i + 1) % 3]))) for t in triangles for i in range(3)]
        self.assertEqual(corners, wanted)

    def test_that_are_open_or_touch_themselves_leave_edges_to_blender(self):
        made, mesh = self.write(self.TETRAHEDRON[:3])
        self.assertIsNone(made.edges)
        self.assertEqual(len(mesh.edges), 6)
        # Two tetrahedra with an edge in common, which has four triangles.
        positions = np.concatenate([self.CORNERS, np.float32([[0, -1, 0], [0, 0, -1]])])
        other = np.uint32([0, 1, 4, 5])[self.TETRAHEDRON][:, ::-1]
        made, mesh = self.write(np.concatenate([self.TETRAHEDRON, other]), positions)
        self.assertIsNone(made.edges)
        self.assertEqual(len(mesh.edges), 11)

    def test_may_be_empty(self):
        _, mesh = self.write(np.zeros((0, 3), np.uint32), np.zeros((0, 3), np.float32))
        self.assertEqual(len(mesh.vertices), 0)

    def test_are_sorted_alike_where_numbers_do_not_fit(self):
        keys = np.random.default_rng(1).permutation(1000)
        order_of = module("surface")._order_of
        for packed, plain in zip(order_of(keys, 1000), order_of(keys, 1 << 60)):
            np.testing.assert_array_equal(packed, plain)

    def test_turn_each_axis_to_z(self):
        mapping = module("mapping")
        for up in mapping.UPS:
            turn = mapping.rotation_of(up)
            axis = np.zeros(3)
            axis["xyz".index(up[-1])] = -1 if up[0] == "-" else 1
            np.testing.assert_array_equal(turn @ axis, [0, 0, 1])
            self.assertAlmostEqual(float(np.linalg.det(turn)), 1.0)
            back = mapping.to_family_axes(turn @ np.array([1.0, 2.0, 3.0]), up)
            self.assertEqual(back, (1.0, 2.0, 3.0))

    def test_are_kept_within_a_limit(self):
        surface = module("surface")
        made = surface.make_surface({"positions": self.CORNERS, "triangles": self.TETRAHEDRON})
        cache = module("cache").SurfaceCache(lambda request, is_awaited: made,
                                             max_bytes=3 * made.num_bytes)
        try:
            for request in range(5):
                cache.get(request)
            self.assertEqual([cache.peek(r) is not None for r in range(5)],
                             [False, False, True, True, True])
        finally:
            cache.close()


class Weights(LiquidTest):
    def test_have_names_and_ranges(self):
        object = add_two_drops()
        key = object.liquidblend.controls[0].key
        self.assertEqual(key, "drops_b")
        ranges = object.id_properties_ui(key).as_dict()
        self.assertEqual([ranges[n] for n in ("min", "max", "soft_min", "soft_max")],
                         [-1.0, 2.0, 0.0, 1.0])

    def test_follow_keys(self):
        object = add_two_drops()
        for frame, weight in ((1, 0.0), (31, 1.0)):
            object["drops_b"] = weight
            object.keyframe_insert('["drops_b"]', frame=frame)
        for curve in object.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = 'LINEAR'
        self.scene.frame_set(16)
        self.assert_shows(object, expected(16, 0.5))
        self.scene.frame_set(11, subframe=0.5)
        weight = object.animation_data.action.fcurves[0].evaluate(11.5)
        self.assert_shows(object, expected(11.5, weight))

    def test_follow_drivers(self):
        object = add_two_drops()
        driver = object.driver_add('["drops_b"]').driver
        driver.expression = "frame / 40"
        self.scene.frame_set(10)
        self.assert_shows(object, expected(10, 0.25))

    def test_follow_a_change_without_one_of_the_frame(self):
        object = add_two_drops()
        self.scene.frame_set(20)
        object["drops_b"] = 0.75
        object.update_tag()
        bpy.context.view_layer.update()
        self.assert_shows(object, expected(20, 0.75))

    def test_stay_when_the_family_is_asked_again(self):
        object = add_two_drops()
        object["drops_b"] = 0.5
        bpy.ops.liquidblend.connect()
        self.assertEqual(object["drops_b"], 0.5)
        self.assert_shows(object, expected(1, 0.5))


class Files(LiquidTest):
    def test_saved_and_loaded_it_plays_on(self):
        object = add_two_drops()
        object["drops_b"] = 0.5
        path = in_folder("saved.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        empty_scene()
        bpy.ops.wm.open_mainfile(filepath=path)
        object = bpy.context.scene.objects["Liquid"]
        self.assert_shows(object, expected(1, 0.5))
        bpy.context.scene.frame_set(22)
        self.assert_shows(object, expected(22, 0.5))

    def test_for_the_run_without_a_server(self):
        add_two_drops()
        set_up_cycles(self.scene)
        add_camera(self.scene, (0, 0, 12))
        bpy.ops.wm.save_as_mainfile(filepath=in_folder("no_server.blend"))


class Errors(LiquidTest):
    def test_of_a_family_that_is_not_there(self):
        with self.assertRaisesRegex(RuntimeError, "nothing_of_this_name"):
            add_liquid(kind='SERVER', server=ARGUMENTS.server, family="nothing_of_this_name")

    def test_leave_an_empty_mesh_where_the_exact_frame_is_wanted(self):
        object = add_two_drops()
        object.liquidblend.family = "nothing_of_this_name"
        self.assertEqual(len(object.data.vertices), 0)
        self.assertIn("nothing_of_this_name", state_of(object).error)
        object.liquidblend.family = "two_drops"
        self.assert_shows(object, expected(1))
        self.assertEqual(state_of(object).error, "")

    def test_say_which_families_there_are(self):
        liquid = add_two_drops()
        liquid.liquidblend.family = ""
        with self.assertRaisesRegex(RuntimeError, "choose a family: .*two_drops"):
            bpy.ops.liquidblend.connect()

    def test_of_a_server_that_is_not_there(self):
        with self.assertRaisesRegex(RuntimeError, "UNAVAILABLE"):
            add_liquid(kind='SERVER', server="127.0.0.1:1", family="two_drops")

    def test_of_a_file_that_is_not_there(self):
        with self.assertRaisesRegex(RuntimeError, "/no/family"):
            add_liquid(kind='FILE', filepath="/no/family")


class Viewport(LiquidTest):
    """The window's way: update_scene() that waits for nothing, and a timer."""

    def setUp(self):
        super().setUp()
        self.object = add_two_drops()
        self.addCleanup(module("handlers").register)
        for handlers in (bpy.app.handlers.frame_change_post,
                         bpy.app.handlers.depsgraph_update_post):
            for handler in [h for h in handlers if "liquidblend" in h.__module__]:
                handlers.remove(handler)

    def update(self):
        module("playback").update_scene(self.scene, bpy.context.evaluated_depsgraph_get(), False)

    def settle(self, object, is_done):
        playback = module("playback")
        deadline = time.monotonic() + 20.0
        while not is_done() and time.monotonic() < deadline:
            playback._tick()
            time.sleep(0.005)
        self.assertTrue(is_done(), state_of(object).error)

    def moved_without_waiting(self, object, frame):
        """Sets the frame as the window does."""
        self.scene.frame_set(frame)
        self.update()

    def test_keeps_the_mesh_until_the_next_is_there(self):
        object = self.object
        playback = module("playback")
        make, blocked = playback.cache()._make, [True]

        def wait(request, is_awaited):
            while blocked[0]:
                time.sleep(0.005)
            return make(request, is_awaited)

        playback.cache().clear()
        playback.cache()._make = wait
        try:
            self.moved_without_waiting(object, 21)
            self.assert_shows(object, expected(1))
            blocked[0] = False
            self.settle(object, lambda: not state_of(object).pending)
            self.assert_shows(object, expected(21))
        finally:
            blocked[0] = False
            playback.cache()._make = make

    def test_has_the_next_frames_already(self):
        object = self.object
        self.moved_without_waiting(object, 22)
        request = state_of(object).ahead[0]
        deadline = time.monotonic() + 20.0
        while module("playback").cache().peek(request) is None:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.005)
        self.moved_without_waiting(object, 23)
        self.assert_shows(object, expected(23))

    def test_keeps_the_mesh_and_tells_why_on_an_error(self):
        object = self.object
        with module("playback").held():
            object.liquidblend.server = "127.0.0.1:1"
        self.update()
        self.settle(object, lambda: state_of(object).error != "")
        self.assertIn("UNAVAILABLE", state_of(object).error)
        self.assert_shows(object, expected(1))
        state_of(object).pending.clear()


    def test_forgets_an_object_that_is_gone(self):
        with module("playback").held():
            self.object.liquidblend.server = "127.0.0.1:1"
        self.update()
        self.settle(self.object, lambda: state_of(self.object).error != "")
        name = self.object.name_full
        bpy.data.objects.remove(self.object)
        self.assertIsNone(module("playback")._tick())
        self.assertNotIn(name, module("playback")._states)

    def test_shows_others_while_a_server_is_gone(self):
        playback = module("playback")
        other = add_two_drops()
        with playback.held():
            self.object.liquidblend.server = "127.0.0.1:1"
        self.update()
        self.settle(self.object, lambda: state_of(self.object).error != "")
        playback._want_all()
        place = self.object.liquidblend.server
        self.assertNotIn(place, [r.origin.place for r in playback.cache()._wanted])
        self.moved_without_waiting(other, 20)
        self.settle(other, lambda: not state_of(other).pending)
        self.assert_shows(other, expected(20))
        state_of(self.object).pending.clear()


class NotWritten(LiquidTest):
    """Liquids whose mesh cannot be changed: a render must not go on with another one."""

    def test_lets_no_render_pass(self):
        liquid = add_liquid(kind='SERVER', server=ARGUMENTS.server)  # no family is chosen
        update = module("playback").update_scene
        render = types.SimpleNamespace(mode='RENDER')
        self.assertFalse(update(self.scene, render, True))
        self.assertEqual(state_of(liquid).error, "not connected yet")
        liquid.hide_render = True
        self.assertTrue(update(self.scene, render, True))
        liquid.hide_render = False
        add_camera(self.scene, (0, 0, 12))
        set_up_cycles(self.scene)
        bpy.ops.wm.save_as_mainfile(filepath=in_folder("not_connected.blend"))

    def test_two_of_one_mesh_are_told(self):
        first = add_two_drops()
        second = first.copy()
        self.scene.collection.objects.link(second)
        second["drops_b"] = 1.0
        self.scene.frame_set(20)
        self.assertIn(f"also that of {first.name}", state_of(second).error)
        self.assert_shows(first, expected(20))


class Waiting(LiquidTest):
    def test_goes_on_while_a_server_is_busy(self):
        connection = module("connection")
        make, calls = connection._frame_now, []

        def busy_once(request):
            calls.append(request)
            if len(calls) == 1:
                raise package().ResourceExhausted(package().Status.RESOURCE_EXHAUSTED, "busy")
            return make(request)

        connection._frame_now = busy_once
        try:
            object = add_two_drops()
            module("playback").cache().clear()
            calls.clear()
            self.scene.frame_set(20)
            self.assert_shows(object, expected(20))
            self.assertGreater(len(calls), 1)
        finally:
            connection._frame_now = make


class Renders(LiquidTest):
    def test_have_the_exact_frames(self):
        object = add_two_drops()
        set_up_cycles(self.scene)
        add_camera(self.scene, (0, 0, 12))
        self.scene.frame_start, self.scene.frame_end = 18, 22
        self.scene.render.filepath = in_folder("exact_####")
        shown = {}

        def remember(scene, _=None):
            shown[scene.frame_current] = [a.tobytes() for a in arrays_of(object.data)]

        for is_blurred in (False, True):
            shown.clear()
            self.scene.render.use_motion_blur = is_blurred
            bpy.app.handlers.render_post.append(remember)
            try:
                bpy.ops.render.render(animation=True)
            finally:
                bpy.app.handlers.render_post.remove(remember)
            self.assertEqual(sorted(shown), list(range(18, 23)))
            for frame, arrays in shown.items():
                wanted = expected(frame)
                self.assertEqual(arrays, [wanted.positions.tobytes(),
                                          wanted.triangles.tobytes()])

    def test_locks_the_window(self):
        add_two_drops()
        self.assertTrue(self.scene.render.use_lock_interface)


class Blur(LiquidTest):
    """A ball that moves along x: by its velocities, and as an object."""

    SPEED = 24.0  # metres a second, which is a metre a frame

    def bake_ball(self):
        mesh = bpy.data.meshes.new("ball")
        import bmesh
        built = bmesh.new()
        bmesh.ops.create_icosphere(built, subdivisions=3, radius=0.5)
        built.to_mesh(mesh)
        built.free()
        positions, triangles = arrays_of(mesh)
        velocities = np.tile(np.float32([self.SPEED, 0.0, 0.0]), (len(positions), 1))
        files, surface = module("bake_files"), module("surface")
        writer = files.BakeWriter(in_folder("ball"), 1, 1.0, FPS, {})
        for frame in range(3):
            writer.add(surface.make_surface({
                "positions": positions + np.float32([frame - 1.0, 0.0, 0.0]),
                "triangles": triangles, "velocities": velocities}))
        writer.finish()
        return mesh

    def emit(self, mesh):
        material = bpy.data.materials.new("light")
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        light, output = (nodes.new(n) for n in ("ShaderNodeEmission", "ShaderNodeOutputMaterial"))
        links.new(light.outputs[0], output.inputs[0])
        mesh.materials.append(material)

    def picture(self, is_blurred):
        self.scene.render.use_motion_blur = is_blurred
        self.scene.render.motion_blur_shutter = 1.0
        return render_picture(self.scene, in_folder("blur.png"))[..., 0]

    def test_follows_the_velocities(self):
        ball = self.bake_ball()
        set_up_cycles(self.scene, (64, 32), 64)
        self.scene.view_settings.view_transform = 'Raw'
        add_camera(self.scene, (0, 0, 5), orthographic=4.0)
        liquid = add_liquid(kind='BAKE', filepath=in_folder("ball"))
        self.emit(liquid.data)
        self.scene.frame_set(2)
        sharp, blurred = self.picture(False), self.picture(True)

        bpy.data.objects.remove(liquid)
        moved = bpy.data.objects.new("moved", ball)
        self.emit(ball)
        self.scene.collection.objects.link(moved)
        for frame in (1, 3):
            moved.location.x = frame - 2.0
            moved.keyframe_insert("location", frame=frame)
        for curve in moved.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = 'LINEAR'
        self.scene.frame_set(2)
        truth = self.picture(True)
        self.assertGreater(np.abs(sharp - truth).mean(), 0.02)
        self.assertLess(np.abs(blurred - truth).mean(), 0.002)

    def test_keeps_frames_between_baked_ones(self):
        self.bake_ball()
        liquid = add_liquid(kind='BAKE', filepath=in_folder("ball"))
        self.scene.frame_set(2, subframe=0.25)
        self.assertAlmostEqual(arrays_of(liquid.data)[0][:, 0].mean(), 0.25, places=5)


def add_domain(size, resolution):
    """A Mantaflow domain whose cache is that of two_drops."""
    bpy.ops.mesh.primitive_cube_add(size=1.0)
    domain = bpy.context.object
    domain.scale = size
    modifier = domain.modifiers.new("Fluid", 'FLUID')
    modifier.fluid_type = 'DOMAIN'
    settings = modifier.domain_settings
    settings.domain_type, settings.resolution_max = 'LIQUID', resolution
    settings.cache_type = 'ALL'  # Blender deletes files of a replay that it has not simulated
    return domain, settings


class Send(LiquidTest):
    def copy_cache(self, name, num_frames):
        folder = in_folder(os.path.join(name, "mesh"))
        os.makedirs(folder, exist_ok=True)
        for frame in range(20, 20 + num_frames):
            for file in (f"fluid_mesh_{frame:04d}.bobj.gz", f"lVelMesh_{frame:04d}.uni"):
                shutil.copy(os.path.join(ARGUMENTS.data, "A", file), folder)

    def test_meshes_take_their_velocities_into_the_world(self):
        bpy.ops.mesh.primitive_cube_add(size=2.0, location=(1.0, 2.0, 3.0),
                                        rotation=(0.0, 0.0, np.pi / 2.0))
        cube = bpy.context.object
        attribute = cube.data.attributes.new("flip_velocity", 'FLOAT_VECTOR', 'POINT')
        attribute.data.foreach_set("vector", np.tile(np.float32([1.0, 0.0, 0.5]), 8))
        bpy.context.view_layer.update()
        send = module("send")
        arrays = send.mesh_arrays(cube, bpy.context.evaluated_depsgraph_get())
        np.testing.assert_allclose(arrays[2], np.tile([0.0, 1.0, 0.5], (8, 1)), atol=1e-6)
        np.testing.assert_allclose(arrays[0].mean(0), [1.0, 2.0, 3.0], atol=1e-6)
        head, _, body = send.ply_of(*arrays).partition(b"end_header\n")
        self.assertIn(b"property float vz", head)
        np.testing.assert_array_equal(np.frombuffer(body, "<f4", 48).reshape(8, 6),
                                      np.hstack([arrays[0], arrays[2]]))

    def test_a_mantaflow_cache(self):
        with open(os.path.join(ARGUMENTS.data, "A", "meta.json"), encoding="utf-8") as file:
            meta = json.load(file)
        domain, settings = add_domain(meta["domain_size_m"], meta["resolution_max"])
        settings.cache_directory = in_folder("cache")
        self.copy_cache("cache", 4)  # setting the directory empties it
        sent = module("send").mantaflow_options(domain, settings, self.scene)
        units = meta["units"]
        self.assertAlmostEqual(sent["vertex_scale"], units["vertex_scale"], places=5)
        self.assertAlmostEqual(sent["velocity_scale"], units["velocity_scale_to_m_per_s"],
                               places=5)
        bpy.ops.liquidblend.send(animation="sent_cache", server=ARGUMENTS.server)
        animation = client().animation("sent_cache")
        self.assertEqual((animation["numFrames"], animation["framesPerSecond"],
                          animation["up"]), (4, 24, "UP_Z"))
        whole = client().animation("drops_a")["bounds"]
        for side in "xy":  # of the pool, in metres
            self.assertAlmostEqual(animation["bounds"]["max"][side], whole["max"][side], places=1)

    def test_needs_a_baked_mesh(self):
        domain, settings = add_domain((1, 1, 1), 16)
        settings.cache_directory = in_folder("no_cache")
        with self.assertRaisesRegex(RuntimeError, "no_cache.*Binary Object"):
            bpy.ops.liquidblend.send(animation="no_cache", server=ARGUMENTS.server)

    def test_needs_whole_velocities(self):
        domain, settings = add_domain((1, 1, 1), 16)
        settings.cache_directory = in_folder("half")
        self.copy_cache("half", 3)
        os.remove(in_folder("half/mesh/lVelMesh_0021.uni"))
        with self.assertRaisesRegex(RuntimeError, "lVelMesh_0021.uni"):
            bpy.ops.liquidblend.send(animation="half", server=ARGUMENTS.server)


class Correspondences(LiquidTest):
    def send_ball(self, name, x):
        """A ball that falls at x, unless it is there."""
        if name in client().animations():
            return
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.3, location=(x, 0, 1))
        ball = bpy.context.object
        for frame, z in ((1, 1.0), (6, 0.5)):
            ball.location.z = z
            ball.keyframe_insert("location", frame=frame)
        self.scene.frame_start, self.scene.frame_end = 1, 6
        bpy.ops.liquidblend.send(animation=name, server=ARGUMENTS.server)
        bpy.data.objects.remove(ball)

    def add_empty(self, name, location):
        empty = bpy.data.objects.new(name, None)
        self.scene.collection.objects.link(empty)
        empty.location = location
        return empty

    def add_pair(self, liquid):
        for other in self.scene.objects:
            other.select_set(False)
        empties = [self.add_empty("a", (0.0, 0.0, 1.3)), self.add_empty("b", (0.4, 0.0, 1.3))]
        bpy.context.view_layer.update()
        for empty in empties:
            empty.select_set(True)
        bpy.context.view_layer.objects.active = liquid
        bpy.ops.liquidblend.pair_add()
        pair = liquid.liquidblend.pairs[0]
        pair.source, pair.target = empties
        return pair

    def test_of_empties_are_registered(self):
        self.send_ball("ball_a", 0.0)
        self.send_ball("ball_b", 0.4)
        liquid = add_two_drops()
        self.scene.frame_set(1)
        self.add_pair(liquid).hard = True
        settings = liquid.liquidblend
        settings.new_family, settings.source_animation = "balls", "ball_a"
        settings.target_animations = "ball_b"
        bpy.ops.liquidblend.register(mode='NEW')
        found = json.dumps(client().family("balls").raw)
        self.assertIn('"hard": true', found)
        family = client().family("balls")
        self.assertEqual((family.source, family.targets), ("ball_a", ("ball_b",)))
        middle = client().frame("balls", 0.5, 0.0).positions
        self.assertAlmostEqual(float(middle[:, 0].mean()), 0.2, places=1)
        self.refine(liquid)

    def refine(self, liquid):
        """Without the names of animations, with the pair as a soft one."""
        settings = liquid.liquidblend
        settings.source_animation = settings.target_animations = ""
        settings.pairs[0].hard = False
        bpy.ops.liquidblend.register(mode='REFINE')
        family = client().family("balls")
        self.assertEqual(family.version, 2)
        self.assertNotIn('"hard": true', json.dumps(family.raw))

    def test_are_not_all_that_a_family_has(self):
        """Parameters take the place of weights."""
        self.send_ball("ball_a", 0.0)
        self.send_ball("ball_b", 0.4)
        client().register("space", "ball_a", "ball_b", parameters={"place": [2.0, 6.0]},
                         options={"max_iterations": 1}).wait()
        object = add_liquid(kind='SERVER', server=ARGUMENTS.server, family="space")
        self.assertEqual([c.name for c in object.liquidblend.controls], ["place"])
        ranges = object.id_properties_ui("place").as_dict()
        self.assertEqual((object["place"], ranges["min"], ranges["max"]), (2.0, 2.0, 6.0))
        object["place"] = 5.0
        self.scene.frame_set(3)
        self.assert_shows(object, client().frame("space", None, 2.0 / FPS,
                                                parameters={"place": 5.0}))

    def test_are_in_the_familys_axes_and_times(self):
        liquid = add_two_drops()
        liquid.location = (1.0, 2.0, 3.0)
        liquid.liquidblend.up = 'y'
        liquid.liquidblend.speed = 2.0
        pair = self.add_pair(liquid)
        bpy.context.view_layer.update()
        pair.source_frame, pair.target_frame = 13.0, 1.0
        found = module("correspond").correspondences_of(liquid, self.scene)[0]
        self.assertEqual(found["source_time_s"], 1.0)
        np.testing.assert_allclose(found["source_position"], (-1.0, -1.7, 2.0), atol=1e-6)

    def test_find_authorities_beside_the_file(self):
        """As Blender's file browser names them; likewise for the other buttons."""
        bpy.ops.wm.save_as_mainfile(filepath=in_folder("authorities.blend"))
        liquid = add_liquid(kind='SERVER', server=ARGUMENTS.server)
        settings = liquid.liquidblend
        settings.tls, settings.tls_ca, settings.new_family = True, "//ca.pem", "balls"
        connection, origins = module("connection"), []
        with mock.patch.object(connection, "register", lambda origin, *_: origins.append(origin)):
            bpy.ops.liquidblend.register(mode='REFINE')
        send = mock.patch.object(connection, "import_animation",
                                 lambda origin, *_: origins.append(origin))
        bpy.ops.mesh.primitive_cube_add()
        with send:
            bpy.ops.liquidblend.send(animation="cube", server=ARGUMENTS.server, tls=True,
                                     tls_ca="//ca.pem")
        origins.append(module("ask").origin_of(settings))
        self.assertEqual([(origin.place, origin.tls, origin.tls_ca) for origin in origins],
                         3 * [(ARGUMENTS.server, True, in_folder("ca.pem"))])

    def test_without_an_empty_are_named(self):
        liquid = add_two_drops()
        self.add_pair(liquid).target = None
        with self.assertRaisesRegex(RuntimeError, "the target of pair 0 has no empty"):
            bpy.ops.liquidblend.register(mode='REFINE')


if __name__ == "__main__":
    run("__main__", "bake_test", "token_test", "hostile_test")
