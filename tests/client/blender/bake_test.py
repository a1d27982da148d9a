"""Tests of baked folders, run in Blender by addon_test.py."""

import os
import shutil

import bpy
import numpy as np
from in_blender import add_liquid, attribute_of, module
from liquid_testing import FPS, LiquidTest, add_two_drops, expected, in_folder, state_of


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

    def test_that_was_interrupted_is_replaced_and_not_played(self):
        folder = in_folder("interrupted")
        files = module("bake_files")
        writer = files.BakeWriter(folder, 1.0, 1.0, FPS, {})
        writer.add(module("surface").EMPTY)
        with self.assertRaisesRegex(files.BakeError, "no bake in"):
            files.read_index(folder)
        again = files.BakeWriter(folder, 1.0, 1.0, FPS, {})
        self.assertEqual(os.listdir(folder), ["index.json.part"])
        again.add(module("surface").EMPTY)
        again.finish()
        self.assertEqual(sorted(os.listdir(folder)), ["frame_000000.npz", "index.json"])

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
