#!/usr/bin/env python3
"""Each component of `cmake --install` has its files, and none that another one has.

  components_test.py BUILD    a build of everything
"""

import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import contents


def of_cache(name):
    """A variable of the build."""
    return re.search(rf"^{name}:\w+=(.*)$", (BUILD / "CMakeCache.txt").read_text(), re.MULTILINE)[1]


class ComponentsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def install(self, component):
        """Where the root of the file system is instead."""
        root = self.folder / component
        subprocess.run(["cmake", "--install", BUILD, "--component", component, "--prefix", "/prefix"],
                       check=True, stdout=subprocess.PIPE, env={**os.environ, "DESTDIR": str(root)})
        return root

    def installed(self, component):
        root = self.install(component)
        return {re.sub("^prefix/", "", str(path.relative_to(root))) for path in root.rglob("*")
                if path.is_symlink() or path.is_file()}

    def test_have_the_files_of_the_packages(self):
        owners = collections.defaultdict(list)
        for component, expected in contents.contents(of_cache("CMAKE_INSTALL_LIBDIR")).items():
            files = {file for file in self.installed(component)
                     if not file.startswith("share/man/")}  # made for packages alone
            with self.subTest(component):
                self.assertEqual(files, expected)
            for file in files:
                owners[file].append(component)
        self.assertEqual({}, {file: names for file, names in owners.items() if len(names) > 1})

    def test_units_name_paths_of_the_prefix_that_was_configured(self):
        unit = (self.install("server") /
                "prefix/lib/systemd/system/liquidblend-server.service").read_text()
        prefix = of_cache("CMAKE_INSTALL_PREFIX")
        self.assertIn(f"\nExecStart={prefix}/bin/liquidblend-server ", unit)
        etc = "/etc" if prefix == "/usr" else f"{prefix}/etc"
        self.assertIn(f"\nEnvironmentFile=-{etc}/liquidblend/server.env\n", unit)


if __name__ == "__main__":
    BUILD = pathlib.Path(sys.argv.pop()).resolve()
    unittest.main()
