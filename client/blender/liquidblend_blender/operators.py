"""What the panel's buttons do."""

import shutil
import tempfile

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from . import ask, bake, bake_files, connection, playback, send, tasks, words
from . import settings as settings_module
from .operating import OfIdleLiquid, OfLiquid, liquid_of, start_task


def describe(object):
    """Asks what an object's liquid is made of, and keeps it with the object."""
    settings = object.liquidblend
    if settings.kind == 'BAKE':
        index = bake_files.read_index(ask.origin_of(settings).place)
        settings.fps = index["fps"]
        settings_module.set_controls(object, [])
        return f"{index['frames']} frames from frame {index['frame_start']:g} on"
    settings.published_version = 0
    if settings.kind == 'SERVER':
        names = connection.family_names(ask.origin_of(settings))
        settings_module.set_family_names(names)
        if not settings.family.strip():
            raise ValueError(f"choose a family: {', '.join(names) or 'the server has none'}")
    facts = connection.describe(ask.origin_of(settings))
    settings_module.set_controls(object, facts.controls)  # first, as it may refuse them
    settings.published_version = facts.version
    settings.up, settings.fps = facts.up, facts.frames_per_second
    settings.duration_s = facts.duration_s
    return f"{facts.duration_s:.2f} s, {len(facts.controls)} weights or parameters"


def connect(operator, object):
    """Describes the object's liquid and shows it. False, after a report, if that fails."""
    playback.forget()
    try:
        with playback.held():
            text = describe(object)
    except Exception as error:
        why = words.of_error(error)
        playback.state_of(object).error = why
        operator.report({'ERROR'}, why)
        return False
    playback.refresh_object(object)
    operator.report({'INFO'}, text)
    return True


class LIQUIDBLEND_OT_connect(OfLiquid, bpy.types.Operator):
    """Ask the server, file or folder what there is, and show it"""

    bl_idname = "liquidblend.connect"
    bl_label = "Connect"

    def execute(self, context):
        return {'FINISHED'} if connect(self, liquid_of(context)) else {'CANCELLED'}


class LIQUIDBLEND_OT_add(bpy.types.Operator):
    """Add an object whose mesh is a liquid"""

    bl_idname = "liquidblend.add"
    bl_label = "Add Liquid"
    bl_options = {'REGISTER', 'UNDO'}

    kind: EnumProperty(name="From", items=(
        ('SERVER', "Server", ""), ('FILE', "File", ""), ('BAKE', "Bake", "")))
    server: StringProperty(name="Server", default="127.0.0.1:50051")
    family: StringProperty(name="Family", description="Of a server")
    filepath: StringProperty(name="File or folder", subtype='FILE_PATH')

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        mesh = bpy.data.meshes.new("Liquid")
        object = bpy.data.objects.new("Liquid", mesh)
        context.collection.objects.link(object)
        context.view_layer.objects.active = object
        object.select_set(True)
        with playback.held():
            self._fill(object.liquidblend, context.scene)
        # Renders on a thread of their own would change the mesh while the window draws it.
        context.scene.render.use_lock_interface = True
        if self.kind != 'SERVER' or self.family:
            connect(self, object)
        return {'FINISHED'}  # also where it cannot connect yet: the panel tells why

    def _fill(self, settings, scene):
        settings.enabled = True
        settings.kind, settings.server = self.kind, self.server
        settings.family, settings.start_frame = self.family, scene.frame_start
        settings.bake = bake.default_folder(settings.id_data)
        if self.kind == 'FILE':
            settings.file = self.filepath
        elif self.kind == 'BAKE':
            settings.bake = self.filepath


class LIQUIDBLEND_OT_bake(OfIdleLiquid, tasks.StepwiseOperator, bpy.types.Operator):
    """Write all frames into a folder, which plays without server and library"""

    bl_idname = "liquidblend.bake"
    bl_label = "Bake to Cache"
    title = "bake"

    step: FloatProperty(name="Step", default=1.0, min=0.01, max=100.0,
                        description="Frames of the scene from one surface to the next")
    switch: BoolProperty(name="Play the bake", default=True,
                         description="Show the baked folder when it is done")

    def execute(self, context):
        object, scene = liquid_of(context), context.scene
        settings = object.liquidblend
        if settings.kind == 'BAKE':
            self.report({'ERROR'}, "The liquid is a bake already")
            return {'CANCELLED'}
        if settings.bake.startswith("//") and not bpy.data.filepath:
            self.report({'ERROR'}, f"{settings.bake} is beside the file: save it first")
            return {'CANCELLED'}
        self._object = object
        folder = bpy.path.abspath(settings.bake, library=object.library)
        return self.begin(context, bake.bake_steps(
            context, object, folder, float(scene.frame_start), float(scene.frame_end), self.step))

    def _end(self, context):
        result = super()._end(context)
        playback.forget()  # the folder was another bake before, perhaps
        if self.switch and result == {'FINISHED'}:
            self._object.liquidblend.kind = 'BAKE'
        return result


class LIQUIDBLEND_OT_send(tasks.StepwiseOperator, bpy.types.Operator):
    """Send the active object to the server as an animation: the cache of a Mantaflow domain, or any
other object's mesh of each frame of the scene"""

    bl_idname = "liquidblend.send"
    bl_label = "Send Cache as Animation"
    title = "send"

    animation: StringProperty(name="Animation", description="Its name on the server")
    server: StringProperty(name="Server", default="127.0.0.1:50051")
    tls: BoolProperty(name="TLS")
    tls_ca: StringProperty(name="Authorities", subtype='FILE_PATH')

    @classmethod
    def poll(cls, context):
        return context.object is not None and not tasks.is_running()

    def invoke(self, context, _event):
        liquids = settings_module.liquids_of(context.scene)
        for name in ("server", "tls", "tls_ca") if liquids else ():
            setattr(self, name, getattr(liquids[0].liquidblend, name))
        self.animation = self.animation or bpy.path.clean_name(context.object.name).lower()
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        if not self.animation:
            self.report({'ERROR'}, "No name for the animation")
            return {'CANCELLED'}
        try:
            domain = send.find_domain(context.object)
            if domain is not None:
                return self._send_cache(context, domain)
            self._folder = tempfile.mkdtemp(prefix="liquidblend-send-")
            return self.begin(context, send.mesh_steps(context, context.object, self._folder))
        except (send.SendError, OSError) as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}

    def _send_cache(self, context, domain):
        folder = send.mantaflow_folder(domain)
        return self._upload(folder, send.mantaflow_options(context.object, domain, context.scene))

    def _end(self, context):
        result = super()._end(context)
        if result == {'FINISHED'}:
            return self._upload(self._folder, {}, is_temporary=True)
        shutil.rmtree(self._folder, ignore_errors=True)
        return result

    def _upload(self, folder, options, is_temporary=False):
        origin, animation = ask.server_of(self), self.animation

        def work(report):
            try:
                return connection.import_animation(origin, animation, folder, options, report)
            finally:
                if is_temporary:  # an upload that goes on after Stop ends at the next file
                    shutil.rmtree(folder, ignore_errors=True)

        return start_task(self, f"send {animation}", work)


class LIQUIDBLEND_OT_stop(bpy.types.Operator):
    """Stop the task"""

    bl_idname = "liquidblend.stop"
    bl_label = "Stop"

    @classmethod
    def poll(cls, _context):
        return tasks.is_running()

    def execute(self, _context):
        tasks.current.is_cancelled = True
        return {'FINISHED'}


CLASSES = (LIQUIDBLEND_OT_connect, LIQUIDBLEND_OT_add, LIQUIDBLEND_OT_bake, LIQUIDBLEND_OT_send,
           LIQUIDBLEND_OT_stop)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
