"""Who may look: whoever typed the code that the laptop shows; each code lets one browser in."""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections.abc import Callable

DIGITS = 6
TRIES = 5
"""Wrong ones, before the code is another."""
WRONG_S = 1.0
"""Nobody tries more than one code in this time, whatever the number of connections."""


class Gate:
    """`show` is called with each new code."""

    def __init__(self, show: Callable[[str], None], wrong_s: float = WRONG_S) -> None:
        self._show, self._wrong_s = show, wrong_s
        self._trying = asyncio.Lock()
        self._passes: list[str] = []
        self._renew()

    async def admit(self, typed: str) -> str | None:
        """A pass for this browser, or None where it is another code."""
        async with self._trying:
            if _same("".join(typed.split()), self._code):
                self._passes.append(secrets.token_urlsafe(32))
                self._renew()
                return self._passes[-1]
            await asyncio.sleep(self._wrong_s)
            self._tries += 1
            if self._tries == TRIES:
                self._renew()
            return None

    def knows(self, shown: str) -> bool:
        """Whether this is a pass."""
        return any([_same(shown, given) for given in self._passes])

    def _renew(self) -> None:
        self._code, self._tries = f"{secrets.randbelow(10**DIGITS):0{DIGITS}}", 0
        self._show(self._code)


def _same(left: str, right: str) -> bool:
    """In a time that tells nothing of where they differ."""
    return hmac.compare_digest(left.encode(), right.encode())
