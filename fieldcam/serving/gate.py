"""Who may look: whoever typed the code that the laptop shows; each code lets one browser in."""

from __future__ import annotations

import asyncio
import hmac
import secrets
from collections.abc import Callable

DIGITS = 8
TRIES = 10_000
"""Wrong ones, before the code is another: rare enough that nobody can keep a code from being
typed, and one in 10,000 that somebody guesses it before."""
WRONG_S = 1.0
"""Nobody tries more than one code in this time from one address; others do not wait for it."""


class Gate:
    """`show` is called with each new code."""

    def __init__(self, show: Callable[[str], None], wrong_s: float = WRONG_S) -> None:
        self._show, self._wrong_s = show, wrong_s
        self._waiting: set[str] = set()
        """Addresses that tried a wrong code just now."""
        self._passes: list[str] = []
        self._renew()

    async def admit(self, typed: str, address: str) -> str | None:
        """A pass for this browser, or None where it is another code, or was tried too soon."""
        if address in self._waiting:
            return None
        if _same("".join(typed.split()), self._code):
            self._passes.append(secrets.token_urlsafe(32))
            self._renew()
            return self._passes[-1]
        self._waiting.add(address)
        try:
            await asyncio.sleep(self._wrong_s)
        finally:
            self._waiting.discard(address)
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
    return hmac.compare_digest(left.encode(errors="replace"), right.encode(errors="replace"))
