#!/usr/bin/env python3
"""Runs the code blocks of a page of docs/.

  run_blocks.py PAGE DIRECTORY

A fenced block whose info string has file=NAME is written to DIRECTORY/NAME; a block of `sh` is run.
All happens in the order of the page, in one shell that ends at the first error, with HOME and the
working directory in DIRECTORY. Blocks for the reader alone say so: `sh not-run="REASON"`, or `text`
for what is no command. Any other block is refused. Exit: that of the shell; 2 if a block is refused.
"""

import pathlib
import re
import shlex
import subprocess
import sys

FENCE = re.compile(r"^```(\w*)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r'not-run="[^"]+"')


def is_for_reader(language, info):
    return language == "text" or (language == "sh" and NOT_RUN.fullmatch(info.strip()))


def script_of(page, directory):
    """The page's blocks as one shell script. The files that it writes are named by the page."""
    lines = ["set -euo pipefail", f"cd {shlex.quote(str(directory))}"]
    for language, info, body in FENCE.findall(page.read_text()):
        named = re.search(r"\bfile=(\S+)", info)
        if named:
            path = shlex.quote(named.group(1))
            lines.append(f"mkdir -p \"$(dirname {path})\"")
            lines.append(f"cat >{path} <<'END_OF_BLOCK'\n{body}END_OF_BLOCK")
        elif language == "sh" and not info.strip():
            shown = shlex.quote("+ " + body.strip().replace("\n", "\n+ "))
            lines.append(f"printf '%s\\n' {shown}\n{body}")
        elif not is_for_reader(language, info):
            first = body.strip().split("\n")[0]
            print(
                f"{page}: a block is neither run nor marked: '{language}{info}', which begins with "
                f"'{first}': make it sh, sh not-run=\"REASON\", text, or give it file=NAME",
                file=sys.stderr,
            )
            sys.exit(2)
    return "\n".join(lines) + "\n"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    page, directory = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
    script = directory / "blocks.sh"
    script.write_text(script_of(page, directory))
    sys.exit(subprocess.run(["bash", str(script)], check=False).returncode)


main()
