#!/usr/bin/env python3
"""Whether Debian packages are what they should be.

  check_debs.py FOLDER    with *.deb and *.deb.spdx.json

- Each package has the files of its component, and the manual pages of its programs; no file is in
  two packages. All have the version of the sources.
- Configuration in /etc is known to dpkg. No package needs another version of a package of ours.
- Programs and libraries are position-independent, with read-only relocations, bound when they
  start, and with the checks of stack and buffers that Debian compiles in.
- Lists of contents are SPDX. What is compiled in is named by the package's copyright.
Exit: 0 all are; 1 not, with a line for each fault; 2 usage.
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile

import check_spdx
import contents

MAN = {
    "client": {"liquidblend", *(f"liquidblend-{name}" for name in (
        "cancel", "convert", "delete", "download", "export", "frame", "import", "inspect", "list",
        "operations", "register", "render", "rollback", "stream"))},
    "server": {"liquidblend-server", "liquidblend-admin", *(f"liquidblend-admin-{name}" for name in (
        "check", "collect", "export", "import", "owners", "plan", "queue", "workers"))},
    "worker": {"liquidblend-worker"},
}


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def field(deb, name):
    return run("dpkg-deb", "--field", deb, name).strip()


def files_of(tree):
    """As contents.py names them: below /usr without it."""
    return {re.sub("^usr/", "", str(path.relative_to(tree))) for path in tree.rglob("*")
            if (path.is_symlink() or path.is_file()) and "DEBIAN" not in path.parts}


def expected_files(component):
    libdir = f"lib/{run('dpkg-architecture', '-qDEB_HOST_MULTIARCH').strip()}"
    pages = {f"share/man/man1/{name}.1.gz" for name in MAN.get(component, ())}
    return contents.contents(libdir)[component] | pages


def hardening_faults(file):
    """What a program or library lacks."""
    if "DYN (" not in run("readelf", "-hW", file):
        yield "is not position-independent"
    segments, dynamic = run("readelf", "-lW", file), run("readelf", "-dW", file)
    if "GNU_RELRO" not in segments or not re.search("BIND_NOW|Flags:.* NOW", dynamic):
        yield "has relocations that can be written"
    symbols = run("nm", "-D", file)
    if "__stack_chk_fail" not in symbols:
        yield "does not check its stack"
    for call in re.findall(r" U (f?printf|sn?printf)\b", symbols):  # with checks: __snprintf_chk
        yield f"calls {call} without a check of its buffer"


def control_faults(deb, tree, version):
    if field(deb, "Version").rpartition("-")[0] != version:
        yield f"has the version {field(deb, 'Version')}"
    own = re.findall(r"((?:lib)?liquidblend[\w-]*|python3-liquidblend) \(= ([^)]+)\)",
                     field(deb, "Depends"))
    yield from (f"needs {name} {other}" for name, other in own if other != field(deb, "Version"))
    listed = tree / "DEBIAN/conffiles"
    known = set(listed.read_text().split()) if listed.exists() else set()
    present = {f"/{path.relative_to(tree)}" for path in (tree / "etc").rglob("*") if path.is_file()}
    if known != present:
        yield f"conffiles has {sorted(known)}, /etc {sorted(present)}"


def list_faults(deb, tree):
    document = json.loads(pathlib.Path(f"{deb}.spdx.json").read_text())
    yield from check_spdx.faults(document)
    by_id = {package["SPDXID"]: package["name"] for package in document["packages"]}
    package = field(deb, "Package")
    text = (tree / f"usr/share/doc/{package}/copyright").read_text()
    for relationship in document["relationships"]:
        name = by_id[relationship["relatedSpdxElement"]]
        if relationship["relationshipType"] in ("STATIC_LINK", "CONTAINS") and not re.search(
                rf"^(Comment: {re.escape(name)}| ?.*node_modules/{re.escape(name)}/\*)$", text,
                re.MULTILINE):
            yield f"its copyright does not name {name}"


def faults_of(deb, component, owners):
    with tempfile.TemporaryDirectory() as folder:
        tree = pathlib.Path(folder)
        run("dpkg-deb", "--raw-extract", deb, tree / "tree")
        tree /= "tree"
        files, expected = files_of(tree), expected_files(component)
        yield from (f"lacks {file}" for file in sorted(expected - files))
        yield from (f"has {file}" for file in sorted(files - expected))
        for file in files:
            if owners.setdefault(file, deb.name) != deb.name:
                yield f"has {file}, as {owners[file]} does"
        yield from control_faults(deb, tree, contents.version())
        yield from list_faults(deb, tree)
        for file in sorted(tree.rglob("*")):
            if file.is_file() and not file.is_symlink() and file.read_bytes()[:4] == b"\x7fELF":
                yield from (f"{file.name} {fault}" for fault in hardening_faults(file))


def main(arguments):
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 0 if arguments == ["--help"] else 2
    owners, found = {}, []
    debs = {field(deb, "Package"): deb for deb in sorted(pathlib.Path(arguments[0]).glob("*.deb"))}
    if set(debs) != set(contents.PACKAGES.values()):
        found.append(f"the packages are {', '.join(debs)}")
    for component, package in contents.PACKAGES.items():
        if package in debs:
            found += [f"{package} {fault}" for fault in faults_of(debs[package], component, owners)]
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


sys.exit(main(sys.argv[1:]))
