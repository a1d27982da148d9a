#!/usr/bin/env python3
"""Runs tests of the Python package.

  run_tests.py BUILD_DIRECTORY MODULE..    such as frame_test; all of one process share a server
Environment: LIQUIDBLEND_BINARY_DIR, the programs, if they are not the build's; CC for native_test.
Exit: 0 if all pass; 1 if not; 2 usage; 77 if numpy is missing.
"""

import os
import pathlib
import sys
import time
import unittest

if len(sys.argv) < 3:
    print(__doc__, file=sys.stdout if sys.argv[1:] == ["--help"] else sys.stderr)
    sys.exit(0 if sys.argv[1:] == ["--help"] else 2)
try:
    import numpy  # noqa: F401
except ImportError:
    print("run_tests.py: no numpy: run deploy/install-deps.sh", file=sys.stderr)
    sys.exit(77)

build = pathlib.Path(sys.argv[1]).resolve()
os.environ.setdefault("LIQUIDBLEND_BINARY_DIR", str(build / "bin"))
os.environ["LIQUIDBLEND_LIBRARY"] = str(build / "lib" / "libliquidblend.so.1")
here = pathlib.Path(__file__).resolve().parent
sys.dont_write_bytecode = True
sys.path[:0] = [str(here), str(here.parents[2] / "client" / "python")]


class Result(unittest.TextTestResult):
    """Tells how long each test takes, with what it has to start."""

    _start = time.monotonic()

    def addSuccess(self, test):
        now = time.monotonic()
        self.stream.write(f"{now - self._start:6.2f} s ")
        self._start = now
        super().addSuccess(test)


runner = unittest.TextTestRunner(verbosity=2, resultclass=Result)
unittest.main(module=None, argv=["run_tests.py", *sys.argv[2:]], testRunner=runner)
