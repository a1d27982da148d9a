"""The panels: sidebar of the 3D view, tab Liquid."""

import bpy

from . import ask, playback, tasks
from .operating import liquid_of


class _LiquidPanel:
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Liquid"

    @classmethod
    def poll(cls, context):
        return liquid_of(context) is not None


def _draw_task(layout):
    task = tasks.current
    if task is None:
        return
    if not task.is_done:
        row = layout.row()
        row.label(text=f"{task.title}: {task.stage} {task.fraction:.0%}", icon='TIME')
        if task.is_stepwise:  # which takes all events of the window
            row.label(text="Esc stops")
        else:
            row.operator("liquidblend.stop", text="", icon='X')
    else:
        text = f"{task.title}: {task.error or task.result or 'done'}"
        column = layout.column(align=True)
        for line in _lines(text, 48):
            column.label(text=line, icon='ERROR' if task.error else 'CHECKMARK')


def _draw_state(layout, object, scene):
    state = playback.state_of(object)
    if state.error:
        box = layout.box()
        for line in _lines(state.error, 48):
            box.label(text=line, icon='ERROR')
    if not scene.render.use_lock_interface:
        layout.prop(scene.render, "use_lock_interface", icon='ERROR',
                    text="Lock Interface while rendering")


def _lines(text, width):
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) >= width:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines


class LIQUIDBLEND_PT_main(bpy.types.Panel):
    bl_idname = "LIQUIDBLEND_PT_main"
    bl_label = "Liquid"
    bl_space_type = 'VIEW_3D'
    bl_region_type = 'UI'
    bl_category = "Liquid"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        layout.operator("liquidblend.add", icon='ADD')
        layout.operator("liquidblend.send", icon='EXPORT')
        _draw_task(layout)
        if not _LiquidPanel.poll(context):
            return
        settings = context.object.liquidblend
        layout.prop(settings, "kind")
        if settings.kind == 'SERVER':
            for name in ("server", "tls"):
                layout.prop(settings, name)
            if settings.tls:
                layout.prop(settings, "tls_ca")
            for name in ("family", "version"):
                layout.prop(settings, name)
        else:
            layout.prop(settings, settings.kind.lower())
        layout.operator("liquidblend.connect", icon='FILE_REFRESH')
        _draw_state(layout, context.object, context.scene)


class LIQUIDBLEND_PT_blend(_LiquidPanel, bpy.types.Panel):
    bl_label = "Blend"
    bl_parent_id = "LIQUIDBLEND_PT_main"

    def draw(self, context):
        layout, object = self.layout, context.object
        layout.use_property_split = True
        is_baked = object.liquidblend.kind == 'BAKE'
        for control in () if is_baked else object.liquidblend.controls:
            key = bpy.utils.escape_identifier(control.key)
            layout.prop(object, f'["{key}"]', text=control.name, slider=True)
        layout.use_property_decorate = False
        if not is_baked:
            for name in ("start_frame", "offset_s", "speed"):
                layout.prop(object.liquidblend, name)
            times = ask.time_mapping(object.liquidblend, context.scene)
            layout.label(text=f"{times.time_of(context.scene.frame_current_final):.3f} of "
                              f"{times.duration_s:.3f} s")


class LIQUIDBLEND_PT_surface(_LiquidPanel, bpy.types.Panel):
    bl_label = "Surface"
    bl_parent_id = "LIQUIDBLEND_PT_main"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split, layout.use_property_decorate = True, False
        for name in ("level_of_detail", "smoothing_passes", "shading", "velocities",
                     "rest_positions", "up"):
            layout.prop(context.object.liquidblend, name)
        layout.label(text=f"{playback.state_of(context.object).num_triangles} triangles")


class LIQUIDBLEND_PT_bake(_LiquidPanel, bpy.types.Panel):
    bl_label = "Bake"
    bl_parent_id = "LIQUIDBLEND_PT_main"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        self.layout.prop(context.object.liquidblend, "bake")
        self.layout.operator("liquidblend.bake", icon='FILE_TICK')


class LIQUIDBLEND_UL_pairs(bpy.types.UIList):
    def draw_item(self, _context, layout, _data, pair, _icon, _active, _property, index):
        names = [empty.name if empty else "?" for empty in (pair.source, pair.target)]
        layout.label(text=f"{index}: {names[0]} > {names[1]}",
                     icon='LOCKED' if pair.hard else 'UNLOCKED')


class LIQUIDBLEND_PT_pairs(_LiquidPanel, bpy.types.Panel):
    bl_label = "Correspondences"
    bl_parent_id = "LIQUIDBLEND_PT_main"
    bl_options = {'DEFAULT_CLOSED'}

    def draw(self, context):
        layout, settings = self.layout, context.object.liquidblend
        row = layout.row()
        row.template_list("LIQUIDBLEND_UL_pairs", "", settings, "pairs", settings, "active_pair")
        column = row.column(align=True)
        column.operator("liquidblend.pair_add", text="", icon='ADD')
        column.operator("liquidblend.pair_remove", text="", icon='REMOVE')
        layout.use_property_split, layout.use_property_decorate = True, False
        if 0 <= settings.active_pair < len(settings.pairs):
            self._draw_pair(layout, settings.pairs[settings.active_pair])
        for name in ("new_family", "source_animation", "target_animations"):
            layout.prop(settings, name)
        layout.operator("liquidblend.register", icon='CON_TRACKTO')

    def _draw_pair(self, layout, pair):
        for name in ("source", "source_frame", "target", "target_frame", "target_index", "kind",
                     "hard"):
            layout.prop(pair, name)
        if pair.kind != 'point':
            layout.prop(pair, "length_s")


CLASSES = (LIQUIDBLEND_PT_main, LIQUIDBLEND_PT_blend, LIQUIDBLEND_PT_surface, LIQUIDBLEND_PT_bake,
           LIQUIDBLEND_UL_pairs, LIQUIDBLEND_PT_pairs)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
