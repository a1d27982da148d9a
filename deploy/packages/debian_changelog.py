#!/usr/bin/env python3
"""Writes the changelog of the Debian packages from docs/changelog.md.

  debian_changelog.py CHANGELOG.md RELEASE MAINTAINER OUT.gz

RELEASE is VERSION-REVISION of the newest entry, which must be of that version. Older entries get
revision 1. The same input gives the same bytes.
Exit: 0 done; 1 if the newest entry is of another version, or has no date; 2 usage.
"""

import datetime
import email.utils
import gzip
import pathlib
import re
import sys
import textwrap

WIDTH = 78


def entries_of(text):
    """(version, date, lines) of each version; lines are headings, sentences and items."""
    for version, date, body in re.findall(
            r"^## \[([\d.]+)\] - (\d{4}-\d\d-\d\d)$(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL):
        yield version, date, [line for line in body.splitlines() if line]


def plain(text):
    """Without links, which lead nowhere from here, and without quotes of code."""
    text = re.sub(r" \(\[[^\]]+\]\([^)]+\)\)", "", text)
    return re.sub(r"\[([^\]]+)\]\([^)]+\)", r"\1", text).replace("`", "")


def formatted(line):
    if line.startswith("### "):
        return f"\n  [ {line[4:]} ]"
    return textwrap.fill(plain(line.removeprefix("- ")), WIDTH, initial_indent="  * ",
                         subsequent_indent="    ", break_on_hyphens=False, break_long_words=False)


def entry(version, date, lines, maintainer):
    noon = datetime.datetime.fromisoformat(f"{date}T12:00:00+00:00")
    body = "\n".join(map(formatted, lines))
    return (f"liquidblend ({version}) bookworm; urgency=medium\n\n{body.lstrip(chr(10))}\n\n"
            f" -- {maintainer}  {email.utils.format_datetime(noon)}\n")


def main(arguments):
    if len(arguments) != 4:
        print(__doc__, file=sys.stderr)
        return 2
    page, release, maintainer, out = arguments
    entries = list(entries_of(pathlib.Path(page).read_text()))
    version = release.rpartition("-")[0]
    if not entries or entries[0][0] != version:
        print(f"{page}: the newest entry with a date is not [{version}]", file=sys.stderr)
        return 1
    texts = [entry(release if of == version else f"{of}-1", date, lines, maintainer)
             for of, date, lines in entries]
    pathlib.Path(out).write_bytes(gzip.compress("\n".join(texts).encode(), 9, mtime=0))
    return 0


sys.exit(main(sys.argv[1:]))
