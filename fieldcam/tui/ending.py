"""Ends an app in good order when a signal asks for it.

Textual hears no signal but Ctrl-C's: the others would kill it at once and leave the
terminal in raw mode, on the alternate screen.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from codecs import IncrementalDecoder, getincrementaldecoder
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from types import FrameType
from typing import Any, Generic, TextIO, TypeVar, cast

from textual.app import App
from textual.driver import Driver
from textual.drivers import linux_driver
from textual.drivers.linux_driver import LinuxDriver
from textual.worker import WorkerFailed

from fieldcam.errors import Stopped
from fieldcam.tui.text.ascii_only import has_utf8, in_ascii

Result = TypeVar("Result")
SIGNALS = (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)


class Output:
    """A terminal's output that may go away; without one nothing is written.

    Textual's writing thread would die of the error, and the app wait for it for ever.
    A terminal without UTF-8 gets ASCII only.
    """

    def __init__(self, terminal: TextIO) -> None:
        self._terminal = terminal
        self._has_utf8 = has_utf8(os.environ) and terminal.encoding.lower() in ("utf-8", "utf8")

    def write(self, text: str) -> None:
        with suppress(OSError):
            self._terminal.write(text if self._has_utf8 else in_ascii(text))

    def flush(self) -> None:
        with suppress(OSError):
            self._terminal.flush()

    def fileno(self) -> int:
        return self._terminal.fileno()


def _forgiving(encoding: str) -> Callable[[], IncrementalDecoder]:
    """In place of Textual's strict one: a key of another encoding would end the app."""
    return partial(getincrementaldecoder(encoding), errors="replace")


vars(linux_driver)["getincrementaldecoder"] = _forgiving


class TerminalDriver(LinuxDriver):
    """Textual's own, for a terminal that may be closed."""

    def start_application_mode(self) -> None:
        assert sys.__stderr__ is not None  # the app is run at a terminal only
        self._file = cast(Any, Output(sys.__stderr__))
        super().start_application_mode()  # type: ignore[no-untyped-call]


class EndableApp(App[Result], Generic[Result]):
    """An app that can be told to end at any moment, also before it runs."""

    _loop_of_app: asyncio.AbstractEventLoop | None = None
    _is_to_end = False

    def get_driver_class(self) -> type[Driver]:
        found = super().get_driver_class()
        return TerminalDriver if found is LinuxDriver else found

    def on_mount(self) -> None:
        self._loop_of_app = asyncio.get_running_loop()
        if self._is_to_end:
            self.exit()

    def end_soon(self) -> None:
        """May be called from the handler of a signal."""
        self._is_to_end = True
        if self._loop_of_app is not None:
            self._loop_of_app.call_soon_threadsafe(self.exit)

    def action_help_quit(self) -> None:
        """Ctrl+C does nothing here; Textual's own answer covers the buttons."""

    def raise_defect(self) -> None:
        """To be called when it has run; raises where it ended in the middle, and why."""
        if self.return_code:
            error = self._exception
            cause = error.error if isinstance(error, WorkerFailed) else error
            raise RuntimeError("The screen ended in the middle.") from cause

    def _fatal_error(self) -> None:
        """Without Textual's traceback on the terminal; the log gets it by `raise_defect`."""
        self._close_messages_no_wait()


@contextmanager
def ended_by_signals(app: EndableApp[Any]) -> Iterator[None]:
    """Signals end the app, and only the app; raises Stopped after it where one came."""
    heard: list[int] = []

    def hear(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        app.end_soon()

    before = {number: signal.signal(number, hear) for number in SIGNALS}
    try:
        yield
    except OSError:
        if signal.SIGHUP not in heard:
            raise  # else the last words had no terminal to go to
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if heard:
        raise Stopped(heard[0])
