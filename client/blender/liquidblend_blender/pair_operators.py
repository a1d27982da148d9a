"""What the panel's buttons for correspondences do."""

import bpy
from bpy.props import EnumProperty

from . import ask, connection, correspond
from .operating import OfIdleLiquid, OfLiquid, liquid_of, start_task


class LIQUIDBLEND_OT_register(OfIdleLiquid, bpy.types.Operator):
    """Register animations of the server as a family, with the pairs of the liquid"""

    bl_idname = "liquidblend.register"
    bl_label = "Register"

    mode: EnumProperty(name="Mode", items=(
        ('NEW', "New", "A family of a new name"),
        ('REPLACE', "Replace", "A new version, from scratch"),
        ('REFINE', "Refine", "A new version that goes on from the newest one")))

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        object = liquid_of(context)
        settings = object.liquidblend
        targets = [name.strip() for name in settings.target_animations.split(",") if name.strip()]
        family = settings.new_family.strip() or settings.family.strip()
        try:
            pairs = correspond.correspondences_of(object, context.scene)
            self._check(family, settings.source_animation, targets, pairs)
        except (correspond.PairError, ValueError) as error:
            self.report({'ERROR'}, str(error))
            return {'CANCELLED'}
        origin = ask.server_of(settings)
        request = connection.Registration(family, settings.source_animation.strip(), targets,
                                          pairs, self.mode)
        return start_task(self, f"register {family}",
                      lambda report: connection.register(origin, request, report))

    def _check(self, family, source, targets, pairs):
        if not family:
            raise ValueError("No name for the family")
        if self.mode != 'REFINE' and not (source and targets):
            raise ValueError("Registering needs the names of a source and a target")
        for number, pair in enumerate(pairs):
            if targets and pair["target"] >= len(targets):
                raise ValueError(f"pair {number} is of target {pair['target']}, and there are "
                                 f"{len(targets)}, from 0 on")


class LIQUIDBLEND_OT_pair_add(OfLiquid, bpy.types.Operator):
    """Add a pair at this frame: of the two selected empties, or of two new ones"""

    bl_idname = "liquidblend.pair_add"
    bl_label = "Add Pair"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        object, scene = liquid_of(context), context.scene
        empties = [o for o in context.selected_objects if o.type == 'EMPTY'][:2]
        number = len(object.liquidblend.pairs)
        for name in ("source", "target")[len(empties):]:
            empty = bpy.data.objects.new(f"Pair {number} {name}", None)
            empty.empty_display_type, empty.empty_display_size = 'SPHERE', 0.05
            empty.location = scene.cursor.location
            context.collection.objects.link(empty)
            empties.append(empty)
        correspond.add_pair(object, *empties, scene.frame_current_final)
        return {'FINISHED'}


class LIQUIDBLEND_OT_pair_remove(OfLiquid, bpy.types.Operator):
    """Remove the chosen pair; its empties stay"""

    bl_idname = "liquidblend.pair_remove"
    bl_label = "Remove Pair"
    bl_options = {'REGISTER', 'UNDO'}

    def execute(self, context):
        settings = liquid_of(context).liquidblend
        if not 0 <= settings.active_pair < len(settings.pairs):
            return {'CANCELLED'}
        settings.pairs.remove(settings.active_pair)
        settings.active_pair = max(min(settings.active_pair, len(settings.pairs) - 1), 0)
        return {'FINISHED'}


CLASSES = (LIQUIDBLEND_OT_register, LIQUIDBLEND_OT_pair_add, LIQUIDBLEND_OT_pair_remove)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
