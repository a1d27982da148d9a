"""Measures, in Blender, how long a mesh takes to change: run by run.sh, prints a Markdown table.

Each frame is another closed surface of as many triangles, with velocities. `ms` are of the clock,
`CPU ms` of the thread that does it: medians of 30 frames, and the least, since other programs only
ever add to a time.
"""

import os
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from in_blender import empty_scene, install, module, parse_arguments  # noqa: E402

NUM_FRAMES = 30


def make_torus(rings, sides, phase):
    """(positions, triangles): 2 * rings * sides triangles, a wave running around."""
    a, b = np.meshgrid(np.arange(rings) * 2 * np.pi / rings, np.arange(sides) * 2 * np.pi / sides,
                       indexing="ij")
    r = 2.0 + (0.8 + 0.1 * np.sin(5 * a + phase)) * np.cos(b)
    positions = np.stack([r * np.cos(a), r * np.sin(a), np.sin(b)], -1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    i_next, j_next = (i + 1) % rings, (j + 1) % sides
    quads = np.stack([i * sides + j, i_next * sides + j, i_next * sides + j_next,
                      i * sides + j_next], -1).reshape(-1, 4)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return positions.astype(np.float32), triangles.astype(np.uint32)


def frames_of(num_triangles):
    """Another number of rings each time, so that no frame has the triangles of the one before."""
    sides = int((num_triangles / 2.0) ** 0.5)
    for frame in range(NUM_FRAMES):
        positions, triangles = make_torus(num_triangles // 2 // sides + frame % 2, sides, frame)
        yield {"positions": positions, "triangles": triangles, "velocities": positions.copy()}


class Stopwatch:
    def __init__(self):
        self.times = {}

    def run(self, name, work):
        clock, cpu = time.perf_counter(), time.thread_time()
        result = work()
        self.times.setdefault(name, []).append((time.perf_counter() - clock,
                                                time.thread_time() - cpu))
        return result

    def figures(self, name):
        """Median and least of the clock, median of the CPU, in milliseconds."""
        clock, cpu = 1e3 * np.array(self.times[name]).T
        return float(np.median(clock)), float(clock.min()), float(np.median(cpu))


def write_by_blender(mesh, made):
    """Without edges of ours, and by the arrays that most scripts use: int32."""
    mesh.clear_geometry()
    mesh.vertices.add(len(made.positions))
    mesh.loops.add(made.triangles.size)
    mesh.polygons.add(len(made.triangles))
    mesh.vertices.foreach_set("co", made.positions.ravel())
    starts = np.arange(0, made.triangles.size, 3, dtype=np.int32)
    mesh.polygons.foreach_set("loop_start", starts)
    mesh.polygons.foreach_set("loop_total", np.full(len(starts), 3, np.int32))
    mesh.loops.foreach_set("vertex_index", made.triangles.ravel().astype(np.int32))
    mesh.update(calc_edges=True)


def write_new_mesh(object, made, write):
    old, mesh = object.data, bpy.data.meshes.new("Liquid")
    write(mesh, made)
    object.data = mesh
    bpy.data.meshes.remove(old)


def measure(num_triangles):
    empty_scene()
    surface, watch = module("surface"), Stopwatch()
    object = bpy.data.objects.new("Liquid", bpy.data.meshes.new("Liquid"))
    bpy.context.collection.objects.link(object)
    update = bpy.context.view_layer.update
    for arrays in frames_of(num_triangles):
        made = watch.run("prepare", lambda: surface.make_surface(arrays))
        watch.run("write", lambda: surface.write_mesh(object.data, made))
        watch.run("evaluate", update)
        watch.run("int32", lambda: write_by_blender(object.data, made))
        update()
        watch.run("new mesh", lambda: write_new_mesh(object, made, surface.write_mesh))
        update()
    return watch


STEPS = (("prepare", "finding edges (other threads, ahead)"),
         ("write", "writing the mesh"),
         ("evaluate", "Blender's own update of it"),
         ("int32", "instead: writing int32 arrays, edges by Blender"),
         ("new mesh", "instead: a new mesh datablock each frame"))

parse_arguments()
install(parse_arguments().zip)
print("| triangles | step | ms | least ms | CPU ms |\n| --- | --- | --- | --- | --- |")
for num_triangles in (20_000, 100_000, 400_000):
    watch = measure(num_triangles)
    for name, text in STEPS:
        cells = " | ".join(f"{figure:.1f}" for figure in watch.figures(name))
        print(f"| {num_triangles:,} | {text} | {cells} |")
