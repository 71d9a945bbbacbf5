"""Who may talk to the page: only what came from the page itself, and, beyond this machine, only who has the token.

Any page in the browser may send requests to 127.0.0.1, and open a websocket there. So every request must name this host
(a name that was made to point here does not), and one that names an origin must come from this very page.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from typing import Any
from urllib.parse import parse_qs, urlsplit

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]
COOKIE = "ee_dist_workbench"
REFUSED = "The workbench answers only to its own page: open the address that it printed in the terminal."
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob:; "
    "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' data: blob:; "
    "worker-src 'self' blob:; frame-src 'self'; frame-ancestors 'self'; form-action 'self'; base-uri 'self'; object-src 'none'"
)
"""Nothing of the page comes from, or goes, elsewhere: it works without a network, and tells nobody."""


def is_loopback(host: str) -> bool:
    """Whether it means this machine alone, and cannot be made to mean another by whoever owns a name."""
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


class Guard:
    """ASGI middleware for HTTP and websockets. ``token``: what others must bring, once in the address and then as a cookie;
    empty where only this machine is answered."""

    def __init__(self, app: App, token: str = "") -> None:
        self.app, self.token = app, token
        # Cookies are of a host, whatever its port: each workbench there has one of its own name.
        self.cookie = f"{COOKIE}_{hashlib.sha256(token.encode()).hexdigest()[:8]}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {k.decode("latin-1").lower(): v.decode("latin-1") for k, v in scope["headers"]}
        if not self.allowed(headers, scope.get("query_string", b"").decode("latin-1")):
            await _refuse(scope, receive, send)
            return
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
        set_cookie = bool(self.token) and scope["type"] == "http" and self._right(given)

        async def answer(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                more = [(b"content-security-policy", POLICY.encode()), (b"x-content-type-options", b"nosniff"),
                        (b"referrer-policy", b"no-referrer")]  # fmt: skip
                if set_cookie:
                    more.append(
                        (b"set-cookie", f"{self.cookie}={self.token}; HttpOnly; SameSite=Strict; Path=/".encode())
                    )
                message["headers"] = [*message.get("headers", []), *more]
            await send(message)

        await self.app(scope, receive, answer)

    def allowed(self, headers: MutableMapping[str, str], query: str) -> bool:
        """Whether a request with these headers (names in lower case) and this query is answered."""
        host = headers.get("host", "")
        if not self.token and not is_loopback(_name(host)):
            return False
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != host:
            return False
        if headers.get("sec-fetch-site") in ("cross-site", "same-site") and headers.get("sec-fetch-mode") != "navigate":
            return False
        if not self.token:
            return True
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(self.cookie)
        except CookieError:
            cookie = None
        return self._right(parse_qs(query).get("token", [""])[0]) or (cookie is not None and self._right(cookie.value))

    def _right(self, given: str) -> bool:
        return hmac.compare_digest(given.encode(), self.token.encode())


def _name(host: str) -> str:
    """The name in a Host header, without its port."""
    return urlsplit(f"//{host}").hostname or ""


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008})
        return
    text = REFUSED.encode()
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"content-length", str(len(text)).encode())]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": text})
