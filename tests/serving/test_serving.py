"""The phone's server: who may look, and that every browser's app ends with it."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from time import monotonic
from typing import TypeAlias

import pytest

pytest.importorskip("textual_serve", reason="the extra `serve` is not installed")
from aiohttp import ClientSession, ClientWebSocketResponse, WSServerHandshakeError, web
from aiohttp.test_utils import TestClient, TestServer
from served_pages import serving
from stored_walks import MadeWalk, small_store

from fieldcam.cli import main
from fieldcam.errors import ExitCode
from fieldcam.serving.addresses import is_own_name, listen, page_address
from fieldcam.serving.gate import TRIES, Gate
from fieldcam.serving.logs import keep_terminal_quiet
from fieldcam.serving.server import MAX_SCREENS, PASS, PhoneServer

PATIENCE_S = 20.0
CLOSED = ("/phone.js", "/here", "/static/js/textual.js", "/static/css/xterm.css", "/ws", "/else")
APP = """
import os, sys, threading
os.write(1, b"__GANGLION__\\n")
text = f"pid {os.getpid()} size {os.environ['COLUMNS']}x{os.environ['ROWS']}".encode()
os.write(1, b"D" + len(text).to_bytes(4, "big") + text)
while packet := os.read(0, 1000):
    if b"quit" in packet and len(sys.argv) == 1:
        break
    os.write(1, b"D" + len(packet).to_bytes(4, "big") + packet)
"""
"""Speaks like one of Textual's apps: says who it is, then gives back what it gets."""
Client: TypeAlias = TestClient[web.Request, web.Application]


class Shown:
    """A laptop's screen that remembers the codes."""

    def __init__(self) -> None:
        self.codes: list[str] = []
        self.gate = Gate(self.codes.append, wrong_s=0.0)


def served(gate: Gate | None, script: Callable[[Client], Awaitable[None]], *more: str) -> None:
    """Run a script against a server at a free port."""

    async def run() -> None:
        server = PhoneServer((sys.executable, "-c", APP, *more), gate)
        async with TestClient(TestServer(server.application())) as client:
            await script(client)

    asyncio.run(asyncio.wait_for(run(), PATIENCE_S))


def origin(client: Client) -> dict[str, str]:
    return {"Origin": f"http://{client.host}:{client.port}"}


async def pid_of(socket: ClientWebSocketResponse) -> int:
    said = (await socket.receive_bytes()).decode()
    return int(said.split()[1])


async def status_of_socket(client: Client, headers: dict[str, str]) -> int:
    with pytest.raises(WSServerHandshakeError) as refused:
        await client.ws_connect("/ws", headers=headers)
    return refused.value.status


def has_ended(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return True
    return state == "Z"


async def ended(pid: int) -> None:
    deadline_s = monotonic() + PATIENCE_S
    while not has_ended(pid):
        assert monotonic() < deadline_s, "the app is still there"
        await asyncio.sleep(0.01)


def test_on_this_machine_no_code_is_asked() -> None:
    async def script(client: Client) -> None:
        for path in ("/", *CLOSED[:4]):
            assert (await client.get(path)).status in (200, 204), path
        page = await client.get("/")
        assert "textual-terminal" in await page.text()
        async with client.ws_connect("/ws?width=48&height=46", headers=origin(client)) as socket:
            assert b"size 48x46" in await socket.receive_bytes()

    served(None, script)


def test_nothing_in_the_page_comes_from_elsewhere() -> None:
    async def script(client: Client) -> None:
        for path in ("/", "/phone.js"):
            answer = await client.get(path)
            assert "//" not in re.sub(r"^\s*//.*$", "", await answer.text(), flags=re.MULTILINE)
            assert "default-src 'self'" in answer.headers["Content-Security-Policy"]

    served(None, script)


def test_without_the_code_everything_is_closed() -> None:
    async def script(client: Client) -> None:
        page = await client.get("/")
        assert 'name="code"' in await page.text()
        for path in CLOSED:
            assert (await client.get(path, headers=origin(client))).status == 403, path
        client.session.cookie_jar.update_cookies({PASS: "guessed"})
        assert await status_of_socket(client, origin(client)) == 403

    served(Shown().gate, script)


def test_the_code_lets_one_browser_in() -> None:
    shown = Shown()

    async def script(client: Client) -> None:
        typed = {"code": f"{shown.codes[-1][:4]} {shown.codes[-1][4:]}"}
        answer = await client.post("/code", data=typed, headers=origin(client))
        assert answer.status == 200 and "textual-terminal" in await answer.text()
        (cookie,) = answer.history[0].headers.getall("Set-Cookie")
        assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
        for path in CLOSED[:4]:
            assert (await client.get(path)).status in (200, 204), path
        async with client.ws_connect("/ws", headers=origin(client)) as socket:
            await pid_of(socket)
        client.session.cookie_jar.clear()
        again = await client.post("/code", data=typed, headers=origin(client))
        assert again.status == 403
        assert len(shown.codes) == 2

    served(shown.gate, script)


def test_wrong_codes_lock_nobody_out() -> None:
    """Somebody tries codes without a pause; the operator's is taken at once all the same."""
    shown = Shown()

    async def script(client: Client) -> None:
        right = shown.codes[0]
        wrong = "00000000" if right != "00000000" else "11111111"
        for typed in [wrong] * 20 + ["é", ""]:
            answer = await client.post("/code", data={"code": typed}, headers=origin(client))
            assert answer.status == 403 and "That is not the code." in await answer.text()
        assert shown.codes == [right]
        late = await client.post("/code", data={"code": right}, headers=origin(client))
        assert late.status == 200

    served(shown.gate, script)


def test_nobody_waits_for_the_wrong_codes_of_others() -> None:
    async def tries() -> float:
        codes: list[str] = []
        gate = Gate(codes.append, wrong_s=5.0)
        others = [asyncio.create_task(gate.admit("", f"10.0.0.{n}")) for n in range(20)]
        await asyncio.sleep(0)
        started = monotonic()
        assert await gate.admit(codes[0], "10.0.1.1") is not None
        for other in others:
            other.cancel()
        return monotonic() - started

    assert asyncio.run(tries()) < 1.0


def test_an_address_tries_one_code_at_a_time() -> None:
    async def tries() -> None:
        codes: list[str] = []
        gate = Gate(codes.append, wrong_s=0.05)
        wrong = asyncio.create_task(gate.admit("", "10.0.0.1"))
        await asyncio.sleep(0)
        assert await gate.admit(codes[0], "10.0.0.1") is None
        await wrong
        assert await gate.admit(codes[0], "10.0.0.1") is not None

    asyncio.run(tries())


def test_very_many_wrong_codes_make_another_one() -> None:
    async def tries() -> None:
        codes: list[str] = []
        gate = Gate(codes.append, wrong_s=0.0)
        for _ in range(TRIES):
            await gate.admit("", "10.0.0.1")
        assert len(codes) == 2

    asyncio.run(tries())


FORM = "application/x-www-form-urlencoded"
ODD = {
    "no boundary": ("POST /code", "multipart/form-data", b"abcde"),
    "another boundary": ("POST /code", "multipart/form-data; boundary=x", b"abcde"),
    "an unknown alphabet": ("POST /code", f"{FORM}; charset=nonsense", b"code=12"),
    "no text": ("POST /code", FORM, b"code=\xff\xfe"),
    "half a letter": ("POST /code", FORM, b"code=%ed%a0%80"),
    "a long name": (f"GET /static/{'a' * 5000}", FORM, b""),
    "a name with an end": ("GET /static/%00", FORM, b""),
    "no socket": ("GET /ws", FORM, b""),
    "no protocol": ("GET / HTTP/9.9\r\n", FORM, b""),
    "noise": ("\x16\x03\x01", FORM, b"\xff" * 100),
}


@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
@pytest.mark.parametrize("resets", [False, True])
def test_whatever_is_sent_the_terminal_stays_quiet(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], odd: tuple[str, str, bytes], resets: bool
) -> None:
    line, kind, body = odd
    keep_terminal_quiet(tmp_path)

    async def script(client: Client) -> None:
        here = f"{client.host}:{client.port}"
        reader, writer = await asyncio.open_connection(client.host, client.port)
        head = (
            f"{line} HTTP/1.1\r\nHost: {here}\r\nOrigin: http://{here}\r\n"
            f"Content-Type: {kind}\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        writer.write(head.encode() + body)
        await writer.drain()
        if not resets:
            status = (await reader.readline()).split()[1]
            assert status in (b"400", b"403", b"404")
        writer.transport.abort()
        assert (await client.get("/")).status == 200

    served(None if line.startswith("GET") else Shown().gate, script)
    assert "Traceback" not in capfd.readouterr().err


FOREIGN = {
    "foreign": {"Origin": "http://elsewhere.example"},
    "other port": {"Origin": "http://127.0.0.1:1"},
    "opaque": {"Origin": "null"},
    "none": {},
}


@pytest.mark.parametrize("headers", FOREIGN.values(), ids=FOREIGN)
def test_a_foreign_page_opens_no_socket(headers: dict[str, str]) -> None:
    shown = Shown()

    async def script(client: Client) -> None:
        assert await status_of_socket(client, headers) == 403
        code = {"code": shown.codes[-1]}
        assert (await client.post("/code", data=code, headers=headers)).status == 403

    served(None, script) if headers else None
    served(shown.gate, script)


def test_a_name_that_somebody_else_points_here_is_refused() -> None:
    async def script(client: Client) -> None:
        for host in ("elsewhere.example", f"elsewhere.example:{client.port}", "[::1"):
            named = {"Host": host, "Origin": f"http://{host}"}
            assert (await client.get("/", headers=named)).status == 403

    served(None, script)
    assert all(map(is_own_name, ("localhost:1", "127.0.0.1:1", "[::1]:1", "192.168.1.7")))


def test_a_browser_that_goes_away_ends_its_app() -> None:
    async def script(client: Client) -> None:
        async with client.ws_connect("/ws", headers=origin(client)) as socket:
            pid = await pid_of(socket)
        await ended(pid)

    served(None, script)


def test_an_app_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fieldcam.serving.screen.ENDING_S", 0.05)
    pids: list[int] = []

    async def script(client: Client) -> None:
        async with client.ws_connect("/ws", headers=origin(client)) as socket:
            pids.append(await pid_of(socket))
        await ended(pids[0])

    served(None, script, "stubborn")


def test_the_servers_end_ends_all_apps() -> None:
    pids: list[int] = []

    async def script(client: Client) -> None:
        for _ in range(2):
            pids.append(await pid_of(await client.ws_connect("/ws", headers=origin(client))))
        assert not any(map(has_ended, pids))

    served(None, script)
    assert all(map(has_ended, pids))


def test_only_so_many_browsers_have_an_app() -> None:
    async def script(client: Client) -> None:
        for _ in range(MAX_SCREENS):
            await pid_of(await client.ws_connect("/ws", headers=origin(client)))
        assert await status_of_socket(client, origin(client)) == 503

    served(None, script)


def test_what_is_no_message_of_the_page_is_ignored() -> None:
    async def script(client: Client) -> None:
        path = "/ws?width=-3&height=x"
        async with client.ws_connect(path, headers=origin(client)) as socket:
            assert b"size 10x10" in await socket.receive_bytes()
            for text in ("", "7", "[]", '["resize", 3]', '["stdin", 5]', '["ping"]', '{"a": []}'):
                await socket.send_str(text)
            await socket.send_bytes(b"x")
            await socket.send_str('["resize", {"width": 1e9, "height": 30}]')
            await socket.send_str('["stdin", "d\\ud800"]')
            got = b""
            while b"d?" not in got:
                got += await socket.receive_bytes()
            assert b'"width": 10' in got and b'"height": 30' in got

    served(None, script)


async def first_screen(session: ClientSession, url: str, part: str) -> ClientWebSocketResponse:
    """A socket whose app has shown this."""
    headers = {"Origin": url.rstrip("/")}
    socket = await session.ws_connect(f"{url}ws?width=48&height=46", headers=headers)
    shown = ""
    while part not in shown:
        shown += (await socket.receive_bytes()).decode()
    return socket


def children(pid: int) -> list[int]:
    return [int(n) for n in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@pytest.mark.parametrize(
    "number",
    [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)],
    ids=lambda number: number.name,
)
def test_the_command_shows_the_walk_and_ends_with_its_apps(
    number: signal.Signals, tmp_path: Path
) -> None:
    with small_store(tmp_path) as store:
        made = MadeWalk(store)
        made.take(made.visit(), 11)

    async def look(process: subprocess.Popen[str], url: str) -> int:
        async with ClientSession() as session:
            await asyncio.wait_for(first_screen(session, url, "Saved. It is being read"), 60)
            (app,) = children(process.pid)
            os.kill(process.pid, number)
            await ended(app)
        return process.wait(PATIENCE_S)

    with serving(tmp_path) as (process, url):
        assert asyncio.run(look(process, url)) == (0 if number is signal.SIGINT else -number)


def test_a_port_that_is_taken_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        assert page_address(taken) == f"http://127.0.0.1:{port}/"
        assert main(["serve", "--port", str(port)]) == ExitCode.BAD_INPUT
    assert f"Nothing can listen at 127.0.0.1, port {port}: " in capsys.readouterr().err
    assert main(["serve", "--port", "65536"]) == ExitCode.BAD_INPUT


def test_other_machines_are_asked_for_a_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    gates: list[Gate | None] = []
    monkeypatch.setattr(
        "fieldcam.serving.server.run", lambda server, listener: gates.append(server._gate)
    )
    for host in ("127.0.0.1", "localhost", "0.0.0.0"):
        assert main(["serve", "--host", host, "--port", "0"]) == ExitCode.OK
    assert [gate is None for gate in gates] == [True, True, False]
    assert re.search(r"Code for the next browser: \d{4} \d{4}\n", capsys.readouterr().err)


def test_a_folder_without_a_walk_is_said_and_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("fieldcam.serving.server.run", lambda server, listener: None)
    absent, there = tmp_path / "absent", tmp_path / "there"
    small_store(there).close()
    for folder, waits in ((absent, True), (there, False)):
        assert main(["--data", str(folder), "serve", "--port", "0"]) == ExitCode.OK
        said = capsys.readouterr().err
        assert ("the page waits for one: There is no data folder" in said) == waits
    assert not absent.exists()


def test_without_the_extra_one_sentence_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "fieldcam.serving.addresses")
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    assert main(["serve"]) == ExitCode.BAD_INPUT
    assert "pip install 'fieldcam[serve]'" in capsys.readouterr().err
