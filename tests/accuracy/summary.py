#!/usr/bin/env python3
"""One table of all scenes that have a truth: the half-way blend with default options against the
nearest input and against registrations without automatic correspondences, with the spread over
seeds.

    tests/accuracy/summary.py [--seeds N] [--frame-step N] [--scenes A,B] DATA_FOLDER...

Each DATA_FOLDER has scenes as lb_accuracy --data takes them (tests/data/bake_scenes.sh makes some);
two_drops comes from the repository. BUILD names the build folder (default build/release), which
must hold the target lb_accuracy. Distances in mean edges, all frames / early ones. Prints each
scene's row as soon as it is known. Exits 1 if a run fails.
"""
import argparse
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("BUILD", ROOT / "build/release")) / "tests/lb_accuracy"
SCENES = ["two_drops", "moved_drop", "two_drops_bridged", "throw", "far_drop", "crossing_drops",
          "drop_size", "block_length", "inflow_start", "moving_obstacle",
          "touching_drops", "dam_break"]
HEADER = ["scene", "nearest input", "half-way", "smallest to largest over seeds, all",
          "the same, early", "without automatic", "weight 1", "inverted at 1", "largest error of a falling part",
          "closer than the nearest input", "grade"]


def folder_of(scene, folders):
    for folder in [*folders, str(ROOT / "tests/data")]:
        if os.path.isdir(os.path.join(folder, scene)):
            return folder
    return None


def run(scene, folder, *flags):
    done = subprocess.run([PROGRAM, "--scene", scene, "--data", folder, *flags],
                          capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"summary.py: {scene} {' '.join(flags)}: {done.stderr.strip()}")
    return done.stdout


def distances(report):
    """The rows of the table of distances: (label, against, all frames, early ones)."""
    rows = re.findall(r"^\| ([^|]+) \| (\w+) \| ([\d.]+) \| ([\d.]+) \|$", report, re.MULTILINE)
    return [(label, against, float(all_), float(early)) for label, against, all_, early in rows]


def half_way(report):
    """The best of the blends that are compared with the truth."""
    rows = [r for r in distances(report)
            if not r[0].startswith("baseline") and r[0] not in ("weight 0", "weight 1")]
    return min((r[2] for r in rows)), min((r[3] for r in rows))


def nearest_input(report):
    rows = [r for r in distances(report) if r[0].startswith("baseline: input")]
    return min(r[2] for r in rows), min(r[3] for r in rows)


def pair(values):
    return " / ".join(f"{v:.3f}" for v in values)


def span(values):
    return f"{min(values):.3f} to {max(values):.3f}"


def row_of(scene, folder, flags, num_seeds):
    report = run(scene, folder, *flags)
    quick = [*flags, "--fold-step", "1000"]
    best = half_way(report)
    found = [best] + [half_way(run(scene, folder, *quick, "--seed", str(seed)))
                      for seed in range(2, num_seeds + 1)]
    without = half_way(run(scene, folder, *quick, "--automatic-correspondences", "off"))
    inputs = nearest_input(report)
    at_one = [r[2] for r in distances(report) if r[0] == "weight 1"]
    folds = re.findall(r"^\| \w+ to \w+ (?:\| [\d.]+ ){3}\| ([\d.]+) ", report, re.MULTILINE)
    parts = re.findall(r"frames \| ([\d.]+) % \|", report)
    grades = re.findall(r" is (good|doubtful|too different): ", report)
    return [scene, pair(inputs), pair(best), span([f[0] for f in found]),
            span([f[1] for f in found]), pair(without), f"{max(at_one):.3f}",
            f"{max(map(float, folds)):.3f} %", f"{min(map(float, parts)):.1f} %",
            " / ".join(f"{i / b:.1f}" for i, b in zip(inputs, best)), ", ".join(grades)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("folders", nargs="*", metavar="DATA_FOLDER")
    parser.add_argument("--seeds", type=int, default=5, help="how many, from 1 on (default 5)")
    parser.add_argument("--frame-step", default="1", help="of distances and volumes (default 1)")
    parser.add_argument("--scenes", default=",".join(SCENES), help="which (default all)")
    arguments = parser.parse_args()
    print("| " + " | ".join(HEADER) + " |\n|" + " --- |" * len(HEADER), flush=True)
    for scene in arguments.scenes.split(","):
        folder = folder_of(scene, arguments.folders)
        if folder is None:
            print(f"summary.py: no folder has {scene}", file=sys.stderr)
            continue
        row = row_of(scene, folder, ["--frame-step", arguments.frame_step], arguments.seeds)
        print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
