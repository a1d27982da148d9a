"""One server for all tests of a process, with a family of the first frames of two_drops."""

import atexit
import functools
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import time

import liquidblend

CHECKOUT = pathlib.Path(__file__).resolve().parents[3]
DATA = CHECKOUT / "tests" / "data"
PROGRAMS = pathlib.Path(os.environ["LIQUIDBLEND_BINARY_DIR"])
PATIENCE = float(os.environ.get("LIQUIDBLEND_E2E_PATIENCE", "180"))
NUM_FRAMES = 24
# One iteration is enough for what is tested here.
FAST = {"max_iterations": 1}


def copy_frames(source, destination, numbers):
    """Copies the meshes and velocities of some frames, and the description."""
    destination.mkdir(parents=True)
    shutil.copy(source / "meta.json", destination)
    for number in numbers:
        for name in (f"fluid_mesh_{number:04d}.bobj.gz", f"lVelMesh_{number:04d}.uni"):
            shutil.copy(source / name, destination)


class Server:
    """A server on free ports with a folder of its own, until stop() or the end of the process."""

    def __init__(self, *flags):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="liquidblend-python-"))
        atexit.register(self.stop)
        self._output = open(self.folder / "server.out", "w+")
        self._server = subprocess.Popen(
            [PROGRAMS / "liquidblend-server", "--data", self.folder / "data"]
            + ["--listen", "127.0.0.1:0", "--http", "127.0.0.1:0", *flags],
            stdout=self._output,
            stderr=subprocess.STDOUT,
        )
        self.target = self._wait_for_target()

    @property
    def pid(self):
        return self._server.pid

    def stop(self):
        """Again: nothing."""
        atexit.unregister(self.stop)
        self._server.terminate()
        try:
            self._server.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self._server.kill()
            self._server.wait()
        self._output.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _wait_for_target(self):
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline and self._server.poll() is None:
            text = (self.folder / "server.out").read_text()
            found = re.search(r"^listening on (\S+)$", text, re.MULTILINE)
            if found and "http on" in text:
                return found.group(1)
            time.sleep(0.05)
        text = (self.folder / "server.out").read_text()
        raise RuntimeError(f"the server does not start:\n{text}")


class Service(Server):
    """A server with the family two_drops of the animations drops_a and drops_b."""

    def __init__(self):
        super().__init__()
        self.client = liquidblend.connect(self.target)
        self._register()

    def run(self, *arguments):
        """The command line; returns what it prints."""
        command = [PROGRAMS / "liquidblend", "--server", self.target, *map(str, arguments)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    def _register(self):
        jobs = []
        for name in "AB":
            frames = self.folder / name
            copy_frames(DATA / "two_drops" / name, frames, range(1, NUM_FRAMES + 1))
            jobs.append(self.client.import_animation(f"drops_{name.lower()}", frames))
        for job in jobs:
            job.wait(timeout=PATIENCE)
        job = self.client.register("two_drops", "drops_a", "drops_b", options=FAST)
        job.wait(timeout=PATIENCE)


@functools.lru_cache(maxsize=None)
def service():
    return Service()


def canonical(positions, triangles):
    """The triangles as corners' positions, in an order that does not depend on the file's."""
    import numpy as np

    corners = [tuple(map(tuple, triangle)) for triangle in positions[triangles].tolist()]
    # Each begins with its least corner; the direction stays.
    turned = [min((a, b, c), (b, c, a), (c, a, b)) for a, b, c in corners]
    return np.array(sorted(turned))


def read_ply(path):
    """The floats of vertices by name, and the triangles."""
    import numpy as np

    data = pathlib.Path(path).read_bytes()
    header, end, body = data.partition(b"end_header\n")
    assert end, "no header"
    lines = header.decode().splitlines()
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    vertices = np.frombuffer(body, [(name, "<f4") for name in names], counts[0])
    faces = np.frombuffer(body, [("n", "u1"), ("v", "<u4", 3)], counts[1], vertices.nbytes)
    assert (faces["n"] == 3).all()
    return vertices, faces["v"]
