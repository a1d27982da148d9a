#!/usr/bin/env python3
"""Checks the pages of docs/ and README.md.

  check_pages.py CHECKOUT
  check_pages.py --self-test
  check_pages.py --help

- Relative links lead to files that are there, and to headings that these have. So do the names of
  pages in `...`.
- Files that docs/CONTRIBUTING.md names with their folder are there.
- No paragraph or item has more than five sentences.
- The table of rooms in docs/architecture.md has one line for each room that
  tests/layering_test.cc (kRooms) knows, in the same order, and for each folder whose rooms these
  are if it holds sources itself. Others are folders, too. Each folder of core, worker, server and
  client that holds sources has a line, or is within a room.
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
MAX_SENTENCES = 5
COLUMNS = ["result", "value", "aim", "met", "command", "commit"]
FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)\s]+)\)")


def pages_of(checkout):
    return [checkout / "README.md", *sorted((checkout / "docs").rglob("*.md"))]


def anchors_of(page):
    """The headings of a page as links name them."""
    headings = re.findall(r"^#+ (.+)$", FENCE.sub("", page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def link_faults(page, checkout):
    text = FENCE.sub("", page.read_text())
    for name in re.findall(r"`docs/([\w/-]+\.md)`", text):
        if not (checkout / "docs" / name).exists():
            yield f"{page}: there is no docs/{name}"
    for link in LINK.findall(re.sub(r"`[^`\n]*`", "", text)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists():
            yield f"{page}: {link} leads to no file"
        elif anchor and anchor not in anchors_of(target):
            yield f"{page}: {link} leads to no heading"


def recipe_faults(checkout):
    """Files that the recipes name and that are not there. NAME stands for any."""
    page = checkout / "docs" / "CONTRIBUTING.md"
    for name in re.findall(r"`([\w-]+/[\w./-]+\.(?:cc|h|md|proto|py|sh|txt))`", page.read_text()):
        if "NAME" not in name and not (checkout / name).exists():
            yield f"{page}: there is no {name}"


def test_program(folder, source, options):
    """The name that lb_test (tests/CMakeLists.txt) gives to a test's program."""
    label = re.search(r"\bLABEL\s+(\w+)", options)
    label = label.group(1) if label else "unit"
    if label == "e2e" or re.search(r"\b(WHOLE|ALONE)\b", options):
        return f"{folder}_{source}".replace("/", "_")
    return f"{folder}_test" if label == "unit" else f"{folder}_{label}_test"


def without_loops(text):
    """CMake's text with each `foreach(NAME item..)` written out, a body for each item."""
    items = r"(?:\s+(?!IN\b|RANGE\b)[^\s)$]+)+"
    loop = re.compile(rf"\bforeach\((\w+)({items})\s*\)(.*?)\bendforeach\(\w*\)", re.DOTALL)

    def bodies(match):
        name, items, body = match.groups()
        return "".join(body.replace(f"${{{name}}}", item) for item in items.split())

    return loop.sub(bodies, text)


def programs_of(checkout):
    """The names of all programs that the CMakeLists.txt files build."""
    programs = set()
    for part in ["client", "server", "tests", "worker"]:
        for file in (checkout / part).rglob("CMakeLists.txt"):
            text = without_loops(re.sub(r"#.*", "", file.read_text()))
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


def paragraphs_of(text):
    """Paragraphs and items of lists, as (line number, text). Tables, headings, fences are none."""
    number, lines, is_code = 0, [], False
    for at, line in enumerate([*text.splitlines(), ""], 1):
        fence = line.lstrip().startswith("```")
        ends = is_code or fence or not line.strip() or re.match(r"\||#", line)
        if lines and (ends or re.match(r" *(-|\d+\.) ", line)):
            yield number, " ".join(lines)
            lines = []
        if not ends:
            number = at if not lines else number
            lines.append(line.strip())
        is_code ^= fence


def num_sentences(paragraph):
    text = re.sub(r"`[^`]*`", "x", re.sub(r"^(-|\d+\.) ", "", paragraph))
    text = re.sub(r"\b(e\.g|i\.e|vs|eq)\.", "", text)
    return len(re.findall(r"[.!?][)\"]?(?=\s+[A-Zx(\[]|\s*$)", text))


def rooms_of_test(text):
    """kRooms: each folder that has rooms, as ('core/store', ['core/store/sql', ..])."""
    table = re.search(r"kRooms\[\] = \{(.*?)\};", text, re.DOTALL).group(1)
    for folder, rooms in re.findall(r'"([\w/]+)/",\s*\{([^}]*)\}', table):
        yield folder, [f"{folder}/{room}" for room in re.findall(r'"([\w/]+)/"', rooms)]


def rooms_of_page(text):
    """The first cells of the table of rooms, as (line number, room)."""
    section = re.search(r"^## Rooms$.*?(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    for number, cells in rows_of(section.group(0) if section else ""):
        yield from ((number, room) for room in re.findall(r"`([^`]+)`", cells[0]))


def paragraph_faults(page):
    for number, paragraph in paragraphs_of(page.read_text()):
        count = num_sentences(paragraph)
        if count > MAX_SENTENCES:
            yield f"{page}:{number}: {count} sentences, more than {MAX_SENTENCES}"


def source_folders(checkout):
    """The folders of the programs that hold sources or headers themselves."""
    for part in ["core", "worker", "server", "client"]:
        for file in (checkout / part).rglob("*"):
            if file.suffix in [".cc", ".h"]:
                yield str(file.parent.relative_to(checkout))


def is_within(folder, rooms, with_rooms):
    """Whether the nearest room around a folder is one that is not divided into rooms."""
    around = next((str(p) for p in pathlib.PurePath(folder).parents if str(p) in rooms), None)
    return around is not None and around not in with_rooms


def room_faults(checkout):
    page = checkout / "docs" / "architecture.md"
    named = [room for _, room in rooms_of_page(page.read_text())]
    with_rooms = dict(rooms_of_test((checkout / "tests" / "layering_test.cc").read_text()))
    for folder, rooms in with_rooms.items():
        if [room for room in named if room in rooms] != [room for room in rooms if room in named]:
            yield f"{page}: the rooms of {folder} are not in the order of kRooms"
        yield from (f"{page}: no line for the room {room}" for room in rooms if room not in named)
    for folder in sorted(set(source_folders(checkout)) - set(named)):
        if not is_within(folder, named, with_rooms):
            yield f"{page}: no line for the folder {folder}"
    for room in sorted(set(named)):
        if not (checkout / room).is_dir():
            yield f"{page}: the room {room} is not a folder"
        if named.count(room) > 1:
            yield f"{page}: {named.count(room)} lines for the room {room}"


def self_test():
    loop = """foreach(test a
    sub/b)
  lb_test(${test}_test.cc DEPS x)
endforeach()
foreach(x IN LISTS y)
  z(${x})
endforeach()"""
    written_out = without_loops(loop)
    assert re.findall(r"lb_test\((\S+)\.cc", written_out) == ["a_test", "sub/b_test"], written_out
    assert "z(${x})" in written_out
    assert num_sentences("- One. Two (a.b, `c. D`). Three: four; five.") == 3
    assert num_sentences("No end") == 0
    text = "# T\nA.\nB.\n\n- C.\n  D.\n- E.\n```\nF. G.\n```\n| H. | I. |\n"
    assert list(paragraphs_of(text)) == [(2, "A. B."), (5, "- C. D."), (7, "- E.")]
    rooms = 'const Rooms kRooms[] = {{"a/b/", {"c/", "d/"}},\n {"e/", {"f/"}}};'
    assert list(rooms_of_test(rooms)) == [("a/b", ["a/b/c", "a/b/d"]), ("e", ["e/f"])]
    assert is_within("e/f/g", ["e", "e/f"], ["e"]) and not is_within("e/g", ["e", "e/f"], ["e"])
    page = "## Rooms\n| room | x |\n| --- | --- |\n| `a/b`, `c` | `d` |\n## Next\n| `e` | |\n"
    assert [room for _, room in rooms_of_page(page)] == ["a/b", "c"]
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
    checkout = pathlib.Path(sys.argv[1])
    faults = [fault for page in pages_of(checkout) for fault in link_faults(page, checkout)]
    faults += [fault for page in pages_of(checkout) for fault in paragraph_faults(page)]
    faults += recipe_faults(checkout)
    faults += room_faults(checkout)
    faults += result_faults(checkout)
    print("\n".join(faults) or "all pages are as they should be")
    sys.exit(1 if faults else 0)


main()
