"""What the operators have in common: gather from the scene in small steps, run programs in a thread, put the result into the scene, at once for
undo. The interface goes on meanwhile; Esc or the panel's button cancels; when anything fails the scene stays as it was.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import time

import bpy

from .programs import Cancelled, Job, Trouble

SLICE = 0.05  # seconds of gathering between two looks at the interface


class State:
    """Of the job that runs now, and of the last one. For the panel."""
    job = None       # the Job, or None while the scene is gathered
    title = ""       # of the operator that runs, else ""
    progress = (0, 0)
    cancel = False
    lines = []       # what was said last
    failed = False


def redraw():
    manager = bpy.context.window_manager
    for window in manager.windows if manager else ():
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


class Work:
    """Base of the operators. A class of it has
        gather(context): a generator over (done, total), on the main thread; its value goes to
        compute(job, gathered): in a thread, with programs; its value goes to
        finish(context, result): on the main thread; makes the objects.
    Called by a script (EXEC_DEFAULT) it waits; called by a button it is modal."""
    bl_options = {"UNDO"}

    @classmethod
    def poll(cls, context):
        return not State.title

    def gather(self, context):
        yield from ()

    # ---- by a script ----

    def execute(self, context):
        self._begin()
        try:
            gathering = self.gather(context)
            while True:
                try:
                    next(gathering)
                except StopIteration as end:
                    gathered = end.value
                    break
            self._start(gathered)
            self.job.wait()
            return self._conclude(context)
        except Exception as error:
            return self._fail(error)

    # ---- by a button ----

    def invoke(self, context, event):
        self._begin()
        self.gathering = None
        try:
            self.gathering = self.gather(context)
        except Exception as error:
            return self._fail(error)
        manager = context.window_manager
        self.timer = manager.event_timer_add(0.05, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" and event.value == "PRESS":
            State.cancel = True
        if event.type != "TIMER":
            return {"RUNNING_MODAL"} if event.type == "ESC" else {"PASS_THROUGH"}
        try:
            return self._step(context)
        except Exception as error:
            self._leave(context)
            return self._fail(error)

    def cancel(self, context):
        """Blender leaves: another file is opened, or the window closes."""
        if self.job:
            self.job.cancel()
        self._leave(context)
        State.title, State.job = "", None

    def _step(self, context):
        if State.cancel:
            if self.job:
                self.job.cancel()
                self.job.wait()
            raise Cancelled
        if self.job is None:
            limit = time.monotonic() + SLICE
            while self.job is None and time.monotonic() < limit:
                try:
                    State.progress = next(self.gathering)
                except StopIteration as end:
                    self._start(end.value)
        elif not self.job.running:
            self._leave(context)
            return self._conclude(context)
        else:
            State.progress = self.job.done, self.job.total
        redraw()
        return {"PASS_THROUGH"}

    def _leave(self, context):
        if getattr(self, "timer", None):
            context.window_manager.event_timer_remove(self.timer)
            self.timer = None

    # ---- both ----

    def _begin(self):
        self.job, self.timer = None, None
        State.title, State.progress, State.cancel, State.job = self.bl_label, (0, 0), False, None
        State.lines, State.failed = [], False

    def _start(self, gathered):
        self.job = State.job = Job(lambda job: self.compute(job, gathered))
        self.job.start()

    def _conclude(self, context):
        if self.job.error is not None:
            raise self.job.error
        made = self.finish(context, self.job.result)
        self._close()
        if made:
            self.report({"INFO"}, made)
        return {"FINISHED"}

    def _close(self):
        State.lines = self.job.text() if self.job else []
        State.title, State.job = "", None
        redraw()

    def _fail(self, error):
        self._close()
        if isinstance(error, Cancelled):
            State.lines = ["cancelled"]
            return {"CANCELLED"}
        if isinstance(error, ReferenceError):
            error = Trouble("an object that was in use has been removed")
        State.failed = True
        if str(error) not in State.lines:
            State.lines = State.lines + [str(error)]
        if not isinstance(error, Trouble):
            import traceback
            traceback.print_exception(error)
        self.report({"ERROR"}, str(error))
        return {"CANCELLED"}


class VG_OT_cancel(bpy.types.Operator):
    """End what runs now; the scene stays as it is"""
    bl_idname, bl_label = "vg.cancel", "Cancel"

    @classmethod
    def poll(cls, context):
        return bool(State.title)

    def execute(self, context):
        State.cancel = True
        return {"FINISHED"}


classes = (VG_OT_cancel,)
