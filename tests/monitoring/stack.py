"""Programs that the tests of deploy/monitoring start: servers, workers, their stores."""

import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

CHECKOUT = pathlib.Path(__file__).resolve().parents[2]
DATA = CHECKOUT / "tests" / "data"
PATIENCE = float(os.environ.get("LIQUIDBLEND_E2E_PATIENCE", "180"))
PROMETHEUS = shutil.which("prometheus")


def await_true(condition, what, patience=PATIENCE):
    """Waits until condition() holds. `what` names it for the error, or is a function that does."""
    deadline = time.monotonic() + patience
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {patience} s: {what() if callable(what) else what}")
        time.sleep(0.1)


def free_port():
    return int(subprocess.check_output([CHECKOUT / "tests" / "free_ports.sh", "1"]))


def get(url, headers=()):
    """The status and the body."""
    try:
        request = urllib.request.Request(url, headers=dict(headers))
        with urllib.request.urlopen(request, timeout=PATIENCE) as reply:
            return reply.status, reply.read().decode(errors="replace")
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode(errors="replace")


class Program:
    """A child process, whose output goes to a file below `folder`."""

    def __init__(self, folder, name, command, environment=(), stdin=subprocess.DEVNULL):
        self.log = folder / f"{name}.log"
        with open(self.log, "a") as log:
            self.process = subprocess.Popen(
                [str(word) for word in command],
                stdin=stdin,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **dict(environment)},
                text=True,
            )

    def await_line(self, pattern):
        """The match of a line of the output."""

        def found():
            assert self.process.poll() is None, f"has ended:\n{self.log.read_text()}"
            return re.search(pattern, self.log.read_text(), re.MULTILINE)

        await_true(found, lambda: f"{pattern} in\n{self.log.read_text()}")
        return found()

    def end(self, number=signal.SIGTERM):
        """Ends it and waits; again: nothing."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            self.process.wait(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class Store:
    """Where a store is: flags and environment of its programs."""

    def __init__(self, folder):
        self.flags = ["--data", folder / "data"]
        self.environment = {}


class SharedStore:
    """A PostgreSQL of its own, and the fake S3 of the C++ tests."""

    def __init__(self, folder, build):
        self.folder = folder
        self.postgres = None
        self.s3 = Program(folder, "s3", [build / "tests" / "fake_s3"], stdin=subprocess.PIPE)
        endpoint = self.s3.await_line(r"^(http://\S+)$").group(1)
        self.start_postgres()
        self.flags = ["--blobs", "s3://bucket/store", "--cache", folder / "cache"]
        self.environment = {
            "LIQUIDBLEND_STORE": f"postgresql://liquidblend@/postgres?host={folder}/postgres/sock",
            "AWS_ENDPOINT_URL": endpoint,
            "AWS_ACCESS_KEY_ID": "key",
            "AWS_SECRET_ACCESS_KEY": "secret",
        }

    def start_postgres(self):
        script = CHECKOUT / "tests" / "postgres.sh"
        self.postgres = Program(
            self.folder, "postgres", [script, self.folder / "postgres", "fsync=off"]
        )
        socket_file = self.folder / "postgres" / "sock" / ".s.PGSQL.5432"
        await_true(socket_file.exists, "PostgreSQL's socket")

    def stop_postgres(self):
        self.postgres.end(signal.SIGINT)

    def set_s3_fault(self, name):
        """A fault of all requests from now on (tests/monitoring/fake_s3.cc), or "none"."""
        self.s3.process.stdin.write(name + "\n")
        self.s3.process.stdin.flush()
        self.s3.await_line(f"^{name}$")

    def end(self):
        self.stop_postgres()
        self.s3.process.stdin.close()
        self.s3.end()


class Server:
    """A server on ports that stay the same when it starts again."""

    def __init__(self, folder, build, store, *flags, environment=()):
        self.folder = folder
        self.build = build
        self.store = store
        self.flags = list(flags)
        self.environment = dict(environment)
        self.grpc = f"127.0.0.1:{free_port()}"
        self.http = f"127.0.0.1:{free_port()}"
        self.client_flags = []
        self.headers = {}
        self.program = None
        self.start()

    def start(self):
        log = self.folder / "server.log"
        num_starts = log.read_text().count("http on") if log.exists() else 0
        self.program = Program(
            self.folder,
            "server",
            [self.build / "bin" / "liquidblend-server", *self.store.flags]
            + ["--listen", self.grpc, "--http", self.http, *self.flags],
            {**self.store.environment, **self.environment},
        )

        def is_up():
            text = log.read_text()
            assert self.program.process.poll() is None, f"the server has ended:\n{text}"
            return text.count("http on") > num_starts

        await_true(is_up, "the server's start")

    def stop(self, number=signal.SIGTERM):
        self.program.end(number)

    def restart(self, *flags):
        self.stop()
        self.flags = list(flags)
        self.start()

    def run(self, *arguments, may_fail=False):
        """The command line."""
        command = [self.build / "bin" / "liquidblend", "--server", self.grpc, *self.client_flags]
        done = subprocess.run(
            [str(word) for word in [*command, *arguments]], capture_output=True, text=True
        )
        assert may_fail or done.returncode == 0, f"{arguments}: {done.stdout}{done.stderr}"
        return done.stdout

    def submit(self, *arguments):
        """The command line's name of the operation that it has begun."""
        return json.loads(self.run("--json", *arguments))["name"]

    def get(self, path):
        return get(f"http://{self.http}{path}", self.headers)


def start_worker(folder, build, store, name, *flags, environment=()):
    """A worker with a cache of its own, if the store has one."""
    words = list(store.flags)
    if "--cache" in words:
        words[words.index("--cache") + 1] = folder / f"cache-{name}"
    return Program(
        folder,
        name,
        [build / "bin" / "liquidblend-worker", *words, "--lease", "1s", *flags],
        {**store.environment, **dict(environment)},
    )


def copy_frames(source, destination, num_frames):
    """Copies the first meshes and velocities of a simulation, and its description."""
    destination.mkdir(parents=True)
    shutil.copy(source / "meta.json", destination)
    for number in range(1, num_frames + 1):
        for name in (f"fluid_mesh_{number:04d}.bobj.gz", f"lVelMesh_{number:04d}.uni"):
            shutil.copy(source / name, destination)


def make_certificate(folder, days):
    """Writes server.crt and server.key, for 127.0.0.1."""
    for name in ("server.key", "server.crt"):
        (folder / name).unlink(missing_ok=True)
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256"]
        + ["-nodes", "-days", str(days), "-subj", "/CN=localhost"]
        + ["-addext", "subjectAltName=IP:127.0.0.1"]
        + ["-keyout", folder / "server.key", "-out", folder / "server.crt"],
        check=True,
        capture_output=True,
    )


def make_token(folder, build, name, limits):
    """Writes tokens.json with one principal, and NAME.token; returns the token."""
    made = subprocess.run(
        [build / "bin" / "liquidblend-server", "--make-token", name]
        + ["--scopes", "frames,write,register"],
        check=True,
        capture_output=True,
        text=True,
    )
    token = made.stderr.splitlines()[0]
    (folder / f"{name}.token").write_text(token + "\n")
    (folder / "tokens.json").write_text(made.stdout)
    set_limits(folder, limits)
    return token


def set_limits(folder, limits, anonymous=False):
    """Gives the one principal of tokens.json these limits, and anyone the right to look."""
    tokens = json.loads((folder / "tokens.json").read_text())
    tokens["principals"][0]["limits"] = limits
    if anonymous:
        tokens["anonymous"] = {"scopes": ["frames"]}
    (folder / "tokens.new").write_text(json.dumps(tokens))
    (folder / "tokens.new").rename(folder / "tokens.json")


def make_folder(parent=None):
    """A new folder that PostgreSQL's own user may enter."""
    folder = pathlib.Path(tempfile.mkdtemp(prefix="liquidblend-", dir=parent))
    folder.chmod(0o755)
    return folder


def run_tests(test_case, documentation):
    """The main program of a file of tests: BUILD_DIRECTORY [UNITTEST_ARGUMENT..]."""
    name = pathlib.Path(sys.argv[0]).name
    if sys.argv[1:] == ["--help"]:
        print(documentation)
        return
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        print(documentation, file=sys.stderr)
        sys.exit(2)
    if PROMETHEUS is None:
        print(f"{name}: no prometheus: run deploy/install-deps.sh", file=sys.stderr)
        sys.exit(77)
    test_case.build = pathlib.Path(sys.argv[1]).resolve()
    unittest.main(argv=[name, *sys.argv[2:]], verbosity=2)
