"""Runs work in Blender's main thread, which alone may export while Blender's window is in use.

F12 renders in a thread of its own, whose context has no window and no active object.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any

import bpy

# How long work waits for the main thread's next look.
_LOOK_S = 0.05

_work: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()


def _look() -> float:
    while not _work.empty():
        _work.get()()
    return _LOOK_S


def with_window(work: Callable[[], Any]) -> Any:
    """A timer has no window; the exporter looks for the active object of one."""
    windows = bpy.context.window_manager.windows
    if bpy.context.window is not None or not windows:
        return work()
    with bpy.context.temp_override(window=windows[0]):
        return work()


def in_main_thread(work: Callable[[], Any]) -> Any:
    """Returns the result of work(), or raises its exception."""
    if threading.current_thread() is threading.main_thread():
        return with_window(work)
    done = threading.Event()
    results: list[Any] = []
    faults: list[Exception] = []

    def run() -> None:
        try:
            results.append(with_window(work))
        except Exception as fault:
            faults.append(fault)
        done.set()

    _work.put(run)
    done.wait()
    if faults:
        raise faults[0]
    return results[0]


def attach() -> None:
    # Without a window all renders run in the main thread.
    if not bpy.app.background:
        bpy.app.timers.register(_look, persistent=True)


def detach() -> None:
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
