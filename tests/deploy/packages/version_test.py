#!/usr/bin/env python3
"""The version of CMakeLists.txt is that of all that names it, and has an entry in the changelog."""

import gzip
import pathlib
import re
import subprocess
import tempfile
import unittest

import contents

CHECKOUT = contents.CHECKOUT
SCRIPT = CHECKOUT / "deploy/packages/debian_changelog.py"


class VersionTest(unittest.TestCase):
    def changelog(self, text, release):
        """debian_changelog.py: what it says if it fails, otherwise None, and what it writes."""
        with tempfile.TemporaryDirectory() as folder:
            page, out = pathlib.Path(folder) / "changelog.md", pathlib.Path(folder) / "out.gz"
            page.write_text(text)
            done = subprocess.run([SCRIPT, page, release, "A Name <name@example.org>", out],
                                  capture_output=True, text=True)
            if done.returncode != 0:
                return done.stderr, None
            return None, gzip.decompress(out.read_bytes()).decode()

    def test_is_that_of_the_python_package(self):
        text = (CHECKOUT / "client/python/liquidblend/__init__.py").read_text()
        self.assertEqual(re.findall(r'^__version__ = "(.*)"', text, re.MULTILINE),
                         [contents.version()])

    def test_is_the_newest_of_the_changelog(self):
        text = (CHECKOUT / "docs/changelog.md").read_text()
        said, written = self.changelog(text, f"{contents.version()}-1")
        self.assertIsNone(said)
        self.assertTrue(written.startswith(f"liquidblend ({contents.version()}-1) bookworm;"))
        of_page = re.findall(r"^## \[([\d.]+)\]", text, re.MULTILINE)
        self.assertEqual(re.findall(r"^liquidblend \(([\d.]+)-1\)", written, re.MULTILINE), of_page)

    def test_of_another_entry_is_refused(self):
        said, _ = self.changelog("# Changelog\n## [1.0.0] - 2026-01-02\n- A thing.\n", "1.0.1-1")
        self.assertIn("[1.0.1]", said)

    def test_the_changelog_of_packages_has_items_without_links(self):
        _, written = self.changelog(
            "# Changelog\n## [1.2.0] - 2026-01-02\n### Added\n- `a` thing ([page](page.md)).\n", "1.2.0-3")
        self.assertEqual(written, "liquidblend (1.2.0-3) bookworm; urgency=medium\n\n"
                         "  [ Added ]\n  * a thing.\n\n"
                         " -- A Name <name@example.org>  Fri, 02 Jan 2026 12:00:00 +0000\n")


if __name__ == "__main__":
    unittest.main()
