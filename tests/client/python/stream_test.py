"""Streams as iterators."""

import gc
import threading
import unittest

import numpy as np

import liquidblend
from service import NUM_FRAMES, service


class StreamTest(unittest.TestCase):
    def setUp(self):
        self.client = service().client

    def test_has_every_frame_and_ends(self):
        stream = self.client.stream("two_drops", 0.5, normals=True)
        frames = list(stream)
        self.assertEqual(len(frames), NUM_FRAMES)
        np.testing.assert_allclose([frame.time for frame in frames], np.arange(NUM_FRAMES) / 24)
        single = self.client.frame("two_drops", 0.5, frames[20].time, normals=True)
        np.testing.assert_array_equal(frames[20].positions, single.positions)
        np.testing.assert_array_equal(frames[20].normals, single.normals)
        np.testing.assert_array_equal(frames[20].triangles, single.triangles)
        self.assertTrue(stream.closed)
        self.assertEqual(list(stream), [], "still at its end")

    def test_goes_at_the_rate_that_is_asked_for(self):
        backwards = [
            frame.time
            for frame in self.client.stream(
                "two_drops", 1, time=0.75, rate=-2, frames_per_second=8
            )
        ]
        self.assertEqual(backwards, [0.75, 0.5, 0.25, 0])
        with self.assertRaisesRegex(liquidblend.InvalidArgument, "rate is 0"):
            self.client.stream("two_drops", 0, rate=0)

    def test_loops_until_it_is_left(self):
        times = []
        for frame in self.client.stream("two_drops", 0, loop=True, frames_per_second=4):
            times.append(frame.time)
            if len(times) == 12:
                break
        self.assertEqual(times[:3], [0, 0.25, 0.5])
        num_rounds = 1 + sum(later < earlier for earlier, later in zip(times, times[1:]))
        self.assertEqual(num_rounds, 3, times)

    def test_a_live_one_follows_the_clock(self):
        stream = self.client.stream(
            "two_drops", 0.5, live=True, rate=4, frames_per_second=60, adapts_detail=True
        )
        times = [frame.time for frame in stream]
        self.assertEqual(times, sorted(times))
        duration, step = (NUM_FRAMES - 1) / 24, 4 / 60
        self.assertTrue(duration - step < times[-1] <= duration, "the end is always shown")

    def test_is_closed_when_nothing_refers_to_it(self):
        freed = []
        stream = self.client.stream("two_drops", 0, loop=True)
        free = stream._handle._free
        stream._handle._free = lambda pointer: (freed.append(pointer), free(pointer))
        frame = next(stream)
        del stream
        gc.collect()
        self.assertEqual(len(freed), 1)
        self.assertGreater(frame.positions.sum(), -np.inf, "its frames stay")

    def test_ends_with_its_block(self):
        with self.client.stream("two_drops", 0, loop=True) as stream:
            next(stream)
        self.assertEqual(list(stream), [])
        stream.close()

    def test_another_thread_ends_a_read_that_waits(self):
        # The next frame is due in a quarter of an hour.
        stream = self.client.stream("two_drops", 0, live=True, frames_per_second=0.001)
        self.assertEqual(next(stream).time, 0)
        rest = []
        reader = threading.Thread(target=lambda: rest.extend(stream))
        reader.start()
        closer = threading.Timer(0.2, stream.close)
        closer.start()
        reader.join(30)
        self.assertFalse(reader.is_alive())
        self.assertEqual(rest, [])

    def test_errors_come_with_the_first_frame(self):
        stream = self.client.stream("none", 0.5)
        with self.assertRaises(liquidblend.NotFound) as raised:
            next(stream)
        self.assertEqual(raised.exception.reason, "NOT_FOUND")
        self.assertTrue(stream.closed)
        with self.assertRaisesRegex(liquidblend.OutOfRange, "time_s"):
            list(self.client.stream("two_drops", 0, time=99))
        with self.assertRaisesRegex(liquidblend.InvalidArgument, "needs as many weights"):
            list(self.client.stream("two_drops"))
