#!/usr/bin/env python3
"""Lists of what is in packages and images: complete, of known licences, and valid SPDX 2.3."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import check_spdx
import contents

SCRIPT = contents.CHECKOUT / "deploy/packages/sbom.py"
PAGE = contents.CHECKOUT / "client/web/package-lock.json"
STATUS = """\
Package: libone
Status: install ok installed
Architecture: amd64
Source: one (1.0)
Version: 1:1.0+b1

Package: gone
Status: deinstall ok config-files
Architecture: amd64
Version: 1.0

Package: two
Status: install ok installed
Architecture: all
Version: 2.0-1
"""
COPYRIGHT = """\
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/

Files: *
Copyright: someone
License: GPL-2+ or Expat, and BSD-3-clause

Files: other
Copyright: someone
License: Special
 As you like,
 but not on Sundays.
"""


class SbomTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "var/lib/dpkg").mkdir(parents=True)
        (self.root / "var/lib/dpkg/status").write_text(STATUS)
        (self.root / "usr/share/doc/libone").mkdir(parents=True)
        (self.root / "usr/share/doc/libone/copyright").write_text(COPYRIGHT)
        (self.root / "usr/share/doc/two").mkdir()
        (self.root / "usr/share/doc/two/copyright").write_text("Two is free.\n")

    def text(self, *arguments):
        out = self.root / "out.json"
        subprocess.run([SCRIPT, "image", "an-image", "1.2.3", out, "--root", self.root, *arguments],
                       check=True, stderr=subprocess.PIPE, env={**os.environ, "SOURCE_DATE_EPOCH": "86400"})
        return out.read_text()

    def packages(self, *arguments):
        document = json.loads(self.text(*arguments))
        self.assertEqual([], list(check_spdx.faults(document)))
        return {package["name"]: package for package in document["packages"]}

    def test_has_what_is_installed(self):
        packages = self.packages()
        self.assertEqual(set(packages), {"an-image", "libone", "two"})
        self.assertEqual(packages["libone"]["versionInfo"], "1:1.0+b1")
        self.assertEqual(packages["libone"]["externalRefs"][0]["referenceLocator"],
                         "pkg:deb/debian/libone@1%3A1.0%2Bb1?arch=amd64&distro=debian-12")

    def test_reads_licences_that_are_written_for_machines(self):
        packages = self.packages()
        self.assertEqual(packages["libone"]["licenseDeclared"],
                         "((GPL-2.0-or-later OR MIT) AND BSD-3-Clause) AND LicenseRef-one-Special")
        self.assertEqual(packages["two"]["licenseDeclared"], "NOASSERTION")
        self.assertIn("not on Sundays", self.text())

    def test_has_the_scripts_of_the_page(self):
        packages = self.packages("--npm", PAGE)
        lock = json.loads(PAGE.read_text())["packages"]
        wanted = {path.removeprefix("node_modules/") for path, entry in lock.items()
                  if path and not entry.get("dev")}
        self.assertEqual(wanted, set(packages) - {"an-image", "libone", "two"})
        self.assertEqual(packages["three"]["licenseDeclared"], "MIT")
        self.assertEqual(len(packages["three"]["checksums"][0]["checksumValue"]), 128)

    def test_says_which_of_a_lock_is_missing(self):
        with self.assertRaises(subprocess.CalledProcessError):
            self.packages("--npm", f"{PAGE}:no-such-package")

    def test_is_the_same_for_the_same_input(self):
        self.assertEqual(self.text("--npm", PAGE), self.text("--npm", PAGE))

    def test_the_check_finds_faults(self):
        def faults_with(change):
            document = json.loads(self.text())
            change(document)
            return list(check_spdx.faults(document))

        self.assertTrue(faults_with(lambda d: d.pop("creationInfo")))
        self.assertTrue(faults_with(lambda d: d["packages"][0].pop("name")))
        self.assertTrue(faults_with(lambda d: d["relationships"].clear()))
        self.assertTrue(faults_with(lambda d: d["packages"].append(d["packages"][0])))
        self.assertTrue(faults_with(lambda d: d["hasExtractedLicensingInfos"].clear()))
        self.assertTrue(faults_with(lambda d: d["creationInfo"].update(created="yesterday")))


class CopyrightTest(unittest.TestCase):
    def test_names_the_scripts_of_the_page(self):
        text = (contents.CHECKOUT / "deploy/packages/copyright").read_text()
        for path, entry in json.loads(PAGE.read_text())["packages"].items():
            if path and not entry.get("dev"):
                self.assertIn(f" client/web/{path}/*\n", text)


if __name__ == "__main__":
    unittest.main()
