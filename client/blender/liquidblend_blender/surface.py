"""Surfaces: from the arrays of a frame to a mesh of Blender."""

import dataclasses
from typing import Optional

import numpy as np

from . import mapping


@dataclasses.dataclass(frozen=True)
class Surface:
    """What a mesh is made of, in Blender's axes. Made on any thread; nobody changes it afterwards.

    positions, velocities, normals and rest_positions are (n, 3) float32, triangles (m, 3) uint32.
    edges (k, 2) and corner_edges (3m) are None where an edge has other than two triangles.
    """

    positions: np.ndarray
    triangles: np.ndarray
    velocities: Optional[np.ndarray] = None  # metres per second of the scene
    normals: Optional[np.ndarray] = None
    rest_positions: Optional[np.ndarray] = None
    rest_times: Optional[np.ndarray] = None
    edges: Optional[np.ndarray] = None
    corner_edges: Optional[np.ndarray] = None

    @property
    def num_bytes(self):
        values = (getattr(self, field.name) for field in dataclasses.fields(self))
        return sum(value.nbytes for value in values if value is not None)


EMPTY = Surface(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))


def make_surface(arrays, up="z", velocity_scale=1.0):
    """A Surface of `arrays`, a mapping with positions and triangles, and perhaps velocities,
    normals and rest_positions (n, 4), as a family has them."""
    def turned(name):
        values = arrays.get(name)
        return None if values is None else mapping.to_scene_axes(values, up)

    triangles = _with_three_corners(
        np.ascontiguousarray(arrays["triangles"], np.uint32).reshape(-1, 3))
    velocities = turned("velocities")
    if velocities is not None and velocity_scale != 1.0:
        velocities = velocities * np.float32(velocity_scale)
    rest = arrays.get("rest_positions")
    edges, corner_edges = find_edges(triangles, len(arrays["positions"]))
    return Surface(
        positions=turned("positions"), triangles=triangles, velocities=velocities,
        normals=turned("normals"),
        rest_positions=None if rest is None else mapping.to_scene_axes(rest[:, :3], up),
        rest_times=None if rest is None else np.ascontiguousarray(rest[:, 3], np.float32),
        edges=edges, corner_edges=corner_edges)


def _with_three_corners(triangles):
    """Without those that have a vertex twice. A surface has none, but a server may send any, and
    Blender crashes where one has no edges."""
    a, b, c = triangles.T
    has_three = (a != b) & (b != c) & (c != a)
    return triangles if has_three.all() else np.ascontiguousarray(triangles[has_three])


def _order_of(keys, num_keys):
    """(sorted keys, the places that they came from). Sorting one packed number for each is faster
    than argsort, as long as both fit into 63 bits."""
    bits = max(len(keys) - 1, 1).bit_length()
    if int(num_keys).bit_length() + bits > 63:
        order = np.argsort(keys)
        return keys[order], order
    packed = np.sort((keys << bits) | np.arange(len(keys), dtype=np.int64))
    return packed >> bits, packed & ((1 << bits) - 1)


def find_edges(triangles, num_vertices):
    """(edges, the edge of each corner) of a closed, oriented surface; (None, None) of any other.

    Blender finds edges itself, but on its main thread, and takes as long. In a closed surface each
    edge runs in one direction in one triangle, and back in another.
    """
    if len(triangles) == 0:
        return None, None
    begins = triangles.ravel().astype(np.int64)
    ends = np.roll(triangles, -1, axis=1).ravel().astype(np.int64)
    forth, back = np.flatnonzero(begins < ends), np.flatnonzero(begins > ends)
    if len(forth) != len(back) or len(forth) + len(back) != len(begins):
        return None, None
    num_keys = num_vertices * num_vertices
    keys, order = _order_of(begins[forth] * num_vertices + ends[forth], num_keys)
    back_keys, back_order = _order_of(ends[back] * num_vertices + begins[back], num_keys)
    if not np.array_equal(keys, back_keys) or np.any(keys[1:] == keys[:-1]):
        return None, None
    corner_edges = np.empty(len(begins), np.uint32)
    corner_edges[forth[order]] = np.arange(len(order), dtype=np.uint32)
    corner_edges[back[back_order]] = np.arange(len(order), dtype=np.uint32)
    return np.stack([keys // num_vertices, keys % num_vertices], 1).astype(np.uint32), corner_edges


def _set_integers(mesh, attribute, items, name, values):
    """Writes unsigned numbers. Since Blender 3.6 a mesh has them as generic attributes, which are
    copied at once; before, foreach_set copies arrays of the property's own type, uint32, at once
    and converts all others one by one."""
    generic = mesh.attributes.get(attribute)
    if generic is not None:
        generic.data.foreach_set("value", values.view(np.int32))
    else:
        items.foreach_set(name, values)


def _write_topology(mesh, surface):
    num_corners = surface.triangles.size
    mesh.vertices.add(len(surface.positions))
    mesh.loops.add(num_corners)
    mesh.polygons.add(len(surface.triangles))
    mesh.vertices.foreach_set("co", surface.positions.ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, num_corners, 3, dtype=np.uint32))
    if not mesh.polygons[0].is_property_readonly("loop_total"):  # it is since Blender 3.6
        mesh.polygons.foreach_set("loop_total", np.full(len(mesh.polygons), 3, np.uint32))
    _set_integers(mesh, ".corner_vert", mesh.loops, "vertex_index", surface.triangles.ravel())
    if surface.edges is not None:
        mesh.edges.add(len(surface.edges))
        mesh.edges.foreach_set("vertices", surface.edges.ravel())
        _set_integers(mesh, ".corner_edge", mesh.loops, "edge_index", surface.corner_edges)


def _write_attribute(mesh, name, kind, field, values):
    if values is None:
        return
    attribute = mesh.attributes.new(name, kind, 'POINT')
    attribute.data.foreach_set(field, np.ascontiguousarray(values, np.float32).ravel())


def _shade(mesh, shading):
    is_smooth = shading != 'FLAT'
    if hasattr(mesh, "shade_smooth"):  # Blender 4.1
        mesh.shade_smooth() if is_smooth else mesh.shade_flat()
    else:
        mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), is_smooth))


def _write_normals(mesh, normals):
    if hasattr(mesh, "use_auto_smooth"):  # until Blender 4.0, which needs it for custom normals
        mesh.use_auto_smooth = True
        mesh.auto_smooth_angle = np.pi
    mesh.normals_split_custom_set_from_vertices(normals)


def write_mesh(mesh, surface, shading='SMOOTH'):
    """Replaces all that the mesh holds but its materials. Main thread, or a handler of a render."""
    mesh.clear_geometry()
    if len(surface.triangles) == 0:
        mesh.update()
        return
    _write_topology(mesh, surface)
    _shade(mesh, shading)
    _write_attribute(mesh, "velocity", 'FLOAT_VECTOR', "vector", surface.velocities)
    _write_attribute(mesh, "rest_position", 'FLOAT_VECTOR', "vector", surface.rest_positions)
    _write_attribute(mesh, "rest_time", 'FLOAT', "value", surface.rest_times)
    mesh.update(calc_edges=surface.edges is None)
    if shading == 'NORMALS' and surface.normals is not None:
        _write_normals(mesh, surface.normals)
