"""The files of each component of `cmake --install`, which are those of each Debian package."""

import pathlib

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
PACKAGES = {
    "server": "liquidblend-server",
    "worker": "liquidblend-worker",
    "client": "liquidblend-client",
    "library": "libliquidblend1",
    "dev": "libliquidblend-dev",
    "python3": "python3-liquidblend",
    "examples": "liquidblend-examples",
    "documentation": "liquidblend-doc",
}


def version():
    """The project's, which CMakeLists.txt has."""
    line = next(line for line in (CHECKOUT / "CMakeLists.txt").read_text().splitlines()
                if line.startswith("project("))
    return line.split()[2]


def files_below(folder, pattern="*"):
    """Relative names of the files in a folder of the repository and its folders."""
    root = CHECKOUT / folder
    return {str(file.relative_to(root)) for file in root.rglob(pattern)
            if file.is_file() and "__pycache__" not in file.parts}


def below(prefix, names):
    return {f"{prefix}/{name}" for name in names}


def contents(libdir="lib"):
    """Component -> its files, from the prefix on; /etc as etc/. Without manual pages."""
    files = {
        "server": {
            "bin/liquidblend-admin", "bin/liquidblend-server", "etc/liquidblend/server.env",
            "lib/systemd/system/liquidblend-server.service",
        },
        "worker": {
            "bin/liquidblend-worker", "etc/liquidblend/worker.env",
            "lib/systemd/system/liquidblend-worker@.service", "lib/sysusers.d/liquidblend.conf",
            "share/doc/liquidblend-worker/examples/memory.conf",
        },
        "client": {
            "bin/liquidblend", f"{libdir}/liquidblend/liquidblend_vdb.so",
            "share/bash-completion/completions/liquidblend",
        },
        "library": {f"{libdir}/libliquidblend.so.1", f"{libdir}/libliquidblend.so.1.0.0"},
        "dev": {
            f"{libdir}/libliquidblend.a", f"{libdir}/libliquidblend.so",
            *below("include", files_below("client/include")),
            *below(f"{libdir}/cmake/liquidblend", {
                "liquidblendConfig.cmake", "liquidblendConfigVersion.cmake",
                "liquidblendTargets.cmake", "liquidblendTargets-release.cmake"}),
        },
        "python3": {
            f"lib/python3/dist-packages/liquidblend-{version()}.egg-info",
            "share/liquidblend/liquidblend_blender.zip",
            *below("lib/python3/dist-packages/liquidblend", files_below("client/python/liquidblend")),
        },
        "examples": below("share/liquidblend/examples/two_drops", {
            f"{which}/{name}" for which in ("A", "B")
            for name in files_below(f"tests/data/two_drops/{which}")}),
        "documentation": below("share/doc/liquidblend", files_below("docs")),
    }
    for component, package in PACKAGES.items():
        files[component] |= below(f"share/doc/{package}", {"copyright", "changelog.Debian.gz"})
    for component in ("server", "worker", "library"):
        files[component].add(f"share/lintian/overrides/{PACKAGES[component]}")
    return files
