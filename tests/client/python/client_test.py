"""Clients: families, animations, files, and what closing leaves."""

import threading
import unittest

import liquidblend
from service import NUM_FRAMES, service


class ClientTest(unittest.TestCase):
    def setUp(self):
        self.client = service().client

    def test_lists_by_id(self):
        self.assertIn("two_drops", self.client.families())
        self.assertLessEqual({"drops_a", "drops_b"}, set(self.client.animations()))
        names = self.client.operations()
        self.assertTrue(names)
        self.assertTrue(all(name.startswith("operations/") for name in names), names)

    def test_describes_a_family(self):
        family = self.client.family("two_drops")
        self.assertEqual(family, self.client.family("families/two_drops", version=family.version))
        self.assertEqual((family.name, family.version), ("two_drops", 1))
        self.assertEqual((family.source, family.targets), ("drops_a", ("drops_b",)))
        self.assertEqual(family.frames_per_second, 24)
        self.assertAlmostEqual(family.duration, (NUM_FRAMES - 1) / 24)
        self.assertEqual(family.up, liquidblend.Up.Z)
        self.assertEqual((family.parameters, family.points), ((), ()))
        self.assertGreater(family.levels, 1)
        low, high = family.bounds
        self.assertTrue(all(a < b for a, b in zip(low, high)), family.bounds)
        self.assertEqual(family.raw["name"], "families/two_drops")

    def test_describes_an_animation(self):
        animation = self.client.animation("drops_a")
        self.assertEqual(animation["numFrames"], NUM_FRAMES)

    def test_errors_have_code_reason_and_class(self):
        with self.assertRaises(liquidblend.NotFound) as raised:
            self.client.family("none")
        self.assertEqual(raised.exception.code, liquidblend.Status.NOT_FOUND)
        self.assertEqual(raised.exception.reason, "NOT_FOUND")
        self.assertIn("'none'", raised.exception.message)
        with self.assertRaises(liquidblend.FailedPrecondition) as raised:
            self.client.delete_animation("drops_a")
        self.assertIn("two_drops", raised.exception.message)
        with self.assertRaises(liquidblend.NotFound):
            self.client.delete_family("none")
        with self.assertRaises(liquidblend.NotFound):
            self.client.animation("none")
        with self.assertRaises(liquidblend.NotFound):
            self.client.rollback_family("two_drops", 9)
        with self.assertRaises(liquidblend.NotFound):
            self.client.job("operations/none")
        with self.assertRaises(liquidblend.NotFound):
            self.client.download("none", service().folder / "none.lbf")
        self.assertFalse((service().folder / "none.lbf").exists())

    def test_calls_are_in_the_trace_that_is_given(self):
        trace_id = "4bf92f3577b34da6a3ce929d0e0e4736"
        traceparent = f"00-{trace_id}-00f067aa0ba902b7-01"
        with liquidblend.connect(service().target, traceparent=traceparent) as client:
            with self.assertRaises(liquidblend.NotFound):
                client.delete_family("none")
        self.assertIn(f"trace_id={trace_id}", (service().folder / "server.out").read_text())

    def test_a_text_with_a_nul_is_refused(self):
        cut, client = "two_drops\0old", self.client
        for call, named in (
            (lambda: client.family(cut), "name"),
            (lambda: client.animation(cut), "name"),
            (lambda: client.rollback_family(cut, 1), "name"),
            (lambda: client.delete_family(cut), "name"),
            (lambda: client.delete_animation("drops_a\0old"), "name"),
            (lambda: client.download(cut, service().folder / "cut.lbf"), "name"),
            (lambda: client.download("two_drops", f"{service().folder}/cut\0.lbf"), "path"),
            (lambda: client.job("operations/1\0"), "name"),
            (lambda: client.import_animation("a\0", service().folder), "animation"),
            (lambda: client.import_animation("a", f"{service().folder}\0"), "directory"),
            (lambda: client.import_animation("a", service().folder, pattern="*\0"), "pattern"),
            (lambda: client.register("f\0", "drops_a", "drops_b"), "family"),
            (lambda: client.register("f", "drops_a\0", "drops_b"), "source"),
            (lambda: client.register("f", "drops_a", ["drops_b\0"]), "targets"),
            (lambda: client.register("f", "a", "b", parameters={"h\0": [1, 2]}), "parameters"),
            (lambda: client.register("f", "a", "b", options={"seed\0": 1}), "options"),
            (lambda: client.register("f", "a", "b", options={"seed": "1\0"}), "options"),
            (lambda: client.frame(cut, 0.5), "family"),
            (lambda: client.frame("two_drops", parameters={"h\0": 1}), "parameters"),
            (lambda: client.stream(cut, 0.5), "family"),
        ):
            with self.assertRaisesRegex(liquidblend.InvalidArgument, f"{named} has a NUL"):
                call()
        self.assertIn("two_drops", client.families())

    def test_errors_of_threads_are_their_own(self):
        errors = {}

        def ask(name):
            for _ in range(20):
                with self.assertRaises(liquidblend.NotFound) as raised:
                    self.client.family(name)
                errors.setdefault(name, set()).add(raised.exception.message)

        threads = [threading.Thread(target=ask, args=(f"none_{k}",)) for k in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for name, messages in errors.items():
            self.assertEqual(len(messages), 1, messages)
            self.assertIn(name, messages.pop())
        self.assertEqual(len(errors), 4)

    def test_a_closed_client_says_so_and_its_frames_stay(self):
        with liquidblend.connect(service().target) as client:
            frame = client.frame("two_drops", 0.5, 0.25)
            stream = client.stream("two_drops", 0.5)
            first = next(stream)
        with self.assertRaisesRegex(ValueError, "closed"):
            client.families()
        self.assertEqual(frame.positions.shape, (len(frame.positions), 3))
        self.assertEqual(next(stream).time, first.time + 1 / 24, "a stream goes on by itself")
        stream.close()

    def test_several_servers_are_tried_in_turn(self):
        with liquidblend.connect(f"127.0.0.1:1,{service().target}") as client:
            self.assertIn("two_drops", client.families())
