"""What operators share."""

from . import tasks, words


def liquid_of(context):
    object = context.object
    return object if object and object.type == 'MESH' and object.liquidblend.enabled else None


class OfLiquid:
    """The active object is a liquid."""

    @classmethod
    def poll(cls, context):
        return liquid_of(context) is not None


class OfIdleLiquid:
    """Likewise, and no task runs."""

    @classmethod
    def poll(cls, context):
        return liquid_of(context) is not None and not tasks.is_running()


def start_task(operator, title, work):
    try:
        tasks.start(title, work)
    except RuntimeError as error:
        operator.report({'ERROR'}, words.of_error(error))
        return {'CANCELLED'}
    return {'FINISHED'}
