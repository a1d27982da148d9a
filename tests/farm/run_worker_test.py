#!/usr/bin/python3
"""Tests deploy/farm/run-worker.sh: run_worker_test.py CHECKOUT"""

import os
import pathlib
import stat
import subprocess
import sys
import tempfile
import unittest

CHECKOUT = pathlib.Path(sys.argv.pop(1)).resolve()
SCRIPT = CHECKOUT / "deploy" / "farm" / "run-worker.sh"
# Stands in for the worker: prints its arguments, and the environment.
WORKER = '#!/bin/sh\nprintf "%s\\n" "$@" end\nenv\n'


class RunWorker(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.worker = self.folder / "worker"
        self.worker.write_text(WORKER)
        self.worker.chmod(0o755)

    def run_with(self, text, *flags):
        """What the worker sees of a file with this text: the process, arguments, environment."""
        file = self.folder / "farm.env"
        file.write_text(f"LIQUIDBLEND_WORKER={self.worker}\n{text}")
        environment = {"PATH": os.environ["PATH"], "TMPDIR": str(self.folder)}
        done = subprocess.run([SCRIPT, file, *flags], env=environment, capture_output=True,
                              text=True, check=False)
        arguments, _, variables = done.stdout.partition("end\n")
        return done, arguments.split(), dict(
            line.split("=", 1) for line in variables.splitlines() if "=" in line)

    def test_values_are_taken_as_they_are(self):
        url = "postgresql://a:p#a&s$HOME 'x'@h/db?options=-csearch_path%3Dx"
        done, _, variables = self.run_with(f"# why\n\nLIQUIDBLEND_STORE={url}\nAWS_REGION=r")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(variables["LIQUIDBLEND_STORE"], url)
        self.assertEqual(variables["AWS_REGION"], "r", "a last line without its end")

    def test_the_worker_drains_with_the_flags_given(self):
        _, arguments, variables = self.run_with("A=secret\n", "--threads", "2")
        self.assertEqual(arguments, ["--drain", "--threads", "2"])
        self.assertEqual(variables["A"], "secret")

    def test_the_cache_is_on_the_node_unless_given(self):
        _, _, variables = self.run_with("")
        self.assertEqual(variables["LIQUIDBLEND_CACHE"],
                         f"{self.folder}/liquidblend-{os.getuid()}")
        self.assertEqual(variables["LIQUIDBLEND_CACHE_SIZE"], "8GiB")
        _, _, variables = self.run_with(
            "LIQUIDBLEND_CACHE=/scratch\nLIQUIDBLEND_CACHE_SIZE=1TiB\n")
        self.assertEqual(variables["LIQUIDBLEND_CACHE"], "/scratch")
        self.assertEqual(variables["LIQUIDBLEND_CACHE_SIZE"], "1TiB")

    def cache(self):
        return self.folder / f"liquidblend-{os.getuid()}"

    def mode_of(self, path):
        return stat.S_IMODE(path.stat().st_mode)

    def test_the_cache_is_for_its_user_alone(self):
        for makes_before in (False, True):
            with self.subTest(makes_before=makes_before):
                if makes_before:  # as earlier versions of the worker did
                    self.cache().chmod(0o755)
                done, _, _ = self.run_with("")
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(self.mode_of(self.cache()), 0o700)

    def test_a_cache_that_somebody_else_may_have_made_is_refused(self):
        (self.folder / "elsewhere").mkdir(mode=0o755)
        makers = {"a link": lambda: self.cache().symlink_to(self.folder / "elsewhere"),
                  "a link to nothing": lambda: self.cache().symlink_to(self.folder / "nowhere"),
                  "a file": self.cache().touch}
        for what, make in makers.items():
            make()
            done, arguments, _ = self.run_with("")
            self.assertEqual((done.returncode, arguments), (2, []), what)
            self.assertIn(f"{self.cache()} is no folder of this user's own", done.stderr)
            self.cache().unlink()
        self.assertEqual(self.mode_of(self.folder / "elsewhere"), 0o755)
        self.assertFalse((self.folder / "nowhere").exists())

    @unittest.skipUnless(os.geteuid() == 0, "only root gives folders to others")
    def test_a_cache_of_another_user_is_refused(self):
        self.cache().mkdir(mode=0o777)
        os.chown(self.cache(), 65534, 65534)
        done, arguments, _ = self.run_with("")
        self.assertEqual((done.returncode, arguments), (2, []))
        self.assertIn("is no folder of this user's own", done.stderr)

    def test_a_cache_that_is_given_keeps_its_permissions(self):
        shared = self.folder / "shared"
        shared.mkdir()
        shared.chmod(0o2775)
        link = self.folder / "link"
        link.symlink_to(shared)
        self.worker.write_text(WORKER + "umask\n")
        expected_umask = subprocess.run(["sh", "-c", "umask"], capture_output=True, text=True,
                                        check=True).stdout
        for given in (shared, link):
            done, _, variables = self.run_with(f"LIQUIDBLEND_CACHE={given}\n")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(variables["LIQUIDBLEND_CACHE"], str(given))
            self.assertEqual(self.mode_of(shared), 0o2775)
            self.assertTrue(done.stdout.endswith(f"\n{expected_umask}"))

    def test_what_is_no_variable_is_refused_and_not_shown(self):
        for line in ["export A=b", "secret", "9A=b", " A=b"]:
            done, _, _ = self.run_with(f"{line}\n")
            self.assertEqual(done.returncode, 2, line)
            self.assertNotIn(line.strip(), done.stderr)

    def test_a_file_that_is_not_there_is_refused(self):
        done = subprocess.run([SCRIPT, "/nowhere"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2)
        self.assertIn("/nowhere", done.stderr)

    def test_the_workers_status_is_the_tasks(self):
        self.worker.write_text("#!/bin/sh\nexit 75\n")
        done, _, _ = self.run_with("")
        self.assertEqual(done.returncode, 75)

    def test_the_sample_has_variables_alone(self):
        sample = (CHECKOUT / "deploy" / "farm" / "environment.sample").read_text()
        done, _, variables = self.run_with(sample)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("LIQUIDBLEND_BLOBS", variables)


unittest.main()
