"""PLY: the bytes of a file of a triangle mesh."""

from __future__ import annotations

from typing import Any, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray


def ply_bytes(
    attributes: Sequence[Tuple[NDArray[np.float32], Sequence[str]]], triangles: NDArray[Any]
) -> bytes:
    """A binary file.

      attributes  of the vertices, each with the names of its columns: positions, "x", "y", "z"
      triangles   (m, 3)
    """
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(attributes[0][0])}"]
    lines += [f"property float {name}" for _, names in attributes for name in names]
    lines += [f"element face {len(triangles)}"]
    lines += ["property list uchar int vertex_indices", "end_header", ""]
    faces = np.empty(len(triangles), [("count", "u1"), ("vertices", "<u4", 3)])
    faces["count"] = 3
    faces["vertices"] = triangles
    vertices = np.hstack([values for values, _ in attributes]).astype("<f4", copy=False)
    return "\n".join(lines).encode() + vertices.tobytes() + faces.tobytes()
