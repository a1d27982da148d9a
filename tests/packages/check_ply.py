#!/usr/bin/env python3
"""Whether a binary PLY is a closed, oriented surface of a size that a frame of two_drops has.

  check_ply.py FILE.ply

Exit: 0 it is; 1 not; 2 usage.
"""

import collections
import pathlib
import re
import struct
import sys

MIN_TRIANGLES = 5000


def triangles_of(data):
    """The triangles of a little-endian PLY whose vertices are floats."""
    header, _, body = data.partition(b"end_header\n")
    vertices = int(re.search(rb"element vertex (\d+)", header).group(1))
    faces = int(re.search(rb"element face (\d+)", header).group(1))
    num_floats = len(re.findall(rb"property float", header))
    offset = 4 * num_floats * vertices
    for _ in range(faces):
        count, *corners = struct.unpack_from("<B3i", body, offset)
        if count != 3 or not all(0 <= corner < vertices for corner in corners):
            raise SystemExit(f"check_ply.py: a face of {count} corners: {corners}")
        offset += 13
        yield corners
    if offset != len(body):
        raise SystemExit(f"check_ply.py: {len(body) - offset} bytes are left")


def main(arguments):
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 0 if arguments == ["--help"] else 2
    triangles = list(triangles_of(pathlib.Path(arguments[0]).read_bytes()))
    edges = collections.Counter()
    for a, b, c in triangles:
        for edge in ((a, b), (b, c), (c, a)):
            edges[edge] += 1
            edges[edge[::-1]] -= 1
    open_edges = sum(1 for count in edges.values() if count)
    print(f"{len(triangles)} triangles, {open_edges} open edges")
    return 0 if len(triangles) >= MIN_TRIANGLES and not open_edges else 1


sys.exit(main(sys.argv[1:]))
