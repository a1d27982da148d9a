"""The package is installed without a network, and its types are strict."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
PACKAGE = CHECKOUT / "client" / "python"
PAGE = CHECKOUT / "docs" / "python.md"


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

    def install_by_hand(self):
        """What cmake installs: PREFIX/share/liquidblend/python and PREFIX/lib."""
        prefix = self.folder / "prefix"
        package = prefix / "share" / "liquidblend" / "python"
        shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__"))
        (prefix / "lib").mkdir()
        library = pathlib.Path(os.environ["LIQUIDBLEND_LIBRARY"]).resolve()
        (prefix / "lib" / "libliquidblend.so.1").symlink_to(library)
        return prefix

    def commands_of_page(self, prefix):
        """Those of the page's Install, but for cmake's; they end with the package's file."""
        install = PAGE.read_text().partition("\n## Install\n")[2].partition("\n## ")[0]
        where, environment = re.findall(r"```\n(.*?)```", install, re.DOTALL)
        where = "".join(line for line in where.splitlines(True) if not line.startswith("cmake"))
        show = "python3 -c 'import liquidblend as l; print(l.library_version(), l.__file__)'\n"
        for commands in (where + show, f"{environment}ENV/bin/{show}"):
            commands = commands.replace("PREFIX", str(prefix))
            yield re.sub(r"\bENV\b", str(self.folder / "env"), commands)

    def test_is_installed_as_the_page_says(self):
        prefix = self.install_by_hand()
        path = f"{pathlib.Path(sys.executable).parent}:{os.environ['PATH']}"
        environment = {**os.environ, "PATH": path}
        for name in ("LIQUIDBLEND_LIBRARY", "PYTHONPATH"):
            environment.pop(name, None)
        by_path, by_pip = [
            run("bash", "-euc", commands, env=environment, cwd=self.folder).splitlines()[-1]
            for commands in self.commands_of_page(prefix)
        ]
        self.assertRegex(by_path, rf"^[\d.]+ {prefix}/share/liquidblend/python/liquidblend/")
        self.assertRegex(by_pip, rf"^[\d.]+ {self.folder}/env/lib/.*/site-packages/liquidblend/")
        target = pathlib.Path(by_pip.split()[1]).parent
        self.assertTrue((target / "py.typed").is_file())
        installed = {path.name for path in target.glob("*.py")}
        self.assertEqual(installed, {path.name for path in (PACKAGE / "liquidblend").glob("*.py")})
        code = (
            "import importlib.metadata, liquidblend\n"
            "assert liquidblend.__version__ == importlib.metadata.version('liquidblend')\n"
        )
        run(self.folder / "env/bin/python", "-c", code, env=environment, cwd=self.folder)

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
