#!/usr/bin/env python3
"""Every panel, variable, rule and alert of deploy/monitoring has data from a service that runs.

  panels_test.py BUILD_DIRECTORY [UNITTEST_ARGUMENT..]
Starts a server with a worker, TLS and tokens, works with it, and a Prometheus that watches it. An
alert must have data without its threshold.
Exit: 0 if all have; 1 if not; 2 usage; 77 if Prometheus is missing.
"""

import json
import math
import re
import shutil
import threading
import unittest

import prometheus
import stack

NUM_FRAMES = 16
JOB = "liquidblend"
# What Grafana puts in for the variables of a dashboard.
VARIABLES = {"$job": JOB, "$instance": ".*", "$family": ".*", "$__rate_interval": "30s"}
# The comparison at the end of an alert.
THRESHOLD = re.compile(r"\s(==|<=|>=|<|>)\s[0-9.* ]+$")


def with_values(expression):
    for name, value in VARIABLES.items():
        expression = expression.replace(name, value)
    assert "$" not in expression, expression
    return expression


def dashboards():
    return sorted((prometheus.DEPLOY / "grafana").glob("*.json"))


def queries_of(dashboard):
    """(title of the panel, query) of a dashboard."""
    for panel in json.loads(dashboard.read_text())["panels"]:
        for target in panel.get("targets", []):
            yield f"{dashboard.stem}: {panel['title']} {target['refId']}", target["expr"]


class Service:
    """A server with some work behind it, that Prometheus has watched from the beginning."""

    def __init__(self, build):
        self.folder = stack.make_folder()
        try:
            self._start(build)
        except BaseException:
            self.end()
            raise

    def _start(self, build):
        stack.make_certificate(self.folder, days=90)
        limits = {"max_stored_bytes": 10**12, "max_queued_jobs": 50}
        token = stack.make_token(self.folder, build, "studio", limits)
        self.server = stack.Server(
            self.folder,
            build,
            stack.Store(self.folder),
            *("--tls-cert", self.folder / "server.crt", "--tls-key", self.folder / "server.key"),
            *("--tokens", self.folder / "tokens.json", "--max-stored", "1TiB"),
            *("--collect-every", "1s"),
        )
        token_file = self.folder / "studio.token"
        self.server.client_flags = ["--tls-ca", self.folder / "server.crt"]
        self.server.client_flags += ["--token-file", token_file]
        self.server.headers = {"Authorization": f"Bearer {token}"}
        self.prometheus = prometheus.Prometheus(self.folder / "prometheus", token_file=token_file)
        self.prometheus.watch(JOB, self.server.http)
        stack.await_true(lambda: self.prometheus.query(f'up{{job="{JOB}"}} == 1'), "a scrape")
        self._make_jobs()
        self.is_over = threading.Event()
        self.client = threading.Thread(target=self._ask_for_frames)
        self.client.start()

    def _make_jobs(self):
        server = self.server
        for name in "AB":
            frames = self.folder / name
            stack.copy_frames(stack.DATA / "two_drops" / name, frames, NUM_FRAMES)
            server.run("import", f"drops_{name.lower()}", frames)
        # One iteration is enough here, but not for a good verdict (status 6).
        register = ("register", "two_drops", "--source", "drops_a", "--target", "drops_b")
        server.run(*register, "--iterations", "1", "--wait", may_fail=True)

    def _ask_for_frames(self):
        """A client that goes on, with calls that find nothing among the others: a rate needs calls
        between any two scrapes."""
        while not self.is_over.is_set():
            for path in ("two_drops/frame.drc?weights=0.5&time=0.2", "none"):
                self.server.get(f"/v1/families/{path}")
            self.server.run("stream", "two_drops", "--seconds", "1", "--fps", "24", "--sweep")
            self.server.run("inspect", "none", may_fail=True)

    def end(self):
        if hasattr(self, "client"):
            self.is_over.set()
            self.client.join()
        if hasattr(self, "prometheus"):
            self.prometheus.end()
        if hasattr(self, "server"):
            self.server.stop()
        shutil.rmtree(self.folder, ignore_errors=True)


class PanelsTest(unittest.TestCase):
    build = None

    @classmethod
    def setUpClass(cls):
        cls.service = Service(cls.build)
        cls.addClassCleanup(cls.service.end)
        cls.prometheus = cls.service.prometheus

    def await_data(self, expression, what):
        """Waits for a number; NaN is none."""

        def has_data():
            return any(not math.isnan(value) for _, value in self.prometheus.query(expression))

        stack.await_true(has_data, f"data for {what}: {expression}", patience=30)

    def test_panels_have_data(self):
        num_queries = 0
        for dashboard in dashboards():
            for what, query in queries_of(dashboard):
                num_queries += 1
                with self.subTest(what):
                    self.await_data(with_values(query), what)
        self.assertGreater(num_queries, 60)

    def test_variables_have_values(self):
        for dashboard in dashboards():
            for variable in json.loads(dashboard.read_text())["templating"]["list"]:
                if variable["type"] != "query":
                    continue
                with self.subTest(f"{dashboard.stem}: {variable['name']}"):
                    form = r"label_values\((.*), (\w+)\)"
                    selector, label = re.fullmatch(form, variable["query"]).groups()
                    self.assertTrue(self.prometheus.label_values(label, with_values(selector)))

    def test_recorded_series_have_data(self):
        recorded = [rule for rule in self.prometheus.rules() if rule["type"] == "recording"]
        self.assertTrue(recorded)
        for rule in recorded:
            with self.subTest(rule["name"]):
                self.await_data(rule["name"], rule["name"])
                self.assertEqual(rule.get("lastError", ""), "")

    def test_alerts_have_data_and_do_not_fire(self):
        alerts = [rule for rule in self.prometheus.rules() if rule["type"] == "alerting"]
        self.assertTrue(alerts)
        for rule in alerts:
            with self.subTest(rule["name"]):
                self.assertRegex(rule["query"], THRESHOLD)
                self.await_data(THRESHOLD.sub("", rule["query"]), rule["name"])
                self.assertNotEqual(rule["state"], "firing", rule["alerts"])


if __name__ == "__main__":
    stack.run_tests(PanelsTest, __doc__)
