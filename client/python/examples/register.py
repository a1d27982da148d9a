#!/usr/bin/env python3
"""Imports folders of frames, and registers the first with the others.

  register.py FAMILY SOURCE TARGET.. [--server HOST:PORT] [--option NAME=VALUE ..]

Animations get the names FAMILY_0, FAMILY_1 and so on. Ctrl-C ends the waiting, not the job.
"""

import argparse
import os
import sys

import liquidblend


def option(text):
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, value


def show(state):
    left = "" if state.seconds_left is None else f", {state.seconds_left:.0f} s left"
    stage = "done" if state.done else state.stage
    print(f"{state.subject}: {100 * state.fraction:3.0f} % {stage}{left}", flush=True)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("family")
    parser.add_argument("folders", nargs="+", metavar="folder")
    parser.add_argument("--server", default=os.environ.get("LIQUIDBLEND_SERVER", "127.0.0.1:50051"))
    parser.add_argument(
        "--option", action="append", default=[], type=option, metavar="NAME=VALUE"
    )
    arguments = parser.parse_args()
    options = dict(arguments.option)
    with liquidblend.connect(arguments.server) as client:
        names = [f"{arguments.family}_{k}" for k in range(len(arguments.folders))]
        jobs = [
            client.import_animation(name, folder)
            for name, folder in zip(names, arguments.folders)
        ]
        for job in jobs:
            job.wait(show)
        job = client.register(arguments.family, names[0], names[1:], options=options)
        done = job.wait(show)
        print(f"{arguments.family} version {done.version}: {done.grade.name}")


if __name__ == "__main__":
    try:
        main()
    except liquidblend.Error as error:
        sys.exit(f"register.py: {error}")
