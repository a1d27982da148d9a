#!/usr/bin/env python3
"""Whether play.c of docs/c-api.md, which the page has built, plays: time and weight go on."""

import os
import re
import subprocess
import sys

text = subprocess.run(["./play", os.environ["GRPC"]], check=True, capture_output=True, text=True).stdout
shown = [tuple(map(float, m)) for m in re.findall(r"([\d.]+) s, weight ([\d.]+): \d+ triangles", text)]
times = {time for time, _ in shown}
weights = {weight for _, weight in shown}
if len(times) < 5 or len(weights) < 5 or max(times) > 2.5:
    sys.exit(f"{len(shown)} polls with a frame, {len(times)} times, {len(weights)} weights:\n{text}")
