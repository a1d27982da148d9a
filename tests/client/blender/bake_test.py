"""Tests of baked folders, run in Blender by addon_test.py."""

import os
import shutil
import unittest
from unittest import mock

import bpy
import numpy as np
from in_blender import add_liquid, attribute_of, module
from liquid_testing import FPS, LiquidTest, add_two_drops, expected, in_folder, state_of


def contents_of(folder):
    """The bytes of each file, by name."""
    contents = {}
    for name in os.listdir(folder):
        with open(os.path.join(folder, name), "rb") as file:
            contents[name] = file.read()
    return contents


class Bake(LiquidTest):
    def bake(self, **arguments):
        liquid = add_two_drops()
        liquid["drops_b"] = 0.25
        liquid.liquidblend.rest_positions = True
        liquid.liquidblend.bake = in_folder("bake")
        self.scene.frame_start, self.scene.frame_end = 19, 21
        bpy.ops.liquidblend.bake(**arguments)
        return liquid

    def test_plays_the_same_frames(self):
        liquid = self.bake(step=0.5)
        self.assertEqual(liquid.liquidblend.kind, 'BAKE')
        for frame in (19.0, 20.5, 21.0):
            self.scene.frame_set(int(frame), subframe=frame % 1)
            wanted = expected(frame, 0.25, velocities=True, rest_positions=True)
            self.assert_shows(liquid, wanted)
            shown = attribute_of(liquid.data, "velocity", 3, "vector")
            np.testing.assert_array_equal(shown, wanted.velocities)
        bpy.ops.wm.save_as_mainfile(filepath=in_folder("bake_alone.blend"))
        np.savez(in_folder("bake_alone.npz"), positions=wanted.positions)

    def test_does_not_replace_what_is_no_bake(self):
        os.makedirs(in_folder("others"), exist_ok=True)
        with open(in_folder("others/holiday.png"), "w", encoding="utf-8") as file:
            file.write("mine")
        liquid = add_two_drops()
        liquid.liquidblend.bake = in_folder("others")
        with self.assertRaisesRegex(RuntimeError, "holiday.png"):
            bpy.ops.liquidblend.bake()
        self.assertEqual(os.listdir(in_folder("others")), ["holiday.png"])

    def test_does_not_replace_arrays_of_others(self):
        os.makedirs(in_folder("measured"), exist_ok=True)
        for name in ("frame_experiment7.npz", "frame_000000.npz"):  # the second has a bake's name
            path = in_folder(os.path.join("measured", name))
            np.savez(path, mine=np.zeros(3))
            liquid = add_two_drops()
            liquid.liquidblend.bake = in_folder("measured")
            with self.assertRaisesRegex(RuntimeError, f"{name}, which is of no bake"):
                bpy.ops.liquidblend.bake()
            self.assertTrue(os.path.exists(path))
            os.remove(path)

    def test_beside_a_file_needs_one(self):
        add_two_drops().liquidblend.bake = "//bake"
        with self.assertRaisesRegex(RuntimeError, "save it first"):
            bpy.ops.liquidblend.bake()

    def test_blurs_as_much_at_another_frame_rate(self):
        liquid = self.bake()
        self.scene.frame_set(20)
        before = attribute_of(liquid.data, "velocity", 3, "vector")
        self.scene.render.fps = 48
        self.scene.frame_set(19)
        self.scene.frame_set(20)
        after = attribute_of(liquid.data, "velocity", 3, "vector")
        np.testing.assert_array_equal(after, 2.0 * before)

    def test_is_replaced_by_the_next(self):
        liquid = self.bake()
        self.scene.frame_set(20)
        liquid.liquidblend.kind = 'SERVER'
        liquid["drops_b"] = 1.0
        bpy.ops.liquidblend.bake()
        self.scene.frame_set(20)
        self.assert_shows(liquid, expected(20, 1.0))

    def test_tells_which_file_is_damaged(self):
        self.bake(switch=False)
        shutil.copytree(in_folder("bake"), in_folder("damaged"), dirs_exist_ok=True)
        path = in_folder("damaged/frame_000001.npz")
        with open(path, "r+b") as file:
            file.truncate(1000)
        liquid = add_liquid(kind='BAKE', filepath=in_folder("damaged"))
        self.scene.frame_set(20)
        self.assertIn(path, state_of(liquid).error)
        self.assertEqual(len(liquid.data.vertices), 0)

    def test_without_an_index_is_refused(self):
        os.makedirs(in_folder("no_index"), exist_ok=True)
        with self.assertRaisesRegex(RuntimeError, "no_index.*index.json"):
            add_liquid(kind='BAKE', filepath=in_folder("no_index"))

    def test_of_each_liquid_has_a_folder_of_its_own(self):
        bpy.ops.wm.save_as_mainfile(filepath=in_folder("two_liquids.blend"))
        liquids = [add_two_drops(), add_two_drops()]
        self.scene.frame_start, self.scene.frame_end = 19, 21
        for liquid, weight in zip(liquids, (0.25, 0.75)):
            liquid["drops_b"] = weight
            bpy.context.view_layer.objects.active = liquid
            bpy.ops.liquidblend.bake()
        self.scene.frame_set(20)
        self.assert_shows(liquids[0], expected(20, 0.25))
        self.assert_shows(liquids[1], expected(20, 0.75))
        self.assertEqual([liquid.liquidblend.bake for liquid in liquids],
                         ["//liquid_bake_Liquid", "//liquid_bake_Liquid_001"])

    def test_of_older_scenes_keeps_its_folder(self):
        """Their files do not say it, since it was the default."""
        liquid = add_two_drops()
        liquid.liquidblend.property_unset("bake")
        self.assertEqual(liquid.liquidblend.bake, "//liquid_bake")

    def test_of_another_object_is_not_replaced(self):
        first = self.bake()
        second = add_two_drops()
        second.liquidblend.bake = in_folder("bake")
        for kind in ('BAKE', 'SERVER'):  # it is played; it is not, and was baked
            first.liquidblend.kind = kind
            with self.assertRaisesRegex(RuntimeError, "choose another folder"):
                bpy.ops.liquidblend.bake()
        first.liquidblend.kind = 'BAKE'
        self.scene.frame_set(20)
        self.assert_shows(first, expected(20, 0.25))

    def test_that_another_object_plays_is_not_replaced(self):
        first = self.bake()
        second = add_liquid(kind='BAKE', filepath=in_folder("bake/../bake"))
        first.liquidblend.kind = 'SERVER'
        bpy.context.view_layer.objects.active = first
        with self.assertRaisesRegex(RuntimeError, f"{second.name} plays .*bake"):
            bpy.ops.liquidblend.bake()
        bpy.data.objects.remove(second)
        bpy.ops.liquidblend.bake()

    def test_of_an_object_that_was_renamed_says_how_to_go_on(self):
        liquid = self.bake(switch=False)
        liquid.name = "Waves"
        with self.assertRaisesRegex(RuntimeError, "renamed.* delete the folder"):
            bpy.ops.liquidblend.bake()
        shutil.rmtree(in_folder("bake"))
        bpy.ops.liquidblend.bake()
        shutil.rmtree(in_folder("bake"))  # which other tests use, with another object

    def test_that_fails_leaves_the_earlier_one(self):
        liquid = self.bake(switch=False)
        before = contents_of(in_folder("bake"))
        with module("playback").held():
            liquid.liquidblend.server = "127.0.0.1:1"
        with mock.patch.dict(module("preferences")._values, patience_s=0.0):
            with self.assertRaisesRegex(RuntimeError, "UNAVAILABLE"):
                bpy.ops.liquidblend.bake()
        self.assertEqual(contents_of(in_folder("bake")), before)


class Writing(unittest.TestCase):
    """Of folders, without a liquid."""

    def setUp(self):
        self.files = module("bake_files")
        self.folder = os.path.join(in_folder("writing"), self.id())

    def writer(self, **about):
        return self.files.BakeWriter(self.folder, 1.0, 1.0, FPS, about)

    def write(self, place, num_frames, is_finished=True):
        """A bake of surfaces whose one point is at x = place."""
        writer, positions = self.writer(), np.float32([[place, 0.0, 0.0]])
        for _ in range(num_frames):
            writer.add(module("surface").make_surface(
                {"positions": positions, "triangles": np.zeros((0, 3), np.uint32)}))
        if is_finished:
            writer.finish()
        return writer

    def places(self):
        index = self.files.read_index(self.folder)
        return [float(self.files.read_frame(self.folder, index, 1.0 + i)["positions"][0, 0])
                for i in range(index["frames"])]

    def names(self):
        return sorted(os.listdir(self.folder))

    def test_that_was_interrupted_is_replaced_and_not_played(self):
        self.write(1.0, 2, is_finished=False)
        with self.assertRaisesRegex(self.files.BakeError, "no bake in"):
            self.files.read_index(self.folder)
        self.writer()
        self.assertEqual(self.names(), ["index.json.part"])
        self.write(2.0, 1)
        self.assertEqual(self.names(), ["frame_000000.npz", "index.json"])

    def test_that_was_interrupted_leaves_the_earlier_one(self):
        self.write(1.0, 3)
        self.write(2.0, 2, is_finished=False)
        self.assertEqual(self.places(), [1.0, 1.0, 1.0])
        self.write(3.0, 2)
        self.assertEqual(self.places(), [3.0, 3.0])
        self.assertEqual(self.names(), ["frame_000000.npz", "frame_000001.npz", "index.json"])

    def test_that_is_given_up_leaves_the_earlier_one_and_nothing_else(self):
        self.write(1.0, 2)
        before = contents_of(self.folder)
        self.write(2.0, 3, is_finished=False).close()
        self.assertEqual(contents_of(self.folder), before)

    def test_that_is_interrupted_at_its_end_is_not_played(self):
        self.write(1.0, 2)
        rename, calls = os.replace, []

        def fail_at_second(source, target):
            calls.append(target)
            if len(calls) == 2:
                raise OSError(5, "Input/output error")
            rename(source, target)

        writer = self.write(2.0, 2, is_finished=False)
        with mock.patch.object(os, "replace", fail_at_second):
            with self.assertRaisesRegex(self.files.BakeError, "Input/output error"):
                writer.finish()
        writer.close()
        with self.assertRaisesRegex(self.files.BakeError, "no bake in"):
            self.files.read_index(self.folder)
        self.write(3.0, 1)
        self.assertEqual(self.places(), [3.0])

    def test_ends_when_another_one_begins(self):
        first = self.write(1.0, 1, is_finished=False)
        second = self.write(2.0, 1, is_finished=False)
        for go_on in (lambda: first.add(module("surface").EMPTY), first.finish):
            with self.assertRaisesRegex(self.files.BakeError, "another bake into"):
                go_on()
        first.close()
        second.finish()
        self.assertEqual(self.places(), [2.0])

    def test_leaves_files_of_others_that_come_meanwhile(self):
        writer = self.write(1.0, 1, is_finished=False)
        for name in ("notes.txt", "notes.part"):
            with open(os.path.join(self.folder, name), "w", encoding="utf-8"):
                pass
        writer.finish()
        self.assertEqual(self.names(), ["frame_000000.npz", "index.json", "notes.part",
                                        "notes.txt"])
