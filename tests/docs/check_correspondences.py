#!/usr/bin/env python3
"""Whether the blocks of docs/correspondences.md came to what the page says.

  check_correspondences.py

Run where they ran, with their server in LIQUIDBLEND_SERVER. Version 1 of the family `late` has
automatic pairs alone, version 2 the page's two. Exit: 0 if it is so; 1 with a line that says what
is not.
"""

import json
import subprocess
import sys

LEVEL_M = -0.5  # above the pool and below the tops of drops, by some 0.2 m each
SAME_HEIGHT_M = 0.1


def liquidblend(*arguments):
    return subprocess.run(
        ["liquidblend", "--quiet", *arguments], check=True, capture_output=True, text=True
    ).stdout


def expect(holds, what):
    if not holds:
        sys.exit(f"check_correspondences.py: {what}")


def highest(version, low, high):
    """The highest z with x from low to high, half-way, 0.08 s after the start."""
    name = f"half_{version}.obj"
    liquidblend("frame", "late", "--version", str(version), "--weights", "0.5", "--time", "0.08",
                "-o", name)
    with open(name, encoding="ascii") as file:
        vertices = [
            [float(word) for word in line.split()[1:4]] for line in file if line.startswith("v ")
        ]
    return max(z for x, _, z in vertices if low <= x <= high)


def check_pairs():
    pairs = json.loads(liquidblend("inspect", "late", "--json"))["reports"][0]["correspondences"]
    expect(len(pairs) == 2, f"{len(pairs)} correspondences, not 2")
    for k, pair in enumerate(pairs):
        expect(pair["outcome"] == "KEPT", f"correspondence {k} is overruled")
        expect("automatic" not in pair, f"correspondence {k} is automatic")


def check_drops():
    """Before: one drop in the middle. After: two, which strike at once."""
    for version, drops, pool in ((1, ["middle"], ["left", "right"]),
                                 (2, ["left", "right"], ["middle"])):
        heights = {
            "left": highest(version, -1.2, -0.8),
            "middle": highest(version, -0.35, 0.35),
            "right": highest(version, 0.8, 1.2),
        }
        found = f"version {version}: {heights}"
        expect(all(heights[place] > LEVEL_M for place in drops), f"no drop, {found}")
        expect(all(heights[place] < LEVEL_M for place in pool), f"a drop too many, {found}")
        spread = max(heights[place] for place in drops) - min(heights[place] for place in drops)
        expect(spread < SAME_HEIGHT_M, f"drops at different heights, {found}")


check_pairs()
check_drops()
