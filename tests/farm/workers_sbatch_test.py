#!/usr/bin/env python3
"""Tests deploy/farm/slurm/workers.sbatch without Slurm: what it asks of Slurm, and of the worker.

  workers_sbatch_test.py CHECKOUT
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

CHECKOUT = pathlib.Path(sys.argv.pop(1)).resolve()
SCRIPT = CHECKOUT / "deploy" / "farm" / "slurm" / "workers.sbatch"
# Stand in for Slurm's programs, and for what follows a requeued task: each notes its arguments.
PROGRAMS = {
    "squeue": 'echo "$END"',
    "srun": "exit $STATUS",
    "scontrol": "exit $REFUSED",
    "sleep": "",
}
ARRAY = {"SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": "3"}


class Workers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        for name, command in PROGRAMS.items():
            program = self.folder / name
            program.write_text(f'#!/bin/sh\necho {name} "$@" >>"{self.folder}/calls"\n{command}\n')
            program.chmod(0o755)

    def run_script(self, end="N/A", status=0, refused=0, **variables):
        """Runs it as a task of an array, or with other variables: the exit status and what it
        called."""
        (self.folder / "calls").write_text("")
        environment = {"PATH": f"{self.folder}:{os.environ['PATH']}", "END": str(end),
                       "STATUS": str(status), "REFUSED": str(refused), "SLURM_JOB_ID": "7",
                       "SLURM_CPUS_PER_TASK": "2", **(variables or ARRAY)}
        done = subprocess.run(["bash", SCRIPT, "run-worker.sh", "farm.env", "--verbose"],
                              env=environment, capture_output=True, text=True, check=False)
        return done.returncode, (self.folder / "calls").read_text()

    def max_time(self, left):
        end = time.strftime("%Y-%m-%dT%H:%M:%S", time.localtime(time.time() + left))
        _, calls = self.run_script(end)
        return int(re.search(r"--max-time (-?\d+)s", calls).group(1))

    def test_a_task_of_an_array_speaks_of_itself_alone(self):
        status, calls = self.run_script(status=75)
        self.assertEqual(status, 0)
        self.assertIn("squeue -h -j 7_3 ", calls)
        self.assertIn("scontrol requeue 7_3\n", calls)

    def test_a_job_without_an_array_has_its_own_id(self):
        _, calls = self.run_script(status=75, SLURM_MEM_PER_NODE="1000")
        self.assertIn("squeue -h -j 7 ", calls)
        self.assertIn("scontrol requeue 7\n", calls)
        self.assertIn(" --memory 800MiB ", calls)

    def test_time_is_left_for_the_end(self):
        for left, expected in [(7200, 7140), (120, 60), (90, 45)]:
            self.assertAlmostEqual(self.max_time(left), expected, delta=3)

    def test_the_worker_is_given_a_time_that_it_takes(self):
        for left in [60, 15, 5, 0, -30]:
            self.assertGreater(self.max_time(left), 5, left)

    def test_without_an_end_there_is_no_time(self):
        _, calls = self.run_script()
        self.assertNotIn("--max-time", calls)
        self.assertIn("run-worker.sh farm.env --threads 2 --stopped-status 75 --verbose\n", calls)

    def test_a_task_that_is_done_or_has_failed_is_not_requeued(self):
        for worker in [0, 3]:
            status, calls = self.run_script(status=worker)
            self.assertEqual(status, worker)
            self.assertNotIn("scontrol", calls)

    def test_where_requeueing_is_refused_the_status_says_that_work_is_left(self):
        status, _ = self.run_script(status=75, refused=1)
        self.assertEqual(status, 75)


unittest.main()
