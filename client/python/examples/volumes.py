#!/usr/bin/env python3
"""The liquid's volume over time, of several blends, from streams.

  volumes.py FAMILY [--server HOST:PORT] [--weights W,W,..] [--fps N]
"""

import argparse
import os
import sys

import numpy as np

import liquidblend


def volume(frame):
    """Of what a closed, oriented surface encloses: a sum over tetrahedra from the origin."""
    a, b, c = (frame.positions[frame.triangles[:, k]].astype(float) for k in range(3))
    return np.sum(np.cross(a, b) * c) / 6


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("family")
    parser.add_argument("--server", default=os.environ.get("LIQUIDBLEND_SERVER", "127.0.0.1:50051"))
    parser.add_argument("--weights", default="0,0.5,1")
    parser.add_argument("--fps", type=float, default=6)
    arguments = parser.parse_args()
    weights = [float(weight) for weight in arguments.weights.split(",")]
    with liquidblend.connect(arguments.server) as client:
        streams = [
            client.stream(arguments.family, weight, frames_per_second=arguments.fps)
            for weight in weights
        ]
        print("time  " + "  ".join(f"weight {weight:<5g}" for weight in weights))
        for frames in zip(*streams):
            volumes = "  ".join(f"{volume(frame):9.4f} m3" for frame in frames)
            print(f"{frames[0].time:.3f}  {volumes}")


if __name__ == "__main__":
    try:
        main()
    except liquidblend.Error as error:
        sys.exit(f"volumes.py: {error}")
