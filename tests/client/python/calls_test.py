"""Calls that Ctrl-C ends, without a server."""

import fractions
import gc
import signal
import threading
import unittest
import weakref

import numpy as np

from liquidblend._calls import Caller, weights_of
from liquidblend.family import option_text


class Thing:
    pass


class ArgumentsTest(unittest.TestCase):
    def test_a_weight_may_be_any_real_number(self):
        numbers = (0.5, np.float64(0.5), np.float32(0.5), np.array(0.5), fractions.Fraction(1, 2))
        for number in numbers:
            self.assertEqual(weights_of(number), [0.5], type(number))
        for number in (1, True, np.int64(1), np.uint8(1), np.array(1)):
            self.assertEqual(weights_of(number), [1.0], type(number))

    def test_weights_may_be_any_sequence_of_them(self):
        for numbers in ([0.25, 1], (np.float32(0.25), 1), np.array([0.25, 1])):
            self.assertEqual(weights_of(numbers), [0.25, 1.0], type(numbers))
        self.assertEqual(weights_of(None), [])
        self.assertEqual(weights_of([]), [])
        with self.assertRaises(ValueError):
            weights_of("half")

    def test_options_are_written_as_the_library_reads_them(self):
        for value, text in (
            (True, "true"),
            (np.bool_(True), "true"),
            (np.bool_(False), "false"),
            (5, "5"),
            (np.int32(5), "5"),
            (np.float32(0.5), "0.5"),
            ("off", "off"),
        ):
            self.assertEqual(option_text(value), text, type(value))


class CallerTest(unittest.TestCase):
    def setUp(self):
        self.caller = Caller()

    def test_gives_the_result_or_raises(self):
        self.assertEqual(self.caller(lambda: 7), 7)
        self.assertNotEqual(self.caller(threading.get_ident), threading.get_ident())

        def fail():
            raise LookupError("nothing there")

        with self.assertRaisesRegex(LookupError, "nothing there"):
            self.caller(fail)
        self.assertEqual(self.caller(lambda: 8), 8)

    def test_calls_of_other_threads_are_made_there(self):
        found = []
        thread = threading.Thread(target=lambda: found.append(self.caller(threading.get_ident)))
        thread.start()
        thread.join()
        self.assertEqual(found, [thread.ident])

    def test_a_signal_that_another_thread_gets_ends_the_waiting(self):
        """That is how a signal looks that comes just before the main thread sleeps, too."""
        released = threading.Event()
        finished = threading.Event()

        def call():
            signal.pthread_kill(threading.get_ident(), signal.SIGINT)
            released.wait(60)
            finished.set()

        with self.assertRaises(KeyboardInterrupt):
            self.caller(call)
        self.assertFalse(finished.is_set(), "only the call's end has ended the waiting")
        self.assertEqual(self.caller(lambda: 7), 7, "the next one does not wait for it")
        released.set()
        self.assertTrue(finished.wait(60), "the call goes on")

    def test_lets_go_what_a_call_has_before_it_returns(self):
        gc.disable()
        try:
            for _ in range(100):
                thing = Thing()
                gone = weakref.ref(thing)
                self.assertIs(self.caller(lambda kept=thing: kept), thing)
                del thing
                self.assertIsNone(gone())
        finally:
            gc.enable()

    def test_ends_its_thread_with_itself(self):
        thread = self.caller(threading.current_thread)
        self.caller = None
        thread.join(60)
        self.assertFalse(thread.is_alive())
