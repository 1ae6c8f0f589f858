"""The phone's page in a real browser: both ways to hold it, both themes."""

from __future__ import annotations

import asyncio
import base64
import itertools
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any

import cv2
import numpy as np
import pytest

pytest.importorskip("textual_serve", reason="the extra `serve` is not installed")
from aiohttp import ClientSession, ClientWebSocketResponse
from served_pages import serving
from stored_walks import MadeWalk, small_store

pytestmark = pytest.mark.browser
CHROMIUM = shutil.which("chromium") or ""
UPRIGHT, LYING = (390, 844), (844, 390)
PATIENCE_S = 60.0
KEPT = os.environ.get("FIELDCAM_PHONE_PICTURES", "")
"""A folder for the pictures, to be looked at."""


class Browser:
    """One page of a browser, driven by its debugging protocol."""

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        self._socket, self._numbers = socket, itertools.count(1)

    async def ask(self, method: str, **parameters: object) -> dict[str, Any]:
        number = next(self._numbers)
        await self._socket.send_json({"id": number, "method": method, "params": parameters})
        while (answer := await self._socket.receive_json()).get("id") != number:
            pass
        assert "result" in answer, answer
        result: dict[str, Any] = answer["result"]
        return result

    async def open(self, page: str) -> None:
        await self.ask("Page.enable")
        await self.ask("Page.navigate", url=page)
        while (await self._socket.receive_json()).get("method") != "Page.loadEventFired":
            pass

    async def hold(self, size: tuple[int, int]) -> None:
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": True}
        await self.ask("Emulation.setDeviceMetricsOverride", **metrics)

    async def tap_day_or_night(self, size: tuple[int, int]) -> None:
        """The right one of the two big buttons at the bottom."""
        place = {"x": size[0] * 0.75, "y": size[1] - 45, "button": "left", "clickCount": 1}
        for kind in ("mousePressed", "mouseReleased"):
            await self.ask("Input.dispatchMouseEvent", type=kind, **place)

    async def picture(self) -> np.ndarray[Any, np.dtype[np.uint8]]:
        shot = await self.ask("Page.captureScreenshot", format="png")
        content = np.frombuffer(base64.b64decode(shot["data"]), np.uint8)
        return np.asarray(cv2.imdecode(content, cv2.IMREAD_GRAYSCALE), np.uint8)

    async def until(self, name: str, light: bool) -> None:
        """The page has this ground, and something is drawn on it; kept to be looked at."""
        until_s, seen = monotonic() + PATIENCE_S, np.zeros((1, 1), np.uint8)
        while monotonic() < until_s:
            seen = await self.picture()
            if (np.median(seen) > 128) == light and seen.std() > 20:
                break
        else:
            pytest.fail(f"{name}: median {np.median(seen)}, deviation {seen.std():.0f}")
        if KEPT:
            cv2.imwrite(str(Path(KEPT) / f"{name}.png"), seen)


@contextmanager
def chromium(folder: Path) -> Iterator[str]:
    """A headless browser; gives the address of its debugger."""
    command = [CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run"]
    command += ["--remote-debugging-port=0", f"--user-data-dir={folder}", "about:blank"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if found := re.search(r"DevTools listening on ws://([^/]+)/", line):
                yield f"http://{found[1]}"
                break
        else:
            pytest.fail("the browser gave no address")
    finally:
        process.kill()
        process.communicate()


@pytest.mark.skipif(not CHROMIUM, reason="chromium is not installed")
def test_the_page_upright_and_lying_in_both_themes(tmp_path: Path) -> None:
    with small_store(tmp_path / "data") as store:
        made = MadeWalk(store)
        visit = made.visit()
        made.read(made.take(visit, 11).key, 11)

    async def look(page: str, debugger: str) -> None:
        async with ClientSession() as session:
            async with session.get(f"{debugger}/json/list") as listed:
                target = next(t for t in await listed.json() if t["type"] == "page")
            async with session.ws_connect(target["webSocketDebuggerUrl"], max_msg_size=0) as socket:
                browser = Browser(socket)
                for name, size in (("upright", UPRIGHT), ("lying", LYING)):
                    await browser.open("about:blank")
                    await browser.hold(size)
                    await browser.open(page)
                    await browser.until(f"{name}-dark", light=False)
                    await browser.tap_day_or_night(size)
                    await browser.until(f"{name}-light", light=True)

    with serving(tmp_path / "data") as (_, page), chromium(tmp_path / "browser") as debugger:
        asyncio.run(asyncio.wait_for(look(page, debugger), 4 * PATIENCE_S))
