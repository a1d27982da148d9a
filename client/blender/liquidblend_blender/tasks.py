"""Work that takes long: on a thread in Blender's window, at once in the background."""

import threading

import bpy

from . import words


class Cancelled(Exception):
    """The user has stopped a task."""


class Task:
    """One that runs, or has run. Reading it is safe from any thread."""

    def __init__(self, title, is_stepwise=False):
        self.title = title
        self.is_stepwise = is_stepwise  # on the main thread, between events of the window
        self.stage = ""
        self.fraction = 0.0
        self.error = ""
        self.result = ""
        self.is_done = False
        self.is_cancelled = False

    def report(self, stage, fraction):
        """What is being done; ends the task if the user has stopped it."""
        self.stage, self.fraction = words.clean(stage), fraction
        if self.is_cancelled:
            raise Cancelled("stopped")

    def run(self, work):
        try:
            self.result = work(self.report) or ""
        except Cancelled as stop:
            self.error = words.of_error(stop)
        except Exception as error:
            self.error = words.of_error(error)
            if isinstance(error, (TypeError, AttributeError, LookupError, NameError)):
                words.tell_trace()
        self.is_done = True


current = None


def is_running():
    return current is not None and not current.is_done


def start(title, work):
    """Runs work(report), which touches nothing of Blender's and returns a line for the user.

    In the background it is done when this returns. Raises RuntimeError then if it has failed.
    """
    global current
    current = Task(title)
    if bpy.app.background:
        current.run(work)
        if current.error:
            raise RuntimeError(f"{title}: {current.error}")
        return current
    threading.Thread(target=current.run, args=(work,), daemon=True).start()
    bpy.app.timers.register(_show_progress, first_interval=0.1)
    return current


def _show_progress():
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == 'VIEW_3D':
                area.tag_redraw()
    return 0.2 if is_running() else None


class StepwiseOperator:
    """An operator whose work is a generator on the main thread: one step a timer's tick in the
    window, all at once in the background. It yields (stage, fraction)."""

    _timer = None
    title = ""

    def begin(self, context, steps):
        global current
        current = self._task = Task(self.title, is_stepwise=True)
        self._steps = steps
        if bpy.app.background:
            while not self._step():
                pass
            return self._end(context)
        self._timer = context.window_manager.event_timer_add(0.01, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {'RUNNING_MODAL'}

    def modal(self, context, event):
        if event.type == 'ESC':
            self._task.is_cancelled = True
        if event.type == 'TIMER' and self._step():
            return self._end(context)
        return {'RUNNING_MODAL'}

    def cancel(self, context):
        """The window closes."""
        self._task.error, self._task.is_done = "stopped", True
        self._end(context)

    def _step(self):
        """Does one step; True if it was the last."""
        is_last = []

        def work(report):
            try:
                report(*next(self._steps))
            except StopIteration as end:
                is_last.append(True)
                return end.value
            return ""

        self._task.run(work)
        self._task.is_done = bool(is_last or self._task.error)
        return self._task.is_done

    def _end(self, context):
        self._steps.close()
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
        if self._task.error:
            self.report({'ERROR'}, f"{self.title}: {self._task.error}")
            return {'CANCELLED'}
        self.report({'INFO'}, f"{self.title}: {self._task.result}")
        return {'FINISHED'}


def unregister():
    if bpy.app.timers.is_registered(_show_progress):
        bpy.app.timers.unregister(_show_progress)
