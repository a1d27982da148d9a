#!/usr/bin/env python3
"""Checks the types of the Python package with mypy, as strictly as it can.

  check_types.py
Exit: 0 if they are right; 1 if not; 77 if mypy is missing.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

if len(sys.argv) > 1:
    print(__doc__, file=sys.stdout if sys.argv[1:] == ["--help"] else sys.stderr)
    sys.exit(0 if sys.argv[1:] == ["--help"] else 2)
mypy = shutil.which("mypy", path="/usr/bin:/bin")
if mypy is None:
    print("check_types.py: no mypy: run deploy/install-deps.sh", file=sys.stderr)
    sys.exit(77)
package = pathlib.Path(__file__).resolve().parents[3] / "client" / "python" / "liquidblend"
with tempfile.TemporaryDirectory() as cache:
    done = subprocess.run([mypy, "--strict", "--cache-dir", cache, package])
sys.exit(done.returncode)
