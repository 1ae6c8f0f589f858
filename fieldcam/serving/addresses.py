"""Where the server listens, and whether a request was really meant for it."""

from __future__ import annotations

import socket
from contextlib import suppress
from ipaddress import ip_address
from urllib.parse import urlsplit

from aiohttp import web

from fieldcam.errors import BadInput

_ELSEWHERE = ("192.0.2.1", 9)
"""An address kept for documentation: nothing is sent there."""


def listen(host: str, port: int) -> socket.socket:
    """A listening socket; port 0 takes one that is free."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except OSError as error:
        raise BadInput(
            f"Nothing can listen at {host}, port {port}: {error.strerror}.",
            "Choose another --port, or an address of this machine as --host.",
        ) from error


def is_for_this_machine_only(listener: socket.socket) -> bool:
    return ip_address(listener.getsockname()[0]).is_loopback


def page_address(listener: socket.socket) -> str:
    """What is typed in the browser."""
    host, port = listener.getsockname()[:2]
    if ip_address(host).is_unspecified:
        host = _own_address()
    return f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"


def is_own_name(host: str) -> bool:
    """Whether a request names this machine, and not a name that somebody else made point to it."""
    with suppress(ValueError):
        name = urlsplit(f"//{host}").hostname or ""
        here = socket.gethostname().lower()
        if name in ("localhost", here, f"{here}.local"):
            return True
        ip_address(name)
        return True
    return False


def is_own_origin(request: web.Request) -> bool:
    """Whether it comes from a page of this server; browsers cannot hide it."""
    with suppress(ValueError):
        return urlsplit(request.headers.get("Origin", "")).netloc == request.host
    return False


def _own_address() -> str:
    """The address by which others on the network reach this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.connect(_ELSEWHERE)
        return str(probe.getsockname()[0])
    return socket.gethostname()
