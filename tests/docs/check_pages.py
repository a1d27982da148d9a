#!/usr/bin/env python3
"""Checks the pages of docs/ and README.md.

  check_pages.py CHECKOUT

- Relative links lead to files that are there, and to headings that these have.
- docs/results.md has at most 120 lines. Each row of its tables names a command whose first word is
  a script of the repository or a program that a CMakeLists.txt builds; "met" is yes, empty, or no
  with a link to the page that says why.
Exit: 0 if all is as it should be; 1 if not, with a line for each fault; 2 usage.
"""

import os
import pathlib
import re
import sys

MAX_RESULT_LINES = 120
COLUMNS = ["result", "value", "aim", "met", "command", "commit"]
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def pages_of(checkout):
    return [checkout / "README.md", *sorted((checkout / "docs").rglob("*.md"))]


def anchors_of(page):
    """The headings of a page as links name them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def link_faults(page):
    text = re.sub(r"`[^`\n]*`", "", FENCE.sub("", page.read_text()))
    for link in LINK.findall(text):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists():
            yield f"{page}: {link} leads to no file"
        elif anchor and anchor not in anchors_of(target):
            yield f"{page}: {link} leads to no heading"


def test_program(folder, source, options):
    """The name that lb_test (tests/CMakeLists.txt) gives to a test's program."""
    label = re.search(r"\bLABEL\s+(\w+)", options)
    label = label.group(1) if label else "unit"
    if label == "e2e" or re.search(r"\b(WHOLE|ALONE)\b", options):
        return f"{folder}_{source}"
    return f"{folder}_test" if label == "unit" else f"{folder}_{label}_test"


def programs_of(checkout):
    """The names of all programs that the CMakeLists.txt files build."""
    programs = set()
    for part in ["client", "server", "tests", "worker"]:
        for file in (checkout / part).rglob("CMakeLists.txt"):
            text = re.sub(r"#.*", "", file.read_text())
            programs.update(re.findall(r"\blb_executable\(([\w-]+)", text))
            folder = "_".join(file.parent.relative_to(checkout).parts[1:])
            for source, options in re.findall(r"\blb_test\((\S+)\.cc\b([^)]*)\)", text):
                programs.add(test_program(folder, source, options))
            programs.update(f"e2e_{name}" for name in re.findall(r"\blb_e2e_test\((\w+)\.cc", text))
    return programs


def rows_of(text):
    """The rows of all tables, without head and rule, as (line number, cells)."""
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        is_head = number < len(lines) and lines[number].startswith("| ---")
        if line.startswith("|") and not line.startswith("| ---") and not is_head:
            yield number, [cell.strip() for cell in line.strip("|").split("|")]


def row_fault(cells, checkout, programs):
    """What is wrong with a row; None if nothing is."""
    if len(cells) != len(COLUMNS):
        return f"{len(cells)} columns instead of {', '.join(COLUMNS)}"
    row = dict(zip(COLUMNS, cells))
    command = re.fullmatch(r"`([^\s`]+)[^`]*`", row["command"])
    if not command:
        return f"no command in `...`: {row['command']}"
    word = command.group(1)
    is_script = (checkout / word).is_file() and os.access(checkout / word, os.X_OK)
    if not is_script and word not in programs:
        return f"{word} is neither a script nor a program of the repository"
    if not re.fullmatch(r"yes|no.*\]\(.+\).*|", row["met"]):
        return f"met is yes, empty, or no with a link: {row['met']}"
    return None


def result_faults(checkout):
    page = checkout / "docs" / "results.md"
    text = page.read_text()
    num_lines = len(text.splitlines())
    if num_lines > MAX_RESULT_LINES:
        yield f"{page}: {num_lines} lines, more than {MAX_RESULT_LINES}"
    rows = list(rows_of(text))
    if not rows:
        yield f"{page}: no tables"
    programs = programs_of(checkout)
    for number, cells in rows:
        fault = row_fault(cells, checkout, programs)
        if fault:
            yield f"{page}:{number}: {fault}"


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    checkout = pathlib.Path(sys.argv[1])
    faults = [fault for page in pages_of(checkout) for fault in link_faults(page)]
    faults += result_faults(checkout)
    print("\n".join(faults) or "all links and results are as they should be")
    sys.exit(1 if faults else 0)


main()
