"""The web server: one page, and a following app of its own for each browser that opens it."""

from __future__ import annotations

import asyncio
import json
import shlex
from collections.abc import Awaitable, Callable, Sequence
from importlib.resources import files
from pathlib import Path
from socket import socket as Socket
from urllib.parse import parse_qs

import textual_serve
from aiohttp import WSCloseCode, WSMessage, WSMsgType, web
from textual_serve.download_manager import DownloadManager

from fieldcam.serving.addresses import is_own_name, is_own_origin
from fieldcam.serving.gate import Gate
from fieldcam.serving.screen import ENDING_S, Screen

PAGES = files("fieldcam.serving") / "pages"
STATIC = Path(textual_serve.__file__).parent / "static"
PASS = "fieldcam-pass"
A_DAY_S = 86_400
MAX_SCREENS = 4
"""Browsers at a time, since each has a process."""
ALIVE_S = 15.0
"""How often a browser is asked whether it is still there."""
CELLS = (10, 400)
"""Fewest and most columns or rows that a browser may ask for."""
LONGEST_MESSAGE_BYTES = 1 << 16
LONGEST_FORM_BYTES = 1 << 12
HEADERS = {
    "Content-Security-Policy": "default-src 'self'; style-src 'self' 'unsafe-inline';"
    " connect-src 'self' ws: wss:; frame-ancestors 'none'",
    "Cache-Control": "no-cache",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}
Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class PhoneServer:
    """Runs `command` for each browser; without a gate everybody may look."""

    def __init__(self, command: Sequence[str], gate: Gate | None) -> None:
        # `exec` leaves no shell between this process and the app, which ends with its parent.
        self._command = f"exec {shlex.join(command)}"
        self._gate = gate
        self._open: dict[web.WebSocketResponse, Screen] = {}

    def application(self) -> web.Application:
        """All routes, behind one guard."""
        app = web.Application(middlewares=[self._guard], client_max_size=LONGEST_FORM_BYTES)
        app.router.add_get("/", self._page)
        app.router.add_get("/phone.js", self._script)
        app.router.add_get("/here", self._here)
        app.router.add_get("/ws", self._screen)
        app.router.add_post("/code", self._code)
        app.router.add_static("/static", STATIC)
        app.on_shutdown.append(self._close_all)
        return app

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        if not is_own_name(request.host):
            return _refusal("Open this page by the address that the laptop shows.")
        if request.path in ("/ws", "/code") and not is_own_origin(request):
            return _refusal("Another page asked for this.")
        if request.path not in ("/", "/code") and not self._may_look(request):
            return _refusal("The laptop shows a code: type it on the first page.")
        try:
            response = await handler(request)
        except (ValueError, LookupError, OSError):
            # What a stranger sends may be anything; a browser that is gone needs no answer.
            return _refusal("That cannot be answered.", status=400)
        if not response.prepared:
            response.headers.update(HEADERS)
        return response

    def _may_look(self, request: web.Request) -> bool:
        return self._gate is None or self._gate.knows(request.cookies.get(PASS, ""))

    async def _page(self, request: web.Request) -> web.Response:
        name = "phone.html" if self._may_look(request) else "code.html"
        return web.Response(text=_read(name), content_type="text/html")

    async def _script(self, request: web.Request) -> web.Response:
        return web.Response(text=_read("phone.js"), content_type="text/javascript")

    async def _here(self, request: web.Request) -> web.Response:
        """The page asks for this to know whether what it shows is of now."""
        return web.Response(status=204)

    async def _code(self, request: web.Request) -> web.Response:
        typed = parse_qs((await request.read()).decode("ascii", errors="replace")).get("code")
        given = None
        if self._gate is not None and typed:
            given = await self._gate.admit(typed[0], request.remote or "")
        if given is None:
            wrong = _read("code.html").replace("<!-- said -->", "That is not the code.")
            return web.Response(text=wrong, content_type="text/html", status=403)
        answer = web.Response(status=303, headers={"Location": "/"})
        answer.set_cookie(PASS, given, max_age=A_DAY_S, httponly=True, samesite="Strict")
        return answer

    async def _screen(self, request: web.Request) -> web.StreamResponse:
        if len(self._open) >= MAX_SCREENS:
            return web.Response(status=503, text="Too many browsers are open.")
        socket = web.WebSocketResponse(heartbeat=ALIVE_S, max_msg_size=LONGEST_MESSAGE_BYTES)
        await socket.prepare(request)

        async def close() -> None:
            await socket.close()

        screen = Screen(
            self._command,
            write_bytes=socket.send_bytes,
            write_str=socket.send_str,
            close=close,
            download_manager=DownloadManager(),
        )
        self._open[socket] = screen
        try:
            await screen.start(
                _cells(request.query.get("width")), _cells(request.query.get("height"))
            )
            async for message in socket:
                await _pass_on(message, screen)
        finally:
            # Whoever cancels this because the browser is gone must not spare the app.
            await asyncio.shield(self._end(socket))
        return socket

    async def _end(self, socket: web.WebSocketResponse) -> None:
        screen = self._open.get(socket)
        if screen is not None:
            await screen.stop()
            self._open.pop(socket, None)

    async def _close_all(self, app: web.Application) -> None:
        for socket in tuple(self._open):
            await self._end(socket)
            await socket.close(code=WSCloseCode.GOING_AWAY)


def run(server: PhoneServer, listener: Socket) -> None:
    """Serve until SIGINT or SIGTERM; all apps have ended when this returns."""
    application = server.application()
    web.run_app(
        application, sock=listener, print=None, access_log=None, shutdown_timeout=2 * ENDING_S
    )


def _refusal(sentence: str, status: int = 403) -> web.Response:
    return web.Response(status=status, text=f"{sentence}\n", headers=HEADERS)


def _read(name: str) -> str:
    return (PAGES / name).read_text(encoding="utf-8")


def _cells(number: object) -> int:
    """Columns or rows as a browser gives them, within reason."""
    try:
        found = int(str(number))
    except ValueError:
        return CELLS[0]
    return min(max(found, CELLS[0]), CELLS[1])


async def _pass_on(message: WSMessage, screen: Screen) -> None:
    """What textual-serve's script sends; anything else is ignored."""
    try:
        document = json.loads(message.data) if message.type is WSMsgType.TEXT else None
    except ValueError:
        return
    match document:
        case ["stdin", str(typed)]:
            await screen.send_bytes(typed.encode(errors="replace"))
        case ["resize", {"width": width, "height": height}]:
            await screen.set_terminal_size(_cells(width), _cells(height))
