"""Players: of a file without a server, and of a server."""

import functools
import gc
import time
import unittest
import unittest.mock

import numpy as np

import liquidblend
from liquidblend import _native
from service import NUM_FRAMES, canonical, service

PATIENCE = 30


@functools.lru_cache(maxsize=None)
def family_file():
    path = service().folder / "two_drops.lbf"
    service().client.download("two_drops", path)
    return path


def open_file(**options):
    return liquidblend.Player.open(file=family_file(), **options)


def polled(player, is_wanted):
    """Polls by the real clock until there is a frame that is wanted."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        frame = player.poll()
        if frame is not None and is_wanted(frame):
            return frame
        time.sleep(0.005)
    raise AssertionError(f"no such frame; the last is {frame!r}")


def replaced(name, function):
    """Functions of the library, but for one."""
    return lambda wanted: function if wanted == name else getattr(_native.library(), wanted)


class PlayerTest(unittest.TestCase):
    def test_of_a_file_makes_the_servers_frames(self):
        surface = liquidblend.SurfaceOptions(normals=True, velocities=True, rest_positions=True)
        with open_file(surface=surface) as player:
            player.set_weights(0.75)
            ours = player.wait_exact(0.8)
        theirs = service().client.frame(
            "two_drops", 0.75, 0.8, normals=True, velocities=True, rest_positions=True
        )
        np.testing.assert_array_equal(
            canonical(ours.positions, ours.triangles),
            canonical(theirs.positions, theirs.triangles),
        )
        self.assertEqual(ours.to_ply(), theirs.to_ply())
        self.assertEqual((ours.time, ours.weights), (0.8, (0.75,)))

    def test_of_a_server_waits_for_the_exact_frame(self):
        connection = liquidblend.Connection(service().target)
        with liquidblend.Player.open(family="two_drops", connection=connection) as player:
            player.set_weights([0.25])
            frame = player.wait_exact(0.333)
        self.assertEqual((frame.time, frame.weights, frame.version), (0.333, (0.25,), 1))
        single = service().client.frame("two_drops", 0.25, 0.333)
        np.testing.assert_array_equal(frame.positions, single.positions)
        with self.assertRaisesRegex(ValueError, "closed"):
            player.poll()

    def test_describes_its_family(self):
        with open_file() as player:
            family = player.family
        self.assertEqual((family.name, family.targets), ("two_drops", ("drops_b",)))
        self.assertAlmostEqual(family.duration, (NUM_FRAMES - 1) / 24)
        self.assertEqual(family.raw, {})
        theirs = service().client.family("two_drops")
        self.assertEqual((family.name, family.targets), (theirs.name, theirs.targets))
        connection = liquidblend.Connection(service().target)
        with liquidblend.Player.open(family="two_drops", connection=connection) as player:
            of_server = player.family
        self.assertEqual((of_server.name, of_server.targets), (theirs.name, theirs.targets))

    def test_plays_and_pauses(self):
        with open_file(surface=liquidblend.SurfaceOptions(velocities=True)) as player:
            player.set_loop(True)
            player.set_rate(0.5)
            player.play()
            frame = polled(player, lambda frame: frame.time > 0.05)
            self.assertEqual(frame.velocity_scale, 0.5)
            player.pause()
            # The exact frame of the moment may come later; then it is the same object each time.
            paused = polled(player, lambda f: f.velocity_scale == 0 and player.poll() is f)
            player.seek(0.9)
            self.assertAlmostEqual(polled(player, lambda frame: frame.time > 0.89).time, 0.9)
            player.set_weights(1.0, over=0.1)
            polled(player, lambda frame: frame.weights == (1,))
            statistics = player.statistics()
        self.assertGreater(statistics.num_shown, 0)
        self.assertGreater(statistics.num_received, 0)
        self.assertEqual(statistics.status, liquidblend.Status.OK)
        self.assertGreater(len(paused.positions), 1000, "frames outlive their player")

    def test_refuses_what_is_wrong(self):
        with open_file() as player:
            with self.assertRaisesRegex(liquidblend.InvalidArgument, "2 weights for 1 targets"):
                player.set_weights([0.5, 0.5])
            with self.assertRaisesRegex(liquidblend.InvalidArgument, "finite"):
                player.seek(float("nan"))
            with self.assertRaises(liquidblend.Error):
                player.set_parameters({})
            with self.assertRaises(liquidblend.OutOfRange):
                player.wait_exact(99, patience=0.1)
        with self.assertRaisesRegex(liquidblend.InvalidArgument, "level_of_detail"):
            open_file(surface=liquidblend.SurfaceOptions(level_of_detail=9))
        with self.assertRaises(liquidblend.NotFound):
            connection = liquidblend.Connection(service().target)
            liquidblend.Player.open(family="none", connection=connection)

    def test_logs_what_goes_wrong_and_raises_what_the_log_raises(self):
        class Seen(Exception):
            pass

        def log(message):
            raise Seen(message)

        with open_file(log=log) as player:
            player.set_parameters({"height": 1})  # which this family has not
            player.play()
            with self.assertRaisesRegex(Seen, "no frames"):
                polled(player, lambda frame: False)

    def test_frees_the_frame_of_a_poll_whose_log_raises(self):
        class Seen(Exception):
            pass

        def log(message):
            raise Seen(message)

        with open_file(log=log) as player:
            polled(player, lambda frame: True)
            freed = []
            free = _native.function("lb_frame_free")

            def count(pointer):
                freed.append(pointer)
                free(pointer)

            player._messages.append("a line")
            with unittest.mock.patch.object(_native, "function", replaced("lb_frame_free", count)):
                with self.assertRaisesRegex(Seen, "a line"):
                    player.poll()
            gc.collect()
            self.assertEqual(freed, [player._frame_handle.pointer])
