"""Sends animations to a server: Mantaflow's cache as it is, any other mesh frame by frame."""

import glob
import json
import os
import re

import bpy
import numpy as np

from . import connection, mapping


class SendError(Exception):
    """What cannot be sent, and why."""


def _read(collection, name, width, dtype):
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


def find_domain(object):
    """The settings of an object's Mantaflow domain, or None."""
    for modifier in object.modifiers if object else ():
        if modifier.type == 'FLUID' and modifier.fluid_type == 'DOMAIN':
            return modifier.domain_settings
    return None


def _numbers(folder, pattern):
    """The frame numbers of the files of a name."""
    paths = glob.glob(os.path.join(glob.escape(folder), pattern))
    return {int(re.search(r"_(\d+)\.", os.path.basename(path)).group(1)) for path in paths}


def mantaflow_folder(domain):
    """The folder of the cache's meshes, which are there, with all velocities or none."""
    folder = os.path.join(bpy.path.abspath(domain.cache_directory), "mesh")
    meshes = _numbers(folder, "fluid_mesh_*.bobj.gz")
    velocities = _numbers(folder, "lVelMesh_*.uni")
    if not meshes:
        raise SendError(f"no fluid_mesh_####.bobj.gz in {folder}: bake the domain's mesh, with the "
                        "mesh file format Binary Object")
    if velocities and meshes - velocities:
        missing = min(meshes - velocities)
        raise SendError(f"frame {missing} has a mesh but no lVelMesh_{missing:04d}.uni: bake the "
                        "domain's mesh again")
    return folder


def _up_of(scene, domain):
    """Against gravity; None where that is along no axis."""
    gravity = np.array(scene.gravity if scene.use_gravity else domain.gravity)
    axis = int(np.argmax(np.abs(gravity)))
    if np.abs(np.delete(gravity, axis)).max() > 1e-3 * np.abs(gravity[axis]) or not gravity.any():
        return None
    return ("" if gravity[axis] < 0 else "-") + "xyz"[axis]


def domain_size(object):
    """The sides of a domain's box. Its mesh as it looks is the liquid, so its own is measured."""
    corners = _read(object.data.vertices, "co", 3, np.float32)
    sides = (corners.max(0) - corners.min(0)) * np.abs(np.array(object.scale))
    return [float(side) for side in sides]


def mantaflow_options(object, domain, scene):
    """Units, rate and what is up of the cache, for the import. Its positions are in longest sides
    of the domain, its velocities in cells per Mantaflow's unit of time, of which a second has 2.5
    whatever the frame rate."""
    longest = max(domain_size(object))
    voxel = longest / domain.resolution_max
    return {"frames_per_second": mapping.scene_fps(scene), "vertex_scale": longest,
            "velocity_scale": 2.5 * voxel * domain.time_scale, "voxel_size": voxel,
            "up": _up_of(scene, domain)}


# ---- meshes of any kind


def _velocities_of(mesh):
    """Of Mantaflow and ours, or of FLIP Fluids; None if there are none."""
    for name in ("velocity", "flip_velocity"):
        attribute = mesh.attributes.get(name)
        if attribute and attribute.data_type == 'FLOAT_VECTOR' and attribute.domain == 'POINT':
            return _read(attribute.data, "vector", 3, np.float32)
    return None


def mesh_arrays(object, depsgraph):
    """(positions, triangles, velocities or None) of what an object looks like, in the world."""
    evaluated = object.evaluated_get(depsgraph)
    mesh = evaluated.to_mesh()
    try:
        mesh.calc_loop_triangles()
        turn = np.array(evaluated.matrix_world, np.float32)
        positions = _read(mesh.vertices, "co", 3, np.float32) @ turn[:3, :3].T + turn[:3, 3]
        triangles = _read(mesh.loop_triangles, "vertices", 3, np.int32)
        velocities = _velocities_of(mesh)
        if velocities is not None:
            velocities = velocities @ turn[:3, :3].T
        return positions, triangles, velocities
    finally:
        evaluated.to_mesh_clear()


def ply_of(positions, triangles, velocities):
    """The bytes of a PLY file: x y z, and vx vy vz if there are velocities."""
    attributes = [(positions, ("x", "y", "z"))]
    if velocities is not None:
        attributes.append((velocities, ("vx", "vy", "vz")))
    return connection.ply_bytes(attributes, triangles)


def mesh_steps(context, object, folder):
    """A generator that writes the scene's frames of an object, and meta.json, into `folder`."""
    scene, before = context.scene, context.scene.frame_current
    frames = range(scene.frame_start, scene.frame_end + 1)
    try:
        for i, frame in enumerate(frames):
            scene.frame_set(frame)
            arrays = mesh_arrays(object, context.evaluated_depsgraph_get())
            if len(arrays[1]) == 0:
                raise SendError(f"{object.name} has no triangles in frame {frame}")
            with open(os.path.join(folder, f"frame_{i + 1:04d}.ply"), "wb") as file:
                file.write(ply_of(*arrays))
            yield f"frame {frame}", 0.5 * (i + 1) / len(frames)
    finally:
        scene.frame_set(before)
    meta = {"fps": mapping.scene_fps(scene), "up": "z",
            "units": {"vertex_scale": 1.0, "velocity_scale_to_m_per_s": 1.0}}
    with open(os.path.join(folder, "meta.json"), "w", encoding="utf-8") as file:
        json.dump(meta, file)
    return f"{len(frames)} frames are written"
