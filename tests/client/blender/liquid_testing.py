"""What the tests of the add-on share. They run in Blender, by run.sh."""

import functools
import os
import sys
import unittest

from in_blender import add_liquid, arrays_of, empty_scene, install, module, package, parse_arguments

ARGUMENTS = parse_arguments()
FPS = 24.0


@functools.lru_cache(maxsize=None)
def client():
    """Of the test's server."""
    return package().Client(ARGUMENTS.server)


def expected(frame, weight=0.0, **options):
    """What the server answers for a frame of a scene at 24 frames/s that begins at 1."""
    return client().frame("two_drops", weight, (frame - 1.0) / FPS, **options)


def add_two_drops():
    return add_liquid(kind='SERVER', server=ARGUMENTS.server, family="two_drops")


def in_folder(name):
    return os.path.join(ARGUMENTS.folder, name)


def state_of(object):
    return module("playback").state_of(object)


class LiquidTest(unittest.TestCase):
    def setUp(self):
        self.scene = empty_scene()

    def assert_shows(self, object, frame):
        """The mesh is the frame, to the byte."""
        positions, triangles = arrays_of(object.data)
        self.assertEqual(positions.tobytes(), frame.positions.tobytes())
        self.assertEqual(triangles.tobytes(), frame.triangles.tobytes())


def run(*modules):
    """Installs the add-on, runs the tests of modules and ends Blender."""
    install(ARGUMENTS.zip)
    suite = unittest.defaultTestLoader.loadTestsFromNames(modules)
    sys.exit(0 if unittest.TextTestRunner().run(suite).wasSuccessful() else 1)
