"""Errors without a server."""

import pickle
import re
import pathlib
import types
import unittest
from unittest import mock

import liquidblend
from liquidblend import _native, client, errors, family, player

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


class HostileTest(unittest.TestCase):
    """A server may say anything: whatever it is, it is an Error, and no command to a terminal."""

    def test_a_message_may_have_any_bytes(self):
        said = {"lb_last_error": b"no \xff\xc3( drops", "lb_last_error_reason": b"GONE\x80"}
        with mock.patch.object(_native, "function", lambda name: lambda: said[name]):
            with self.assertRaises(liquidblend.NotFound) as raised:
                errors.check(5)
        self.assertEqual(raised.exception.message, "no \ufffd\ufffd( drops")
        self.assertEqual(raised.exception.reason, "GONE\ufffd")

    def test_a_text_has_no_control_characters(self):
        said = "drops\r\n\x1b[2J\x00\x7f\x9b\u2028 \u00e9\u6c34".encode()
        self.assertEqual(_native.text_of(said), "drops???[2J???? \u00e9\u6c34")

    def test_a_players_log_may_have_any_bytes(self):
        with mock.patch.object(player, "make_some"), mock.patch.object(player, "family_of"):
            played = liquidblend.Player(_native.PlayerOptions(), 0, print)
        played._on_log(None, b"lost: \xff\x1b[2J")
        self.assertEqual(played._messages, ["lost: \ufffd?[2J"])

    def ask(self, text, method, *arguments):
        """What a method of a client gives or raises if the library gives it a JSON text."""
        made = object.__new__(liquidblend.Client)
        made._opened = types.SimpleNamespace(interruptible=lambda call: call(), pointer=None)
        with mock.patch.object(client, "make_some"), \
                mock.patch.object(client, "_json_of", lambda _: text):
            return getattr(made, method)(*arguments)

    def test_a_damaged_json_is_data_loss(self):
        for text in (b'["families/a"b"]', b"", b"[", b'["\xff"]', b"[" * 100000):
            with self.assertRaisesRegex(liquidblend.DataLoss, "no JSON"):
                self.ask(text, "families")
            with self.assertRaisesRegex(liquidblend.DataLoss, "no JSON"):
                self.ask(text, "animation", "a")
        for text in (b"{}", b"3", b"null", b'"drops"'):
            with self.assertRaisesRegex(liquidblend.DataLoss, "not of a list"):
                self.ask(text, "operations")
        with self.assertRaisesRegex(liquidblend.DataLoss, "not of a dict"):
            self.ask(b"[]", "animation", "a")

    def test_a_list_of_other_things_than_names_is_data_loss(self):
        for text in (b"[1]", b'["families/a",null]', b"[[]]"):
            with self.assertRaisesRegex(liquidblend.DataLoss, "names"):
                self.ask(text, "families")
        names = rb'["families/a\u001b", "families/\ud800"]'
        self.assertEqual(self.ask(names, "families"), ["a?", "?"])


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
