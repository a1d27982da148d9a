#!/usr/bin/env python3
"""Makes the file that Blender installs the add-on from.

  client/blender/make_zip.py OUT.zip [--library libliquidblend.so.1]

It holds the add-on and the Python package of client/python, and the library if that is given.
Without it, LIQUIDBLEND_LIBRARY, the add-on's preferences or the system say where the library is.
The same files give the same bytes.
"""

import argparse
import pathlib
import zipfile

ADDON = "liquidblend_blender"
TIME = (2000, 1, 1, 0, 0, 0)


def sources(folder):
    return sorted(path for path in folder.rglob("*.py"))


def contents(blender, package, library):
    """(name in the zip, path) of each file."""
    addon = blender / ADDON
    for path in sources(addon):
        yield f"{ADDON}/{path.relative_to(addon)}", path
    for path in sources(package):
        yield f"{ADDON}/vendor/{package.name}/{path.relative_to(package)}", path
    if library:
        yield f"{ADDON}/vendor/{package.name}/libliquidblend.so.1", library


def write(out, files):
    part = out.with_name(out.name + ".part")
    with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, path in files:
            entry = zipfile.ZipInfo(name, TIME)
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, path.read_bytes())
    part.replace(out)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--library", type=pathlib.Path)
    arguments = parser.parse_args()
    blender = pathlib.Path(__file__).resolve().parent
    package = blender.parent / "python" / "liquidblend"
    for path in [package / "__init__.py"] + ([arguments.library] if arguments.library else []):
        if not path.is_file():
            parser.error(f"there is no {path}")
    write(arguments.out, contents(blender, package, arguments.library))


main()
