"""Who may ask: the page of this server on this computer, and nobody else.

In this order: the host the browser believes it talks to, the page the request comes from, the token. Only
then the route. A foreign page reaches none of the handlers, not even through a name that it makes point here.
"""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from starlette.responses import PlainTextResponse

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

TOKEN_HEADER = b"x-rotordrop-token"
GUARDED = "/api/"
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
    "require-trusted-types-for 'script'; trusted-types 'none'"
)
HEADERS = {
    b"content-security-policy": POLICY.encode(),
    b"x-content-type-options": b"nosniff",
    b"x-frame-options": b"DENY",
    b"referrer-policy": b"no-referrer",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
    b"cache-control": b"no-store",
}


class Guard:
    """Lets requests of the own page through to an application.

    The port is part of the only host names that are its own; every request below ``/api/`` carries the token.
    """

    def __init__(self, app: App, *, port: int, token: str) -> None:
        self.app = app
        names = ("127.0.0.1", "localhost", "[::1]")
        self.hosts = {f"{name}:{port}".encode() for name in names}
        if port == 80:  # which browsers leave out
            self.hosts |= {name.encode() for name in names}
        self.token = token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on with the headers that every answer carries."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] != "http":
            return  # no web sockets: the server closes them

        async def headed(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                own = {key.lower() for key, _ in message.get("headers", ())}
                added = [(key, value) for key, value in HEADERS.items() if key not in own]
                message = {**message, "headers": [*message.get("headers", ()), *added]}
            await send(message)

        refusal = self.refusal(scope)
        if refusal is None:
            await self.app(scope, receive, headed)
            return
        status, words = refusal
        answer = PlainTextResponse(words, status_code=status, headers={"connection": "close"})
        await answer(scope, receive, headed)

    def refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Why a request is refused: status and sentence; None for one that may pass."""
        if (host := _only(scope, b"host")) not in self.hosts:
            return 403, "this server answers to 127.0.0.1 and localhost only"
        origins = _all(scope, b"origin")
        if origins and origins != [b"http://" + host]:
            return 403, "the request comes from a foreign page"
        path, reads = scope["path"], scope["method"] in ("GET", "HEAD")
        opened = reads and not path.startswith(GUARDED)
        sites = _all(scope, b"sec-fetch-site")
        if sites and sites != [b"same-origin"] and not (opened and sites == [b"none"]):
            return 403, "the request comes from a foreign page"
        if opened:
            return None
        given = _only(scope, TOKEN_HEADER)
        if given is None or not hmac.compare_digest(given, self.token):
            return 401, "the token is missing or wrong; open the address that 'rotordrop serve' printed"
        return None


def _all(scope: Scope, name: bytes) -> list[bytes]:
    return [value for key, value in scope["headers"] if key.lower() == name]


def _only(scope: Scope, name: bytes) -> bytes | None:
    """Value of a header that is there once; None where it is missing or there twice."""
    values = _all(scope, name)
    return values[0] if len(values) == 1 else None
