"""Words of servers and files, as a terminal and a panel may show them. Needs no Blender."""

import re
import sys
import traceback

# Control characters, of which some are commands to a terminal; ends of lines; half characters,
# which nothing can print.
_UNFIT = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
_MAX_CHARS = 2000


def clean(text, max_chars=_MAX_CHARS):
    """The text on one line, with "?" for each character that is unfit to show, as the server has it
    in its own messages; not longer than `max_chars`."""
    return _UNFIT.sub("?", text[:max_chars])


def of_error(error):
    """What an exception says."""
    return clean(str(error)) or type(error).__name__


def tell(text):
    """Writes a line to stderr."""
    print(f"liquidblend: {clean(text)}", file=sys.stderr, flush=True)


def tell_trace():
    """Writes where the exception that is being handled comes from."""
    for line in traceback.format_exc().split("\n"):
        print(clean(line), file=sys.stderr, flush=True)
