"""One browser's app, in a process of its own."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from textual_serve.app_service import AppService

ENDING_S = 3.0
"""How long an app may take to end before it is killed."""


class Screen(AppService):
    """Is gone for certain once it was stopped."""

    async def stop(self) -> None:
        """Ask it to end; kill it when it does not, as when nobody reads what it writes."""
        with suppress(TimeoutError):
            await asyncio.wait_for(super().stop(), ENDING_S)
        if self._process is None:
            return
        try:
            await asyncio.wait_for(self._process.wait(), ENDING_S)
        except TimeoutError:
            with suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
