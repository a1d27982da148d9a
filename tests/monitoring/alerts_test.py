#!/usr/bin/env python3
"""Each alert of deploy/monitoring fires and clears for real, by a fault that is made and mended.

  alerts_test.py BUILD_DIRECTORY [UNITTEST_ARGUMENT..]
One Prometheus with the rules of deploy/monitoring watches them all, but the durations of the rules
are divided by 60, the queue counts as slow after 20 s instead of half an hour, and the largest class
of workers has 1 GiB. Each test starts servers of its own. tests/monitoring.sh runs this.
Exit: 0 if all do; 1 if not; 2 usage; 77 if Prometheus is missing.
"""

import concurrent.futures
import itertools
import resource
import shutil
import signal
import socket
import time
import unittest

import prometheus
import stack

FACTOR = 60
PATIENCE = 180.0
NUM_FRAMES = 16
REGISTER = ("register", "two_drops", "--source", "drops_a", "--target", "drops_b")
MAX_CONNECTIONS = 1000  # of the HTTP port


def faster(rules):
    rules = prometheus.shorten(rules, FACTOR)
    for pattern, replacement in [
        ("queue_wait:max5m > 1800", "queue_wait:max5m > 20"),
        ('memory="64GiB"', 'memory="1GiB"'),
    ]:
        rules = rules.replace(pattern, replacement)
    return rules


class AlertsTest(unittest.TestCase):
    build = None

    @classmethod
    def setUpClass(cls):
        cls.root = stack.make_folder()
        cls.addClassCleanup(shutil.rmtree, cls.root, ignore_errors=True)
        cls.prometheus = prometheus.Prometheus(cls.root / "prometheus", faster)
        cls.addClassCleanup(cls.prometheus.end)
        for name in "AB":
            source = stack.DATA / "two_drops" / name
            stack.copy_frames(source, cls.root / name, NUM_FRAMES)

    def setUp(self):
        self.job = "liquidblend-" + self._testMethodName.removeprefix("test_").replace("_", "-")
        self.folder = stack.make_folder(self.root)
        self.addCleanup(self.prometheus.watch, self.job)

    def make_store(self):
        return stack.Store(self.folder)

    def make_shared_store(self):
        store = stack.SharedStore(self.folder, self.build)
        self.addCleanup(store.end)
        return store

    def start_server(self, store, *flags, name="server", **more):
        folder = self.folder / name
        folder.mkdir()
        server = stack.Server(folder, self.build, store, *flags, **more)
        self.addCleanup(server.stop)
        return server

    def start_worker(self, store, name, *flags):
        worker = stack.start_worker(self.folder, self.build, store, name, *flags)
        self.addCleanup(worker.end)
        return worker

    def watch(self, *servers):
        self.prometheus.watch(self.job, *(server.http for server in servers))
        stack.await_true(
            lambda: len(self.prometheus.query(f'up{{job="{self.job}"}}')) == len(servers),
            "a scrape",
        )

    def import_animations(self, server):
        for name in "AB":
            server.run("import", f"drops_{name.lower()}", self.root / name)

    def register(self, server):
        # One iteration is not enough for a good verdict (status 6).
        server.run(*REGISTER, "--iterations", "1", "--wait", may_fail=True)

    def values(self, series):
        return self.prometheus.query(f'{series}{{job="{self.job}"}}')

    def await_alert(self, name, meanwhile=lambda: None):
        """Waits until it fires, and goes on with what makes it fire."""
        start = time.monotonic()

        def fires():
            meanwhile()
            return name in self.prometheus.firing(self.job)

        stack.await_true(
            fires, lambda: f"{name}; firing: {self.prometheus.firing(self.job)}", PATIENCE
        )
        print(f"\n  {name} fires after {time.monotonic() - start:.0f} s", end="", flush=True)

    def await_silence(self, *names):
        start = time.monotonic()
        stack.await_true(
            lambda: not self.prometheus.firing(self.job).intersection(names),
            lambda: f"the end of {names}; firing: {self.prometheus.firing(self.job)}",
            PATIENCE,
        )
        seconds = time.monotonic() - start
        print(f"\n  {', '.join(names)}: clear after {seconds:.0f} s", end="", flush=True)

    def assert_quiet(self, *names):
        self.assertFalse(self.prometheus.firing(self.job).intersection(names))

    # ---- the service

    def test_servers_are_killed(self):
        servers = []
        for name in ("one", "two"):
            store = stack.Store(self.folder / f"store-{name}")
            servers.append(self.start_server(store, "--workers", "0", name=name))
        self.watch(*servers)
        self.assert_quiet("LiquidblendServerDown", "LiquidblendServiceDown")
        servers[0].stop(signal.SIGKILL)
        self.await_alert("LiquidblendServerDown")
        self.assert_quiet("LiquidblendServiceDown")
        servers[1].stop(signal.SIGKILL)
        self.await_alert("LiquidblendServiceDown")
        for server in servers:
            server.start()
        self.await_silence("LiquidblendServerDown", "LiquidblendServiceDown")
        # Targets as of a name in DNS that has lost its addresses.
        self.prometheus.watch(self.job)
        self.await_alert("LiquidblendServiceDown")
        self.watch(*servers)
        self.await_silence("LiquidblendServiceDown")

    def test_a_server_restarts(self):
        server = self.start_server(self.make_store(), "--workers", "0")
        self.watch(server)

        def start_time():
            return self.values("process_start_time_seconds")

        for _ in range(3):
            before = start_time()
            server.stop(signal.SIGKILL)
            server.start()
            stack.await_true(lambda: start_time() not in ([], before), "a scrape")
        self.await_alert("LiquidblendServerRestarts")
        self.await_silence("LiquidblendServerRestarts")

    def test_the_database_is_away(self):
        store = self.make_shared_store()
        server = self.start_server(store, "--workers", "0")
        self.watch(server)
        stack.await_true(lambda: server.get("/v1/families")[0] == 200, "an answer")
        self.assert_quiet("LiquidblendErrors", "LiquidblendStoreUnreachable")
        store.stop_postgres()
        self.await_alert("LiquidblendStoreUnreachable")
        self.await_alert("LiquidblendErrors", lambda: server.get("/v1/families"))
        store.start_postgres()
        stack.await_true(lambda: server.get("/v1/families")[0] == 200, "the database's return")
        self.await_silence("LiquidblendStoreUnreachable", "LiquidblendErrors")

    def test_frames_take_long(self):
        flags = ("--threads", "1", "--frame-cache", "0", "--max-waiting-cells", "200000000")
        server = self.start_server(self.make_store(), *flags)
        self.watch(server)
        self.import_animations(server)
        self.register(server)
        numbers = itertools.count()

        def ask(_):
            path = f"/v1/families/two_drops/frame.drc?weights={next(numbers) % 997 / 997}&time=0.5"
            return server.get(path + "&smoothing_passes=32")[0]

        def play(_):
            server.run("stream", "two_drops", "--seconds", "8", "--fps", "120", "--sweep")

        def load(num_calls, stream=False):
            with concurrent.futures.ThreadPoolExecutor(num_calls + 2) as pool:
                streams = pool.map(play, range(2 if stream else 0))
                answers = list(pool.map(ask, range(2 * num_calls)))
                list(streams)
            return answers

        self.assertEqual(set(load(1)), {200})
        self.assert_quiet("LiquidblendFramesSlow", "LiquidblendFramesDropped")
        self.await_alert("LiquidblendFramesSlow", lambda: load(96))
        self.await_alert("LiquidblendFramesDropped", lambda: load(24, stream=True))
        self.await_silence("LiquidblendFramesSlow", "LiquidblendFramesDropped")

        server.restart(*flags[:-1], "200000")
        self.await_alert("LiquidblendFramesRefused", lambda: load(96))
        self.await_silence("LiquidblendFramesRefused")

    def test_too_many_connections_are_open(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 2 * MAX_CONNECTIONS + 200), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        server = self.start_server(self.make_store(), "--workers", "0")
        self.watch(server)
        host, port = server.http.split(":")
        sockets = []
        self.addCleanup(lambda: [connection.close() for connection in sockets])

        # Prometheus keeps its connection; the server closes idle ones after a while.
        def connect():
            while sockets and len(sockets) >= MAX_CONNECTIONS + 50:
                sockets.pop(0).close()
            for _ in range(50):
                sockets.append(socket.create_connection((host, int(port)), timeout=10))

        for _ in range(MAX_CONNECTIONS // 50):
            connect()
        self.await_alert("LiquidblendConnectionsRefused", connect)
        while sockets:
            sockets.pop().close()
        self.await_silence("LiquidblendConnectionsRefused")

    def test_a_certificate_expires(self):
        stack.make_certificate(self.folder, days=90)
        files = (self.folder / "server.crt", self.folder / "server.key")
        flags = ("--workers", "0", "--tls-cert", files[0], "--tls-key", files[1])
        self.watch(self.start_server(self.make_store(), *flags))
        self.assert_quiet("LiquidblendCertificateExpires")
        stack.make_certificate(self.folder, days=10)
        self.await_alert("LiquidblendCertificateExpires")
        stack.make_certificate(self.folder, days=90)
        self.await_silence("LiquidblendCertificateExpires")

    # ---- the store

    def test_a_disk_fills(self):
        server = self.start_server(self.make_store(), "--workers", "0", "--disk-reserve", "0")
        self.watch(server)
        self.assert_quiet("LiquidblendDiskNearlyFull", "LiquidblendDiskFull")
        # Free space as if others had filled the disk: so much is left above the reserve.
        usage = shutil.disk_usage(self.folder)
        server.restart("--workers", "0", "--disk-reserve", usage.free - usage.total // 20)
        self.await_alert("LiquidblendDiskNearlyFull")
        self.assert_quiet("LiquidblendDiskFull")
        server.restart("--workers", "0", "--disk-reserve", usage.total)
        self.await_alert("LiquidblendDiskFull")
        server.restart("--workers", "0", "--disk-reserve", "0")
        self.await_silence("LiquidblendDiskNearlyFull", "LiquidblendDiskFull")

    def test_owners_come_near_their_limits(self):
        token = stack.make_token(self.folder, self.build, "studio", {})
        stack.set_limits(self.folder, {}, anonymous=True)  # for Prometheus, which has no token here
        flags = ("--tokens", self.folder / "tokens.json")
        server = self.start_server(self.make_store(), *flags)
        server.client_flags = ["--token-file", self.folder / "studio.token"]
        server.headers = {"Authorization": f"Bearer {token}"}
        self.watch(server)
        self.import_animations(server)

        def stored():
            return sum(value for _, value in self.values("liquidblend_owner_stored_bytes"))

        stack.await_true(lambda: stored() > 0, "what the owner has stored", PATIENCE)
        limit = int(stored() / 0.95)
        server.restart(*flags, "--workers", "0", "--max-stored", limit)
        limits = {"max_stored_bytes": int(1.01 * limit), "max_queued_jobs": 1}
        stack.set_limits(self.folder, limits)
        operation = server.submit(*REGISTER)
        self.await_alert("LiquidblendStoreNearlyFull")
        self.await_alert("LiquidblendOwnerStoredNearLimit")
        self.await_alert("LiquidblendOwnerQueueNearLimit")
        server.run("cancel", operation)
        server.run("delete", "animations/drops_a")
        self.await_silence(
            "LiquidblendStoreNearlyFull",
            "LiquidblendOwnerStoredNearLimit",
            "LiquidblendOwnerQueueNearLimit",
        )

    def test_s3_denies_access(self):
        store = self.make_shared_store()
        store.set_s3_fault("denied")
        flags = ("--workers", "0", "--collect-every", "1s")
        self.watch(self.start_server(store, *flags))
        self.start_worker(store, "worker")
        self.await_alert("LiquidblendStoreUnreachable")
        self.await_alert("LiquidblendWorkersRefused")
        self.await_alert("LiquidblendCollectionsFail")
        store.set_s3_fault("none")
        self.await_silence(
            "LiquidblendStoreUnreachable",
            "LiquidblendWorkersRefused",
            "LiquidblendCollectionsFail",
        )

    # ---- workers

    def test_there_is_no_worker(self):
        store = self.make_store()
        server = self.start_server(store, "--workers", "0")
        self.watch(server)
        server.run("import", "drops_a", self.root / "A", "--no-wait")
        self.await_alert("LiquidblendNoWorkers")
        self.await_alert("LiquidblendQueueSlow")
        self.start_worker(store, "worker")
        self.await_silence("LiquidblendNoWorkers", "LiquidblendQueueSlow")

    def test_a_job_is_too_large(self):
        store = self.make_store()
        server = self.start_server(store, "--workers", "0")
        self.watch(server)
        self.start_worker(store, "small", "--memory", "64MiB")
        server.run("import", "drops_a", self.root / "A", "--no-wait")
        self.await_alert("LiquidblendJobTooLarge")
        self.assert_quiet("LiquidblendNoWorkers")
        self.start_worker(store, "large")
        self.await_silence("LiquidblendJobTooLarge")

    def test_a_job_fits_no_class(self):
        store = self.make_store()
        server = self.start_server(store, "--workers", "0")
        self.watch(server)
        worker = self.start_worker(store, "worker")
        self.import_animations(server)
        worker.end()
        operation = server.submit(*REGISTER, "--spacing", "0.25")  # some 5 GB
        self.await_alert("LiquidblendJobFitsNoClass")
        self.assert_quiet("LiquidblendNoWorkers")
        server.run("cancel", operation)
        self.await_silence("LiquidblendJobFitsNoClass")

    def test_s3_is_away_while_a_job_runs(self):
        store = self.make_shared_store()
        server = self.start_server(store, "--workers", "0")
        self.watch(server)
        first = self.start_worker(store, "first")
        self.import_animations(server)
        first.end()
        # Its cache has none of the animations.
        self.start_worker(store, "second")
        ready = f'liquidblend_workers{{job="{self.job}", state="ready"}} == 2'
        stack.await_true(lambda: self.prometheus.query(ready), "the second worker")
        store.set_s3_fault("unavailable")
        server.submit(*REGISTER)
        self.await_alert("LiquidblendJobsPaused")
        store.set_s3_fault("none")
        self.await_silence("LiquidblendJobsPaused")
        self.assert_quiet("LiquidblendJobsFail")

    def test_workers_die_at_a_job(self):
        store = self.make_store()
        server = self.start_server(
            *(store, "--worker-lease", "1s"),
            environment={"LIQUIDBLEND_FAULT_POINT": "publish.before_commit"},
        )
        self.watch(server)
        self.assert_quiet("LiquidblendJobsFail", "LiquidblendWorkersLost")
        server.run("import", "drops_a", self.root / "A", may_fail=True)
        self.await_alert("LiquidblendJobsFail")
        self.await_alert("LiquidblendWorkersLost")
        self.await_silence("LiquidblendJobsFail", "LiquidblendWorkersLost")


if __name__ == "__main__":
    stack.run_tests(AlertsTest, __doc__)
