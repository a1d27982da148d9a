"""Tests of who gets the user's token, run in Blender by addon_test.py."""

import os
from unittest import mock

import bpy
from in_blender import add_liquid, empty_scene, module, package
from liquid_testing import LiquidTest, in_folder, state_of

TOKEN = "secret-of-this-test"
STRANGER = "evil.example:443"


def preferences():
    return bpy.context.preferences.addons["liquidblend_blender"].preferences


class FakeClient:
    """Stands in for the package's Client: notes who is given which token, and refuses whoever has
    none."""

    given = []  # (target, token)
    error = "Unauthenticated"

    def __init__(self, target=None, token=None, **_options):
        self._token = token
        self.given.append((target, token))

    def __getattr__(self, _name):
        def call(*_arguments, **_options):
            kind = getattr(package(), "NotFound" if self._token else self.error)
            raise kind(package().Status.UNAUTHENTICATED, "a token is needed", "TOKEN_MISSING")

        return call


class Tokens(LiquidTest):
    def setUp(self):
        super().setUp()
        for patch in (mock.patch.object(package(), "Client", FakeClient),
                      mock.patch.object(FakeClient, "given", []),
                      mock.patch.dict(os.environ)):
            patch.start()
            self.addCleanup(patch.stop)
        os.environ.pop("LIQUIDBLEND_SERVER", None)
        self.addCleanup(self.set_preferences, "", "")
        self.set_preferences(TOKEN, "")

    def set_preferences(self, token, servers):
        preferences().token, preferences().token_servers = token, servers

    def given_to(self, server):
        """The token that is given to the client of a server, which refuses."""
        FakeClient.given.clear()
        module("playback").forget()
        with self.assertRaises(RuntimeError) as caught:
            add_liquid(kind='SERVER', server=server, family="drops")
        self.error = str(caught.exception)
        (target, token), = FakeClient.given
        self.target = target
        return token

    def test_are_not_in_files(self):
        add_liquid(kind='SERVER', server=STRANGER)
        path = in_folder("token.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
        with open(path, "rb") as file:
            self.assertNotIn(TOKEN.encode(), file.read())

    def test_are_not_sent_to_a_server_that_an_opened_file_names(self):
        settings = add_liquid(kind='SERVER', server=STRANGER).liquidblend
        with module("playback").held():
            settings.family, settings.tls, settings.fps = "drops", True, 24.0
        path = in_folder("stranger.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        empty_scene()
        FakeClient.given.clear()
        module("playback").forget()
        bpy.ops.wm.open_mainfile(filepath=path)
        self.assertEqual(FakeClient.given, [(STRANGER, None)])
        error = state_of(bpy.context.scene.objects["Liquid"]).error
        self.assertIn("a token is needed", error)
        self.assertIn(f"the token is not sent to {STRANGER}", error)
        self.assertIn('"Servers of the token"', error)

    def test_are_sent_to_servers_of_the_preferences(self):
        self.set_preferences(TOKEN, "render.example:443, 127.0.0.1:50051")
        for server in ("render.example:443", " Render.Example:443 ", "127.0.0.1:50051",
                       "127.0.0.1:50051,render.example:443"):
            self.assertEqual(self.given_to(server), TOKEN, server)
            self.assertNotIn("not sent", self.error)

    def test_are_not_sent_if_any_of_several_servers_is_another(self):
        self.set_preferences(TOKEN, "render.example:443,")
        for server in (STRANGER, f"render.example:443,{STRANGER}", "render.example:443,,",
                       "render.example", "render.example:4431", "dns:render.example:443",
                       "evil.render.example:443", "\u212aender.example:443"):
            self.assertIsNone(self.given_to(server), server)
            self.assertIn("the token is not sent", self.error)
        self.given_to(f"render.example:443,{STRANGER}")
        self.assertIn(f"the token is not sent to {STRANGER}, which", self.error)

    def test_are_not_sent_to_this_machine_unless_it_is_named(self):
        for server in ("127.0.0.1:50051", "localhost:50051", ""):
            self.assertIsNone(self.given_to(server), server)
            self.assertIn("the token is not sent", self.error)

    def test_are_sent_to_the_server_of_the_environment(self):
        os.environ["LIQUIDBLEND_SERVER"] = "farm-a.example:443,farm-b.example:443"
        self.assertEqual(self.given_to("farm-b.example:443"), TOKEN)
        self.assertIsNone(self.given_to(STRANGER))
        self.assertEqual(self.given_to(""), TOKEN)
        self.assertEqual(self.target, "farm-a.example:443,farm-b.example:443")

    def test_of_the_environment_are_kept_back_as_well(self):
        self.set_preferences("", "")
        os.environ["LIQUIDBLEND_TOKEN"] = TOKEN
        self.assertIsNone(self.given_to(STRANGER))
        os.environ["LIQUIDBLEND_SERVER"] = STRANGER
        self.assertEqual(self.given_to(STRANGER), TOKEN)

    def test_follow_the_preferences_at_once(self):
        liquid = add_liquid(kind='SERVER', server=STRANGER)
        origin = module("ask").origin_of(liquid.liquidblend)
        names = module("connection").family_names
        for servers, token in (("", None), (STRANGER, TOKEN), ("other.example:443", None)):
            self.set_preferences(TOKEN, servers)
            FakeClient.given.clear()
            for _ in range(2):  # the client is kept
                with self.assertRaises(package().Error):
                    names(origin)
            self.assertEqual(FakeClient.given, [(STRANGER, token)])

    def test_that_a_scope_lacks_are_told_as_well(self):
        with mock.patch.object(FakeClient, "error", "PermissionDenied"):
            self.given_to(STRANGER)
        self.assertIn(f"the token is not sent to {STRANGER}", self.error)

    def test_that_are_not_there_are_not_said_to_be_kept_back(self):
        self.set_preferences("", "")
        self.assertIsNone(self.given_to(STRANGER))
        self.assertIn("a token is needed", self.error)
        self.assertNotIn("not sent", self.error)
