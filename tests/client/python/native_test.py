"""_native.py is the header, and the library is found where it should be."""

import ctypes
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

from liquidblend import _native

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
INCLUDE = CHECKOUT / "client" / "include"
HEADER = INCLUDE / "liquidblend" / "liquidblend.h"
PACKAGE = CHECKOUT / "client" / "python"
# What arrays, garbage collection and a function with a timeout replace.
LEFT_OUT = {"lb_frame_copy", "lb_frame_retain", "lb_client_watch"}
SIZE = '  printf("{0} %zu\\n", sizeof({0}));\n'
OFFSET = '  printf("{0}.{1} %zu\\n", offsetof({0}, {1}));\n'


def layout_of_c():
    """The sizes of the structs, and the offsets of the members that _native.py names."""
    body = ""
    for name, struct in _native.STRUCTS.items():
        body += SIZE.format(name)
        body += "".join(OFFSET.format(name, field[0]) for field in struct._fields_)
    program = (
        "#include <stdio.h>\n#include <liquidblend/liquidblend.h>\n"
        f"int main(void) {{\n{body}  return 0;\n}}\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        source = pathlib.Path(folder) / "layout.c"
        source.write_text(program)
        compiler = os.environ.get("CC", "cc")
        command = [compiler, "-std=c99", f"-I{INCLUDE}", source, "-o", source.with_suffix("")]
        subprocess.run(command, check=True)
        text = subprocess.run([source.with_suffix("")], check=True, capture_output=True, text=True)
    return dict(line.split() for line in text.stdout.splitlines())


def layout_of_python():
    layout = {}
    for name, struct in _native.STRUCTS.items():
        layout[name] = str(ctypes.sizeof(struct))
        for field in struct._fields_:
            layout[f"{name}.{field[0]}"] = str(getattr(struct, field[0]).offset)
    return layout


def num_arguments_of_header():
    """By the function's name."""
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.DOTALL)
    found = re.findall(r"^LB_API [^;(]*?\b(lb_\w+)\(([^;]*)\);", text, re.MULTILINE)
    return {
        name: 0 if arguments.strip() == "void" else arguments.count(",") + 1
        for name, arguments in found
    }


def members_of_header():
    """The names of each struct's members, in order."""
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.DOTALL)
    structs = re.findall(r"typedef struct (\w+) \{(.*?)\n\}", text, re.DOTALL)
    return {name: re.findall(r"(\w+)(?:\[\d+\])?;", body) for name, body in structs}


def import_with(library, code="liquidblend.library_version()"):
    environment = {**os.environ, "PYTHONPATH": str(PACKAGE), "LIQUIDBLEND_LIBRARY": library}
    if not library:
        del environment["LIQUIDBLEND_LIBRARY"]
    command = [sys.executable, "-B", "-c", f"import liquidblend; print({code})"]
    return subprocess.run(command, env=environment, capture_output=True, text=True)


class StructsTest(unittest.TestCase):
    def test_have_the_sizes_and_offsets_of_the_header(self):
        self.assertEqual(layout_of_python(), layout_of_c())

    def test_have_the_members_of_the_header(self):
        header = members_of_header()
        for name, struct in _native.STRUCTS.items():
            self.assertEqual([field[0] for field in struct._fields_], header[name], name)

    def test_are_those_that_the_package_calls_functions_with(self):
        used = {
            argument._type_
            for _, arguments in _native.FUNCTIONS.values()
            for argument in arguments
            if hasattr(argument, "_type_") and isinstance(argument._type_, type)
        }
        structs = {struct for struct in used if issubclass(struct, ctypes.Structure)}
        self.assertLessEqual(structs, set(_native.STRUCTS.values()))

    def test_say_their_size(self):
        self.assertEqual(_native.Surface().struct_size, ctypes.sizeof(_native.Surface))


class FunctionsTest(unittest.TestCase):
    def test_are_those_of_the_header(self):
        header = num_arguments_of_header()
        self.assertEqual(set(header) - LEFT_OUT, set(_native.FUNCTIONS))
        for name, (_, arguments) in _native.FUNCTIONS.items():
            self.assertEqual(len(arguments), header[name], name)


class LibraryTest(unittest.TestCase):
    def test_comes_first_from_the_environment_then_from_beside_the_package(self):
        with mock.patch.dict(os.environ, {"LIQUIDBLEND_LIBRARY": "/some/library.so"}):
            self.assertEqual(_native.candidates(), ["/some/library.so"])
        with mock.patch.dict(os.environ), tempfile.TemporaryDirectory() as folder:
            del os.environ["LIQUIDBLEND_LIBRARY"]
            self.assertEqual(_native.candidates()[-1], _native.FILE_NAME)
            installed = pathlib.Path(folder).resolve()
            package = installed / "share" / "liquidblend" / "python" / "liquidblend"
            expected = [package, package.parent, installed / "lib"]
            for place in expected:
                place.mkdir(parents=True, exist_ok=True)
                (place / _native.FILE_NAME).touch()
            with mock.patch.object(_native, "__file__", str(package / "_native.py")):
                found = _native.candidates()
            paths = [str(place / _native.FILE_NAME) for place in expected]
            self.assertEqual(found, [*paths, _native.FILE_NAME])

    def test_that_is_missing_is_told_with_what_helps(self):
        done = import_with("/nowhere/libliquidblend.so.1")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("FileNotFoundError", done.stderr)
        self.assertIn("/nowhere/libliquidblend.so.1", done.stderr)
        self.assertIn("Set LIQUIDBLEND_LIBRARY", done.stderr)

    def test_is_not_needed_to_import_the_package(self):
        done = import_with("/nowhere/libliquidblend.so.1", "liquidblend.__version__")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_that_is_too_old_is_told(self):
        done = import_with("libm.so.6")
        self.assertIn("ImportError", done.stderr)
        self.assertIn("older than this Python package: it has no lb_", done.stderr)

    def test_has_the_version_of_the_package(self):
        done = import_with(os.environ["LIQUIDBLEND_LIBRARY"], "liquidblend.__version__")
        version = import_with(os.environ["LIQUIDBLEND_LIBRARY"])
        self.assertEqual(version.stdout, done.stdout, version.stderr)
