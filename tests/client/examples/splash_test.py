#!/usr/bin/env python3
"""Whether the game of client/examples/splash shows water, and levers move it.

  splash_test.py CHECKOUT PROGRAMS

Registers two_drops with a server of its own. The game then runs on a display of its own (Xvfb), with
the family's file and with the server. Exit: 0 passed; 1 failed; 2 usage; 77 there is no Xvfb.
"""

import contextlib
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib

SIZE = (320, 240)
# When the lower drop has struck the pool and the other one is still in the air.
TIME_S = 0.42
PATIENCE_S = 60


def read_png(path):
    """The pixels of an RGB picture as stb_image_write makes it: a list of rows of (r, g, b)."""
    data = path.read_bytes()
    at, width, height, packed = 8, 0, 0, b""
    while at < len(data):
        (size,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, color = struct.unpack_from(">IIBB", body)
            assert (depth, color) == (8, 2), (depth, color)
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    return unfilter(zlib.decompress(packed), width, height)


def paeth(left, up, corner):
    guess = left + up - corner
    return min((abs(guess - x), n, x) for n, x in enumerate((left, up, corner)))[2]


def unfilter(raw, width, height):
    stride, rows, above = 3 * width, [], [0] * (3 * width)
    for y in range(height):
        kind, *line = raw[y * (stride + 1) : (y + 1) * (stride + 1)]
        for x in range(stride):
            left = line[x - 3] if x >= 3 else 0
            corner = above[x - 3] if x >= 3 else 0
            add = [0, left, above[x], (left + above[x]) // 2, paeth(left, above[x], corner)][kind]
            line[x] = (line[x] + add) & 255
        rows.append([tuple(line[x : x + 3]) for x in range(0, stride, 3)])
        above = line
    return rows


def is_water(pixel):
    return pixel[2] - pixel[0] > 50


def is_handle(pixel):
    """Of the chosen slider."""
    return pixel[0] > 220 and 110 < pixel[1] < 170 and pixel[2] < 80


def count(rows, is_kind, top=0.0, bottom=1.0, left=0.0, right=1.0):
    """How many pixels of a part of the picture are of that kind."""
    height, width = len(rows), len(rows[0])
    part = rows[int(top * height) : int(bottom * height)]
    return sum(map(is_kind, (p for row in part for p in row[int(left * width) : int(right * width)])))


def wait_for(condition, what):
    deadline = time.monotonic() + PATIENCE_S
    while not (result := condition()):
        assert time.monotonic() < deadline, f"{what} did not come within {PATIENCE_S} s"
        time.sleep(0.05)
    return result


@contextlib.contextmanager
def running(command, **arguments):
    process = subprocess.Popen(command, **arguments)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


@contextlib.contextmanager
def display():
    """A display of its own; gives its name."""
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "640x480x24", "-nolisten", "tcp"]
    with running(command, pass_fds=[writing], stderr=subprocess.DEVNULL):
        os.close(writing)
        with os.fdopen(reading) as number:
            name = number.readline().strip()
        assert name, "Xvfb does not start"
        yield f":{name}"


@contextlib.contextmanager
def server(checkout, programs, directory):
    """A server with a family two_drops; gives its address, and the family's file."""
    log = directory / "server.out"
    command = [programs / "liquidblend-server", "--data", directory / "data"]
    command += ["--listen", "127.0.0.1:0", "--http", "127.0.0.1:0"]
    with log.open("w") as out, running(command, stdout=out):
        listening = re.compile(r"^listening on (\S+)$", re.MULTILINE)
        address = wait_for(lambda: listening.search(log.read_text()), "the server").group(1)

        def liquidblend(*arguments):
            command = [programs / "liquidblend", "--server", address, *arguments]
            return subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode

        for name in "AB":
            folder = checkout / "tests" / "data" / "two_drops" / name
            assert liquidblend("import", f"drops_{name.lower()}", folder) == 0
        # One iteration is enough to play, but not for a good verdict (status 6).
        register = ["register", "two_drops", "--source", "drops_a", "--target", "drops_b"]
        assert liquidblend(*register, "--iterations", "1", "--wait") in (0, 6)
        file = directory / "two_drops.lbf"
        assert liquidblend("download", "families/two_drops", "-o", file) == 0
        yield address, file


class Game:
    def __init__(self, program, environment, directory):
        self.program, self.environment, self.directory = program, environment, directory

    def run(self, *arguments, **changes):
        environment = self.environment | changes
        command = [self.program, *arguments]
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=300
        )

    def play(self, *arguments):
        """Its output, of a game that ends well."""
        size = ["--size", f"{SIZE[0]}x{SIZE[1]}", "--samples", "0", "--no-vsync"]
        done = self.run(*arguments, *size)
        assert done.returncode == 0, done
        print(" ".join(map(str, arguments[:2])), done.stdout.strip())
        return done.stdout

    def picture(self, source, lever):
        path = self.directory / "picture.png"
        levers = ["--lever", f"drops_b={lever}", "--time", str(TIME_S)]
        self.play(*source, *levers, "--seconds", "1", "--screenshot", path)
        rows = read_png(path)
        assert (len(rows[0]), len(rows)) == SIZE
        return rows


def check_pictures(game, source):
    """The drop that is in the air at TIME_S is the right one in A, the left one in B."""
    in_a, in_b = game.picture(source, 0), game.picture(source, 1)
    num_pixels = SIZE[0] * SIZE[1]
    shares = [count(rows, is_water) / num_pixels for rows in (in_a, in_b)]
    print("water covers", *(f"{share:.3f}" for share in shares))
    assert all(0.1 < share < 0.5 for share in shares), shares
    colors = [len({p for row in rows for p in row}) for rows in (in_a, in_b)]
    assert all(number > 1000 for number in colors), colors
    # Above the pool.
    drops = [
        count(rows, is_water, bottom=0.5, left=side, right=side + 0.5)
        for rows in (in_a, in_b)
        for side in (0.0, 0.5)
    ]
    print("pixels of drops in the air, left and right of each:", drops)
    assert drops[1] > 300 and drops[0] < drops[1] / 4, drops
    assert drops[2] > 300 and drops[3] < drops[2] / 4, drops
    # The slider's handle, at the left end and at the right one.
    for rows, here, there in ((in_a, 0.0, 0.25), (in_b, 0.25, 0.0)):
        assert count(rows, is_handle, bottom=0.2, left=here, right=here + 0.25) > 10
        assert count(rows, is_handle, bottom=0.2, left=there, right=there + 0.25) == 0


def check_playing(game, source):
    output = game.play(*source, "--seconds", "2")
    rate, shown = re.search(r"^([\d.]+) pictures/s, .*frames: (\d+) shown", output).groups()
    assert float(rate) > 0 and int(shown) > 1, output


def check_errors(game, file):
    cases = [
        (["--file", "/no/such/file"], 1, "/no/such/file"),
        (["--file", file, "--lever", "width=1"], 2, "drops_b  0 to 1"),
        (["--file", file, "--lever", "0=2"], 2, "not in 0 to 1"),
        (["--file", file, "--size", "wide"], 2, "wide"),
        (["127.0.0.1:1"], 2, "HOST:PORT and FAMILY"),
        (["--file", file, "--seconds", "1", "--screenshot", "/no/such/folder/a.png"], 1, "a.png"),
    ]
    for arguments, status, text in cases:
        done = game.run(*arguments)
        assert done.returncode == status and text in done.stderr, (arguments, done)
    done = game.run("--file", file, DISPLAY=":no")
    assert done.returncode == 1 and "display" in done.stderr, done


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    if shutil.which("Xvfb") is None:
        print("splash_test.py: no Xvfb: run deploy/install-deps.sh", file=sys.stderr)
        sys.exit(77)
    checkout, programs = map(pathlib.Path, sys.argv[1:])
    with contextlib.ExitStack() as stack:
        directory = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        address, file = stack.enter_context(server(checkout, programs, directory))
        environment = os.environ | {"DISPLAY": stack.enter_context(display())}
        game = Game(programs / "splash", environment, directory)
        check_pictures(game, ["--file", file])
        check_pictures(game, [address, "two_drops"])
        check_playing(game, ["--file", file])
        check_playing(game, [address, "two_drops"])
        check_errors(game, file)
    print("passed")


main()
