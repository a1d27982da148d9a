#!/usr/bin/env python3
"""Lists what is in a Debian package or an image, as SPDX 2.3 in JSON.

  sbom.py deb FILE.deb OUT.spdx.json [--build BUILD] [--programs bin/NAME ..] [--npm LOCK[:NAME]]..
  sbom.py image NAME VERSION OUT.spdx.json --root ROOT [--npm LOCK[:NAME]]..

deb    the package, the packages that it depends on, with the versions of this machine (none if
       they are not installed), and those whose headers or archives are compiled in (of programs
       of BUILD, which ninja made), but for compiler, C library and kernel
image  NAME, and all packages of ROOT: its var/lib/dpkg/status and usr/share/doc/*/copyright
--npm  packages of a package-lock.json that are in it: NAME alone, or all that are not for
       development

Licences are those of /usr/share/doc/PACKAGE/copyright where that can be parsed, otherwise
NOASSERTION. SOURCE_DATE_EPOCH says when the list was made. The same input gives the same bytes.
Exit: 0 done; 1 something is missing; 2 usage.
"""

import argparse
import hashlib
import json
import pathlib
import subprocess

import debian_packages
import spdx


def npm_packages(argument):
    """(name, entry of the lock) of packages in a package-lock.json, LOCK or LOCK:NAME."""
    lock, _, only = argument.partition(":")
    for path, entry in json.loads(pathlib.Path(lock).read_text())["packages"].items():
        name = path.rpartition("node_modules/")[2]
        if name and (name == only if only else not entry.get("dev")):
            yield name, entry


def add_npm(document, root, arguments):
    for argument in arguments:
        packages = list(npm_packages(argument))
        if not packages:
            raise SystemExit(f"sbom.py: no package {argument}")
        for name, entry in packages:
            document.relate(root, "CONTAINS", document.add_npm(name, entry))


def write_deb(arguments):
    installed = debian_packages.Installed(pathlib.Path("/"))
    fields = debian_packages.fields_of_deb(arguments.file)
    file = pathlib.Path(arguments.file)
    document = spdx.Document(file.name)
    root = document.add_root(fields["Package"], fields["Version"], {
        "packageFileName": file.name,
        "checksums": [{"algorithm": "SHA256",
                       "checksumValue": hashlib.sha256(file.read_bytes()).hexdigest()}],
        "primaryPackagePurpose": "INSTALL",
        "externalRefs": [spdx.purl(f"pkg:deb/liquidblend/{fields['Package']}@{fields['Version']}"
                                   f"?arch={fields['Architecture']}")],
    })
    sources = set()
    for names in debian_packages.dependencies(fields):
        package = next(filter(None, map(installed.find, names)), None)
        if "liquidblend" in names[0]:
            other = document.add_named(names[0], "Apache-2.0", fields["Version"])
        elif package:
            sources.add(package.source)
            other = document.add_debian(package)
        else:
            other = document.add_named(names[0], "NOASSERTION")
        document.relate(root, "DEPENDS_ON", other)
    if arguments.build:
        for package in installed.compiled_in(arguments.build, arguments.programs):
            if package.source not in sources:  # otherwise its library is a dependency
                document.relate(root, "STATIC_LINK", document.add_debian(package))
    add_npm(document, root, arguments.npm)
    return document


def write_image(arguments):
    document = spdx.Document(arguments.name)
    root = document.add_root(arguments.name, arguments.version,
                             {"primaryPackagePurpose": "CONTAINER"})
    packages = list(debian_packages.Installed(arguments.root))
    if not packages:
        raise SystemExit(f"sbom.py: no packages in {arguments.root}")
    for package in packages:
        document.relate(root, "CONTAINS", document.add_debian(package))
    add_npm(document, root, arguments.npm)
    return document


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(required=True)
    deb = kinds.add_parser("deb")
    deb.add_argument("file")
    deb.add_argument("out", type=pathlib.Path)
    deb.add_argument("--build", type=pathlib.Path)
    deb.add_argument("--programs", nargs="+", default=[])
    deb.set_defaults(write=write_deb)
    image = kinds.add_parser("image")
    image.add_argument("name")
    image.add_argument("version")
    image.add_argument("out", type=pathlib.Path)
    image.add_argument("--root", type=pathlib.Path, required=True)
    image.set_defaults(write=write_image)
    for kind in (deb, image):
        kind.add_argument("--npm", action="append", default=[])
    arguments = parser.parse_args()
    try:
        arguments.out.write_text(arguments.write(arguments).text())
    except (OSError, subprocess.CalledProcessError) as error:
        raise SystemExit(f"sbom.py: {error}") from error


main()
