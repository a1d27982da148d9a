"""The package is installed without a network, and its types are strict."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = CHECKOUT / "client" / "python"


def run(*command, **more):
    done = subprocess.run(command, capture_output=True, text=True, **more)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class PackageTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_is_installed_by_pip_without_a_network(self):
        # Of a copy: pip leaves folders where it builds.
        source, target = self.folder / "source", self.folder / "target"
        shutil.copytree(PACKAGE, source, ignore=shutil.ignore_patterns("__pycache__"))
        flags = ["--no-deps", "--no-index", "--no-build-isolation", "--no-cache-dir", "--quiet"]
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
        run(*pip, "install", *flags, "--target", target, source)
        self.assertTrue((target / "liquidblend" / "py.typed").is_file())
        installed = {path.name for path in (target / "liquidblend").glob("*.py")}
        self.assertEqual(installed, {path.name for path in (PACKAGE / "liquidblend").glob("*.py")})
        code = (
            "import importlib.metadata, liquidblend\n"
            "assert liquidblend.__version__ == importlib.metadata.version('liquidblend')\n"
            "print(liquidblend.__file__, liquidblend.library_version())"
        )
        environment = {**os.environ, "PYTHONPATH": str(target)}
        text = run(sys.executable, "-c", code, env=environment, cwd=self.folder)
        self.assertIn(str(target), text)

    def test_works_as_a_copy_within_another_with_the_library_in_it(self):
        copy = self.folder / "add_on" / "vendored"
        shutil.copytree(PACKAGE / "liquidblend", copy)
        library = pathlib.Path(os.environ["LIQUIDBLEND_LIBRARY"]).resolve()
        (copy / "libliquidblend.so.1").symlink_to(library)
        environment = {**os.environ, "PYTHONPATH": str(self.folder)}
        del environment["LIQUIDBLEND_LIBRARY"]
        code = "from add_on import vendored; print(vendored.library_version())"
        self.assertTrue(run(sys.executable, "-c", code, env=environment, cwd=self.folder))

    def test_has_the_syntax_of_python_3_9(self):
        import ast

        for path in PACKAGE.rglob("*.py"):
            ast.parse(path.read_text(), str(path), feature_version=(3, 9))
