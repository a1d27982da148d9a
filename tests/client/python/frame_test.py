"""Frames: the command line's, without copies, for as long as anything refers to them."""

import gc
import unittest

import numpy as np

import liquidblend
from liquidblend import _native
from service import canonical, read_ply, service

ALL = {"normals": True, "velocities": True, "rest_positions": True}


def command_line(name, *flags):
    path = service().folder / f"{name}.ply"
    service().run("frame", "two_drops", "-w", 0.5, "-t", 0.8, "-o", path, *flags)
    return path


class FrameTest(unittest.TestCase):
    def setUp(self):
        self.client = service().client

    def test_is_the_command_lines_to_the_bit(self):
        for bits in (10, 14, 16):
            vertices, triangles = read_ply(command_line(f"bits_{bits}", "--bits", bits))
            positions = np.stack([vertices[name] for name in "xyz"], axis=1)
            frame = self.client.frame("two_drops", 0.5, 0.8, position_bits=bits)
            ours = canonical(frame.positions, frame.triangles)
            self.assertGreater(len(ours), 1000)
            np.testing.assert_array_equal(ours, canonical(positions, triangles), f"{bits} bits")

    def test_writes_the_command_lines_ply(self):
        # With so many bits both get Draco, and so the same order of vertices.
        flags = ["--bits", 20, "--normals", "--velocities", "--rest-positions", "--lod", 1]
        theirs = command_line("all", *flags).read_bytes()
        frame = self.client.frame("two_drops", 0.5, 0.8, position_bits=20, level_of_detail=1, **ALL)
        path = service().folder / "ours.ply"
        frame.write_ply(path)
        self.assertEqual(path.read_bytes(), theirs)

    def test_has_arrays_of_the_right_kind(self):
        frame = self.client.frame("two_drops", 0.5, 0.8, **ALL)
        n = len(frame.positions)
        self.assertGreater(n, 1000)
        for array, width in (
            (frame.positions, 3),
            (frame.normals, 3),
            (frame.velocities, 3),
            (frame.rest_positions, 4),
        ):
            self.assertEqual((array.shape, array.dtype), ((n, width), np.float32))
        self.assertEqual(frame.triangles.dtype, np.uint32)
        self.assertEqual(frame.triangles.max(), n - 1)
        np.testing.assert_allclose(np.linalg.norm(frame.normals, axis=1), 1, atol=0.02)
        self.assertEqual(frame.bounds[0], tuple(frame.positions.min(axis=0).tolist()))
        self.assertEqual(frame.bounds[1], tuple(frame.positions.max(axis=0).tolist()))
        self.assertEqual((frame.time, frame.weights, frame.version), (0.8, (0.5,), 1))
        self.assertEqual((frame.extrapolated, frame.clamped), (False, False))
        self.assertEqual(frame.velocity_scale, 1)

    def test_has_no_arrays_that_were_not_asked_for(self):
        frame = self.client.frame("two_drops", [0.5], 0.8)
        self.assertIsNone(frame.normals)
        self.assertIsNone(frame.velocities)
        self.assertIsNone(frame.rest_positions)

    def test_arrays_are_views_of_the_librarys_memory(self):
        frame = self.client.frame("two_drops", 0.5, 0.8, normals=True)
        info = _native.FrameInfo()
        _native.function("lb_frame_describe")(frame._handle.pointer, info)
        for array, address in (
            (frame.positions, info.positions),
            (frame.normals, info.normals),
            (frame.triangles, info.triangles),
        ):
            self.assertFalse(array.flags.owndata)
            self.assertFalse(array.flags.writeable)
            self.assertEqual(array.ctypes.data, address)
            self.assertTrue(np.shares_memory(array, array[1:]))
        with self.assertRaises(ValueError):
            frame.positions[0, 0] = 1
        copy = frame.positions.copy()
        copy[0, 0] = 1
        self.assertFalse(np.shares_memory(copy, frame.positions))

    def test_memory_stays_as_long_as_a_view(self):
        freed = []
        with liquidblend.connect(service().target) as client:
            frame = client.frame("two_drops", 0.5, 0.8)
            free = frame._handle._free
            frame._handle._free = lambda pointer: (freed.append(pointer), free(pointer))
            expected = frame.positions.copy()
            part = frame.positions[10:].reshape(-1)
            del frame
        del client
        gc.collect()
        # Other frames would take the memory if it were free.
        others = [service().client.frame("two_drops", 1, 0.8) for _ in range(4)]
        self.assertEqual(freed, [])
        np.testing.assert_array_equal(part, expected[10:].reshape(-1))
        del part
        gc.collect()
        self.assertEqual(len(freed), 1)
        self.assertEqual(len(others), 4)

    def test_is_freed_without_the_garbage_collector(self):
        freed = []
        gc.disable()
        try:
            frame = self.client.frame("two_drops", 0.5, 0.8)
            free = frame._handle._free
            frame._handle._free = lambda pointer: (freed.append(pointer), free(pointer))
            del frame
            self.assertEqual(len(freed), 1)
        finally:
            gc.enable()

    def test_smoothing_is_the_command_lines(self):
        flags = ["--smooth", 3, "--laplacian", "--smooth-strength", 0.25, "--smooth-time", 0.5]
        theirs = command_line("smooth", *flags, "--bits", 18).read_bytes()
        frame = self.client.frame(
            "two_drops",
            0.5,
            0.8,
            smoothing_passes=3,
            laplacian=True,
            smoothing_strength=0.25,
            temporal_smoothing=0.5,
            position_bits=18,
        )
        self.assertEqual(frame.to_ply(), theirs)

    def test_of_wrong_requests_the_server_says_what_is_wrong(self):
        for request, kind, named in (
            ({"weights": [0.5, 0.5]}, liquidblend.InvalidArgument, "weights"),
            ({"weights": 0.5, "time": 99}, liquidblend.OutOfRange, "time_s"),
            ({"weights": 0.5, "level_of_detail": 9}, liquidblend.InvalidArgument, "level"),
            ({"weights": 0.5, "version": 9}, liquidblend.NotFound, "version 9"),
            ({"parameters": {"height": 1}}, liquidblend.FailedPrecondition, "parameters"),
        ):
            with self.assertRaisesRegex(kind, named) as raised:
                self.client.frame("two_drops", **request)
            self.assertEqual(raised.exception.reason, raised.exception.code.name)
