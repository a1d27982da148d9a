"""A Prometheus with the rules of deploy/monitoring, for tests."""

import json
import re
import urllib.error
import urllib.parse

import stack

DEPLOY = stack.CHECKOUT / "deploy" / "monitoring"


def shorten(text, factor):
    """Divides the durations of a rule file, behind `for:` and in `[..]`."""
    unit_ms = {"s": 1000, "m": 60_000, "h": 3_600_000}

    def divided(match):
        milliseconds = int(match.group(2)) * unit_ms[match.group(3)] // factor
        return f"{match.group(1)}{milliseconds}ms"

    return re.sub(r"(for: |\[)(\d+)([smh])\b", divided, text)


class Prometheus:
    """A Prometheus with the configuration and the rules of deploy/monitoring: but its targets are
    those of watch(), and it looks at them four times a second."""

    def __init__(self, folder, change_rules=lambda text: text, token_file=None):
        self.folder = folder
        self.targets = {}
        (folder / "rules").mkdir(parents=True)
        for rules in (DEPLOY / "prometheus" / "rules").glob("*.yml"):
            (folder / "rules" / rules.name).write_text(change_rules(rules.read_text()))
        (folder / "prometheus.yml").write_text(self._configuration(token_file))
        self._write_targets()
        self.url = f"http://127.0.0.1:{stack.free_port()}"
        self.program = stack.Program(
            folder,
            "prometheus",
            [stack.PROMETHEUS, f"--config.file={folder}/prometheus.yml"]
            + [f"--storage.tsdb.path={folder}/tsdb", "--log.level=warn"]
            + [f"--web.listen-address={self.url.removeprefix('http://')}"],
        )
        stack.await_true(self._is_ready, lambda: f"Prometheus:\n{self.program.log.read_text()}")

    def watch(self, job, *addresses):
        """Scrapes these as a deployment; no addresses: forgets it."""
        self.targets[job] = addresses
        self._write_targets()

    def query(self, expression):
        """The samples of an instant query, as (labels, value)."""
        result = self._ask("query", query=expression)["result"]
        return [(sample["metric"], float(sample["value"][1])) for sample in result]

    def label_values(self, label, selector):
        return self._ask(f"label/{label}/values", **{"match[]": selector})

    def rules(self):
        return [rule for group in self._ask("rules")["groups"] for rule in group["rules"]]

    def firing(self, job):
        """The names of the alerts that fire for a deployment."""
        return {
            labels["alertname"]
            for labels, _ in self.query(f'ALERTS{{alertstate="firing", job="{job}"}}')
        }

    def end(self):
        self.program.end()

    def _configuration(self, token_file):
        text = (DEPLOY / "prometheus" / "prometheus.yml").read_text()
        changes = [
            (r"(scrape|evaluation)_interval: \w+", r"\1_interval: 250ms"),
            (
                r"    dns_sd_configs:\n(      .*\n)+",
                f"    file_sd_configs:\n      - files: [{self.folder}/targets.json]\n",
            ),
        ]
        if token_file is not None:
            changes.append(
                (r"# (authorization:\n +)#( +credentials_file:) .*", rf"\1 \2 {token_file}")
            )
        for pattern, replacement in changes:
            text, count = re.subn(pattern, replacement, text)
            assert count > 0, f"no {pattern} in prometheus.yml"
        return text

    def _write_targets(self):
        targets = [
            {"targets": list(addresses), "labels": {"job": job}}
            for job, addresses in self.targets.items()
        ]
        (self.folder / "targets.new").write_text(json.dumps(targets))
        (self.folder / "targets.new").rename(self.folder / "targets.json")

    def _is_ready(self):
        assert self.program.process.poll() is None, self.program.log.read_text()
        try:
            return stack.get(f"{self.url}/-/ready")[0] == 200
        except urllib.error.URLError:
            return False

    def _ask(self, what, **parameters):
        query = urllib.parse.urlencode(parameters)
        status, body = stack.get(f"{self.url}/api/v1/{what}?{query}")
        assert status == 200, f"{what} {parameters}: {body}"
        return json.loads(body)["data"]
