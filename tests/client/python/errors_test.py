"""Errors without a server."""

import pickle
import re
import pathlib
import unittest

import liquidblend
from liquidblend import errors, family

HEADER = pathlib.Path(__file__).resolve().parents[3] / "client/include/liquidblend/liquidblend.h"


class ErrorTest(unittest.TestCase):
    def test_codes_are_those_of_the_header(self):
        codes = re.search(r"enum lb_status \{(.*?)\}", HEADER.read_text(), re.DOTALL).group(1)
        header = {name: int(code) for name, code in re.findall(r"LB_(\w+) = (\d+)", codes)}
        self.assertEqual(header, {code.name: code.value for code in liquidblend.Status})

    def test_has_a_class_for_each_code(self):
        for code in liquidblend.Status:
            error = errors.make_error(code, "why", "REASON")
            self.assertIsInstance(error, liquidblend.Error)
            self.assertEqual((error.code, error.message, error.reason), (code, "why", "REASON"))
            name = "".join(word.capitalize() for word in code.name.split("_"))
            if code not in (liquidblend.Status.OK, liquidblend.Status.UNKNOWN):
                self.assertIs(type(error), getattr(liquidblend, name))
        self.assertEqual(errors.make_error(31, "strange").code, liquidblend.Status.UNKNOWN)

    def test_says_code_and_message(self):
        self.assertEqual(str(errors.make_error(5, "no family 'x'")), "NOT_FOUND: no family 'x'")

    def test_is_also_pythons_own_where_there_is_one(self):
        self.assertIsInstance(errors.make_error(3, ""), ValueError)
        self.assertIsInstance(errors.make_error(4, ""), TimeoutError)

    def test_travels_between_processes(self):
        for code in (4, 5):
            error = pickle.loads(pickle.dumps(errors.make_error(code, "why", "REASON")))
            self.assertEqual((error.code, error.message, error.reason), (code, "why", "REASON"))


class UnknownNumberTest(unittest.TestCase):
    def test_of_a_newer_library_is_unknown(self):
        self.assertEqual([family.up_of(n) for n in range(7)], list(liquidblend.Up))
        self.assertEqual([family.grade_of(n) for n in range(4)], list(liquidblend.Grade))
        for number in (-1, 77):
            self.assertIs(family.up_of(number), liquidblend.Up.UNKNOWN)
            self.assertIs(family.grade_of(number), liquidblend.Grade.UNKNOWN)


class ArgumentsTest(unittest.TestCase):
    def test_a_text_with_a_nul_is_refused(self):
        for name in ("target", "token", "tls_ca", "tls_cert", "tls_key", "tls_server_name"):
            with self.assertRaisesRegex(liquidblend.InvalidArgument, f"^INVALID_ARGUMENT: {name} "):
                liquidblend.connect(**{name: "a\0b"})
        for name in ("file", "family"):
            with self.assertRaisesRegex(liquidblend.InvalidArgument, f"{name} has a NUL"):
                liquidblend.Player.open(**{name: "a\0b"})

    def test_a_file_that_is_missing_is_not_found(self):
        with self.assertRaises(liquidblend.NotFound) as raised:
            liquidblend.Player.open(file="/nowhere/family.lbf")
        self.assertIn("/nowhere/family.lbf", raised.exception.message)

    def test_a_player_needs_a_file_or_a_family(self):
        with self.assertRaisesRegex(liquidblend.InvalidArgument, "options.file"):
            liquidblend.Player.open()

    def test_nobody_listens(self):
        with self.assertRaises(liquidblend.Unavailable) as raised:
            liquidblend.connect("127.0.0.1:1", connect_timeout=0.2, patience=0)
        self.assertEqual(raised.exception.reason, "", "no server has said it")

    def test_a_timeout_of_0_or_less_is_refused(self):
        for name in ("connect_timeout", "call_timeout"):
            for seconds in (0, 0.0, -1.5):
                message = f"{name} is {seconds:g}; it is above 0"
                with self.assertRaisesRegex(liquidblend.InvalidArgument, message):
                    liquidblend.connect("127.0.0.1:1", **{name: seconds})
                with self.assertRaisesRegex(ValueError, message):
                    liquidblend.Connection(**{name: seconds})

    def test_an_option_that_is_wrong_is_named(self):
        with self.assertRaisesRegex(liquidblend.InvalidArgument, "finite"):
            liquidblend.connect(connect_timeout=float("nan"))
