#!/usr/bin/env python3
"""How far blends are from a simulation that was never an input.

  compare_with_truth.py FAMILY TRUTH [--server HOST:PORT] [--weights W,W,..] [--frames N]

TRUTH is a folder of Mantaflow's meshes (fluid_mesh_0001.bobj.gz and so on, with a meta.json). For
each weight, a line has the mean distance from its surfaces in mean edge lengths. Cells begin with
"# %%", as notebooks in editors have them.
"""

# %% What is compared
import argparse
import gzip
import json
import os
import pathlib
import sys

import numpy as np

import liquidblend

parser = argparse.ArgumentParser(usage=__doc__.replace("%", "%%"))
parser.add_argument("family")
parser.add_argument("truth", type=pathlib.Path)
parser.add_argument("--server", default=os.environ.get("LIQUIDBLEND_SERVER", "127.0.0.1:50051"))
parser.add_argument("--weights", default="0,0.25,0.5,0.75,1")
parser.add_argument("--frames", type=int, default=6, help="how many, evenly over the animation")
arguments = parser.parse_args()
weights = [float(weight) for weight in arguments.weights.split(",")]

# %% The truth's frames: positions in metres, triangles
meta = json.loads((arguments.truth / "meta.json").read_text())


def read_truth(number):
    with gzip.open(arguments.truth / f"fluid_mesh_{number:04d}.bobj.gz") as file:
        data = file.read()
    num_vertices = int(np.frombuffer(data, "<i4", 1)[0])
    positions = np.frombuffer(data, "<f4", 3 * num_vertices, 4).reshape(-1, 3)
    after_normals = 8 + 2 * 12 * num_vertices
    num_triangles = int(np.frombuffer(data, "<i4", 1, after_normals)[0])
    triangles = np.frombuffer(data, "<i4", 3 * num_triangles, after_normals + 4).reshape(-1, 3)
    return positions * np.float32(max(meta["domain_size_m"])), triangles


# %% Distances between surfaces
def nearest_vertices(points, positions, chunk=1024):
    squares = np.sum(positions * positions, axis=1)
    rows = (points[k : k + chunk] for k in range(0, len(points), chunk))
    return np.concatenate([np.argmin(squares - 2 * (row @ positions.T), axis=1) for row in rows])


def triangles_around(num_vertices, triangles):
    """The triangles at each vertex; where there are fewer than at others, the last one again."""
    vertices = triangles.ravel()
    order = np.argsort(vertices, kind="stable")
    counts = np.bincount(vertices, minlength=num_vertices)
    columns = np.minimum(np.arange(counts.max()), np.maximum(counts - 1, 0)[:, None])
    return order[(np.cumsum(counts) - counts)[:, None] + columns] // 3


def squared_distances(p, a, b, c):
    """From points to triangles."""

    def dot(u, v):
        return np.sum(u * v, axis=-1)

    def to_edge(u, v):
        edge = v - u
        at = np.clip(dot(p - u, edge) / np.maximum(dot(edge, edge), 1e-30), 0, 1)
        return np.sum((p - u - at[..., None] * edge) ** 2, axis=-1)

    normal = np.cross(b - a, c - a)
    is_above = np.ones(normal.shape[:-1], bool)
    for u, v in ((a, b), (b, c), (c, a)):
        is_above &= dot(np.cross(v - u, p - u), normal) >= 0
    to_plane = dot(p - a, normal) ** 2 / np.maximum(dot(normal, normal), 1e-30)
    to_edges = np.minimum(np.minimum(to_edge(a, b), to_edge(b, c)), to_edge(c, a))
    return np.where(is_above, to_plane, to_edges)


def distances(points, positions, triangles):
    """From points to the triangles at the nearest vertex of a surface."""
    around = triangles_around(len(positions), triangles)[nearest_vertices(points, positions)]
    a, b, c = (positions[triangles[around][..., k]] for k in range(3))
    return np.sqrt(squared_distances(points[:, None], a, b, c).min(axis=1))


def mean_edge_length(positions, triangles):
    ends = positions[triangles]
    return np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=-1).mean()


def symmetric_distance(frame, positions, triangles):
    """The mean distance of vertices to the other surface, in mean edge lengths of the second."""
    there = distances(frame.positions, positions, triangles)
    back = distances(positions, frame.positions, frame.triangles)
    both = np.concatenate([there, back]).mean()
    return both / mean_edge_length(positions, triangles)


# %% The comparison
def compare(client):
    family = client.family(arguments.family)
    num_frames = round(family.duration * family.frames_per_second) + 1
    numbers = np.unique(np.linspace(1, num_frames, arguments.frames).round().astype(int))
    truths = {number: read_truth(number) for number in numbers}
    print(f"{family.name} version {family.version}, mean distance in edges of {arguments.truth}")
    for weight in weights:
        times = {number: (number - 1) / family.frames_per_second for number in numbers}
        far = [
            symmetric_distance(client.frame(family.name, weight, times[n]), *truths[n])
            for n in numbers
        ]
        print(f"weight {weight:g}: {np.mean(far):.3f}, at most {np.max(far):.3f}")


try:
    with liquidblend.connect(arguments.server) as client:
        compare(client)
except liquidblend.Error as error:
    sys.exit(f"compare_with_truth.py: {error}")
