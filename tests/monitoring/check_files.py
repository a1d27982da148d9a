#!/usr/bin/env python3
"""Checks that rules, dashboards, tests and the runbook of deploy/monitoring belong together.

  check_files.py CHECKOUT
  check_files.py --self-test
  check_files.py --help

- Each alert has a severity of docs/runbook/README.md, and its own section of docs/runbook, which
  its runbook_url names. Each section is an alert's, and has the items of ITEMS in their order.
- Each alert fires and then clears in rules/*.test.yml, and in alerts_test.py.
- Each recorded series is used by an alert or a dashboard.
- Each metric in rules and dashboards is listed in docs/operations/logs-and-metrics.md.
- Dashboards have the uid of their file, panels that lie side by side on the grid of 24 columns,
  with a number, title and description of their own, on the Prometheus that is chosen.
Exit: 0 if all is as it should be; 1 if not, with a line for each fault; 2 usage.
"""

import json
import pathlib
import re
import sys

ITEMS = ["Means", "Users see", "Check", "Mend", "Silence"]
WITHOUT_QUERY = {"row", "text", "alertlist"}
NUM_COLUMNS = 24


def rules_of(text, kind):
    """The rules of a kind ("alert" or "record") of a rule file, as name -> text of the rule."""
    rules = {}
    for block in re.split(r"^ *- (?=(?:alert|record): )", text, flags=re.MULTILINE)[1:]:
        found, name = re.match(r"(alert|record): (\S+)", block).groups()
        if found == kind:
            rules[name] = block
    return rules


def field(rule, name):
    found = re.search(rf"\b{name}: ([^\s,}}]+)", rule)
    return found.group(1) if found else ""


def sections_of(text):
    """The second-level sections of a page, as heading -> text."""
    parts = re.split(r"^## (.+)$", text, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2]))


def alert_faults(alerts, pages, severities):
    """pages: name -> text."""
    sections = {
        (page, name): section
        for page, text in pages.items()
        for name, section in sections_of(text).items()
    }
    for name, rule in alerts.items():
        page, _, anchor = field(rule, "runbook_url").removeprefix("docs/runbook/").partition("#")
        if anchor != name.lower() or (page, name) not in sections:
            yield f"{name}: runbook_url leads to no section of its name"
        if field(rule, "severity") not in severities:
            yield f"{name}: the severity is none of docs/runbook/README.md"
        for annotation in ("summary", "description"):
            if not field(rule, annotation):
                yield f"{name}: no {annotation}"
    for (page, name), text in sections.items():
        if name not in alerts:
            yield f"docs/runbook/{page}: there is no alert {name}"
        if re.findall(r"^- \*\*(.+?):\*\* \S", text, re.MULTILINE) != ITEMS:
            yield f"docs/runbook/{page}: {name} has not the items {', '.join(ITEMS)}"


def rule_test_faults(alerts, text):
    """In promtool's tests, an alert fires where it is expected with labels, and clears after."""
    for name in alerts:
        cases = re.findall(rf"alertname: {name}\n.*\n\s+exp_alerts:(.*)", text)
        fires = [case.strip() != "[]" for case in cases]
        if True not in fires or False not in fires[fires.index(True) :]:
            yield f"{name}: does not fire and then clear in tests/monitoring/rules"


def real_test_faults(alerts, text):
    for name in alerts:
        silences = re.findall(r"await_silence\(([^)]*)\)", text)
        fires = f'await_alert("{name}"' in text
        if not fires or not any(f'"{name}"' in silence for silence in silences):
            yield f"{name}: does not fire and clear in tests/monitoring/alerts_test.py"


def metrics_in(expressions):
    """The metrics that queries name, histograms by their own name, without recorded series."""
    names = re.findall(r"(?<![:\w])((?:liquidblend|process)_\w+)(?!\w|:)", expressions)
    return {re.sub(r"_(bucket|count|sum)$", "", name) for name in names}


def documented(page):
    """The metrics of docs/operations/logs-and-metrics.md: the first cells of its table of them, and
    those of all programs in its text."""
    table = re.search(r"^\| metric .*?(?=^$)", page, re.MULTILINE | re.DOTALL).group(0)
    names = set(re.findall(r"`(process_\w+)`", page))
    for row in table.splitlines()[2:]:
        names.update("liquidblend_" + name for name in re.findall(r"`(\w+)`", row.split("|")[1]))
    return names


def overlap(a, b):
    return (
        a["x"] < b["x"] + b["w"]
        and b["x"] < a["x"] + a["w"]
        and a["y"] < b["y"] + b["h"]
        and b["y"] < a["y"] + a["h"]
    )


def dashboard_faults(name, dashboard):
    panels = dashboard["panels"]
    if dashboard["uid"] != name:
        yield f"{name}: another uid: {dashboard['uid']}"
    if len({panel["id"] for panel in panels}) != len(panels):
        yield f"{name}: two panels have one id"
    for k, panel in enumerate(panels):
        what = f"{name}: panel {panel['id']} '{panel['title']}'"
        grid = panel["gridPos"]
        if grid["x"] + grid["w"] > NUM_COLUMNS:
            yield f"{what} is beyond the grid"
        for other in panels[:k]:
            if overlap(grid, other["gridPos"]):
                yield f"{what} lies on panel {other['id']}"
        if panel["type"] in WITHOUT_QUERY:
            continue
        if not panel["title"] or not panel.get("description") or not panel.get("targets"):
            yield f"{what} has no title, description or query"
        if panel["datasource"] != {"type": "prometheus", "uid": "${datasource}"}:
            yield f"{what} is not on the Prometheus that is chosen"


def faults(checkout):
    rules_folder = checkout / "deploy" / "monitoring" / "prometheus" / "rules"
    rules = "".join(path.read_text() for path in sorted(rules_folder.glob("*.yml")))
    alerts, records = rules_of(rules, "alert"), rules_of(rules, "record")
    if not alerts or not records:
        yield f"{rules_folder}: no rules"
    runbook = checkout / "docs" / "runbook"
    pages = {path.name: path.read_text() for path in runbook.glob("*.md")}
    table = sections_of(pages.pop("README.md"))["Severities"]
    severities = set(re.findall(r"^\| (\w+) \| ", table, re.MULTILINE))
    yield from alert_faults(alerts, pages, severities)
    tests = checkout / "tests" / "monitoring"
    rule_tests = "".join(path.read_text() for path in sorted((tests / "rules").glob("*.yml")))
    yield from rule_test_faults(alerts, rule_tests)
    yield from real_test_faults(alerts, (tests / "alerts_test.py").read_text())

    queries = "".join(alerts.values())
    for path in sorted((checkout / "deploy" / "monitoring" / "grafana").glob("*.json")):
        dashboard = json.loads(path.read_text())
        yield from dashboard_faults(path.stem, dashboard)
        targets = [target for panel in dashboard["panels"] for target in panel.get("targets", [])]
        queries += "\n".join(target["expr"] for target in targets) + "\n"
    for name in records:
        used = queries + "".join(rule for other, rule in records.items() if other != name)
        if name not in used:
            yield f"{name}: recorded and not used"
    expressions = re.sub(r"(?:summary|description|runbook_url):.*", "", queries)
    expressions += "".join(records.values())
    page = (checkout / "docs" / "operations" / "logs-and-metrics.md").read_text()
    for name in sorted(metrics_in(expressions) - documented(page)):
        yield f"docs/operations/logs-and-metrics.md: no metric {name}"


def self_test():
    text = """groups:
  - name: g
    rules:
      - record: job:liquidblend_a:sum
        expr: sum by (job) (rate(liquidblend_b_seconds_bucket{x="liquidblend.*"}[5m]))
      - alert: LiquidblendX
        expr: job:liquidblend_a:sum > 0
        labels: {severity: warning}
        annotations:
          summary: S
          description: D
          runbook_url: docs/runbook/p.md#liquidblendx
"""
    alerts, records = rules_of(text, "alert"), rules_of(text, "record")
    assert list(alerts) == ["LiquidblendX"] and list(records) == ["job:liquidblend_a:sum"]
    items = "".join(f"- **{item}:** x.\n" for item in ITEMS)
    pages = {"p.md": f"# P\n## LiquidblendX\n{items}"}
    assert not list(alert_faults(alerts, pages, {"warning"}))
    assert len(list(alert_faults(alerts, pages, {"critical"}))) == 1
    assert len(list(alert_faults({}, pages, {"warning"}))) == 1
    assert len(list(alert_faults(alerts, {"p.md": "# P\n"}, {"warning"}))) == 1
    pages["p.md"] = "# P\n## LiquidblendX\n- **Means:** x."
    assert len(list(alert_faults(alerts, pages, {"warning"}))) == 1
    case = "- alertname: LiquidblendX\n  eval_time: 1m\n  exp_alerts:"
    assert not list(rule_test_faults(alerts, f"{case}\n    - exp_labels\n{case} []\n"))
    assert len(list(rule_test_faults(alerts, f"{case} []\n{case}\n    - exp_labels\n"))) == 1
    fires, clears = 'await_alert("LiquidblendX")\n', 'await_silence(\n"LiquidblendX",\n)\n'
    assert not list(real_test_faults(alerts, fires + clears))
    assert len(list(real_test_faults(alerts, fires))) == 1
    assert metrics_in(records["job:liquidblend_a:sum"]) == {"liquidblend_b_seconds"}
    assert documented("| metric | l |\n| --- | --- |\n| `a`, `b_total` | `c` |\n\n`process_d`") == {
        "liquidblend_a",
        "liquidblend_b_total",
        "process_d",
    }
    grid = {"x": 0, "y": 0, "w": 12, "h": 4}
    assert overlap(grid, {"x": 11, "y": 3, "w": 1, "h": 1})
    assert not overlap(grid, {"x": 12, "y": 0, "w": 12, "h": 4})
    print("self-test passed")


def main():
    if sys.argv[1:] == ["--help"]:
        print(__doc__)
        return
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    if sys.argv[1] == "--self-test":
        self_test()
        return
    found = list(faults(pathlib.Path(sys.argv[1])))
    print("\n".join(found) or "rules, dashboards, tests and runbook belong together")
    sys.exit(1 if found else 0)


main()
