"""Who may reach the page: the name it was asked by, where a request comes from, and the token.

A browser on the operator's computer also shows pages of strangers. Such a page can send requests to
127.0.0.1, and a name of its own can be made to point there (DNS rebinding). So a request must name
this computer, once, by one of its names or the address that the connection came to, and one that
acts, or opens a socket, must come from a page of this server. What a browser loads for a page of a
stranger, a frame or an image, is refused too: a page in a frame could be clicked on unseen, and to
make many pages takes time from the beats. Other programs and users of this computer are kept out by
the token.

Sockets that say too much are closed: what they say is heard in the thread that hears the beats.

A peer that opens connections and says nothing, or never ends the head of its request, would take
the file descriptors and the memory of the program that leads the session. So there is a bound;
where it is reached the oldest idle connection is closed, of the address that has most of them. What
asks for nothing within `HEAD_S`, or begins a request with too long a head, is closed in any case.
The sockets of pages are not idle.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import itertools
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs, urlsplit

import uvicorn
from starlette.middleware.trustedhost import TrustedHostMiddleware

COOKIE = "rigidimeter_token"
LONGEST_BODY = 200_000
"""Bytes of a request; the largest that the page sends is a protocol."""

MAX_MESSAGES_S = 200.0
"""Messages a second on a socket, on average over `MAX_MESSAGES` of them; a page sends some 20."""

MAX_MESSAGES = 400

SENT_WITH_ALL = (
    (b"content-security-policy", b"frame-ancestors 'none'"),
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""Headers of every answer: no frames of others, no guessed types, no address to other sites."""

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

MAX_CONNECTIONS = 128
"""At once, with the sockets of pages; a browser opens some eight for a page."""

HEAD_S = 10.0
"""So long a connection may last without a whole head of a request."""

LONGEST_HEAD = 262_144
"""Bytes of it; what reads them ahead is not to grow with what is sent."""

_numbers = itertools.count()


def is_loopback(host: str) -> bool:
    """Whether an address is reached from this computer alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def in_url(address: str) -> str:
    """Return an address as it stands in a URL.

    Examples
    --------
    >>> in_url("127.0.0.1"), in_url("::1"), in_url("::ffff:192.168.0.7"), in_url("lab")
    ('127.0.0.1', '[::1]', '192.168.0.7', 'lab')
    """
    try:
        found = ipaddress.IPv6Address(address)
    except ValueError:
        return address
    return str(found.ipv4_mapped or f"[{found}]")


def same_origin(origin: str, host: str) -> bool:
    """Whether an Origin header is that of a page that this server sent, which is over http.

    Examples
    --------
    >>> same_origin("http://127.0.0.1:8080", "127.0.0.1:8080")
    True
    >>> same_origin("http://127.0.0.1:9999", "127.0.0.1:8080"), same_origin("null", "null")
    (False, False)
    """
    return bool(host) and origin.lower() == f"http://{host}".lower()


def for_another_page(headers: Mapping[str, str]) -> bool:
    """Whether a browser says that it loads this for a page of another server.

    To follow a link to here is not that.

    Examples
    --------
    >>> for_another_page({"sec-fetch-site": "cross-site", "sec-fetch-dest": "iframe"})
    True
    >>> for_another_page({"sec-fetch-site": "same-origin"}), for_another_page({})
    (False, False)
    """
    if headers.get("sec-fetch-site", "none") in ("none", "same-origin"):
        return False
    return headers.get("sec-fetch-dest") != "document"


def cookie_name(host: str) -> str:
    """Return the name of the cookie that holds the token; browsers do not tell ports apart.

    Examples
    --------
    >>> cookie_name("192.168.0.7:8080")
    'rigidimeter_token_8080'
    """
    try:
        return f"{COOKIE}_{urlsplit(f'//{host}').port or 80}"
    except ValueError:
        return COOKIE


def same_token(given: str, token: str) -> bool:
    """Whether two tokens are equal, in a time that does not tell where they differ."""
    return hmac.compare_digest(given.encode(), token.encode())


class AccessCheck:
    """Answers in place of the application where a request may not pass.

    Parameters
    ----------
    app : ASGI application
    token : str
        Empty for none.
    names : iterable of str
        Names and addresses of this computer, as they stand in a URL.
    """

    def __init__(self, app: App, token: str, names: Iterable[str]) -> None:
        self._app, self._token, self._names = app, token, tuple(names)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        send = _with_headers(send)
        # The middleware looks at one header, and at no address in the first line of a request.
        if sum(name == b"host" for name, _ in scope["headers"]) != 1:
            await _refuse(scope, receive, send, "a request must have one Host header")
        elif not scope["path"].startswith("/"):
            await _refuse(scope, receive, send, "a request must name a path of this server")
        else:
            reached = in_url(scope["server"][0])
            known = TrustedHostMiddleware(self._enter, (*self._names, reached), www_redirect=False)
            await known(scope, receive, send)

    async def _enter(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request to this computer on, or refuse it."""
        headers = {
            name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]
        }
        if scope["type"] == "http" and self._token and _token_in_query(scope):
            await self._admit(scope, headers["host"], send)
            return
        why = self._refusal(scope, headers)
        if why:
            await _refuse(scope, receive, send, why)
        elif scope["type"] == "websocket":
            await self._app(scope, slow_enough(receive, send), send)
        else:
            await self._app(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Mapping[str, str]) -> str:
        """Return why a request may not pass, nothing if it may."""
        host, origin = headers["host"], headers.get("origin", "")
        acts = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        if ((acts or origin) and not same_origin(origin, host)) or for_another_page(headers):
            return "requests of other pages are refused"
        if self._token and not same_token(_cookie(headers), self._token):
            return "the token is missing or wrong; open the address that the server printed"
        length = headers.get("content-length", "0")
        long = not length.isdecimal() or len(length) > 9 or int(length) > LONGEST_BODY
        if long or "transfer-encoding" in headers:
            return f"a request may have {LONGEST_BODY} bytes"
        return ""

    async def _admit(self, scope: Scope, host: str, send: Send) -> None:
        """Take the token out of the address, and keep it in a cookie.

        Lax: a link to here may carry it, as those of a report do, whose page is of no origin; what
        acts needs the origin beside it.
        """
        headers: list[tuple[bytes, bytes]] = [(b"location", b"/"), (b"content-length", b"0")]
        if same_token(_token_in_query(scope), self._token):
            cookie = f"{cookie_name(host)}={self._token}; Path=/; HttpOnly; SameSite=Lax"
            headers.append((b"set-cookie", cookie.encode()))
        await send({"type": "http.response.start", "status": 303, "headers": headers})
        await send({"type": "http.response.body", "body": b""})


def _with_headers(send: Send) -> Send:
    async def sent(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), *SENT_WITH_ALL]}
        await send(message)

    return sent


def slow_enough(
    receive: Receive, send: Send, now_s: Callable[[], float] = time.monotonic
) -> Receive:
    """Return what receives a socket's messages, until they come too fast; then it is closed."""
    left, before_s = float(MAX_MESSAGES), now_s()

    async def received() -> MutableMapping[str, Any]:
        nonlocal left, before_s
        message = await receive()
        if message["type"] != "websocket.receive":
            return message
        passed_s, before_s = now_s() - before_s, now_s()
        left = min(left + MAX_MESSAGES_S * passed_s, MAX_MESSAGES) - 1.0
        if left >= 0.0:
            return message
        why = f"a page may send {MAX_MESSAGES_S:g} messages a second"
        await send({"type": "websocket.close", "code": 1008, "reason": why})
        return {"type": "websocket.disconnect", "code": 1008}

    return received


def _token_in_query(scope: Scope) -> str:
    values = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])
    return str(values[0])


def _cookie(headers: Mapping[str, str]) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(cookie_name(headers.get("host", "")))
    except CookieError:
        return ""
    return str(morsel.value) if morsel is not None else ""


async def _refuse(scope: Scope, receive: Receive, send: Send, why: str) -> None:
    if scope["type"] == "websocket":
        await receive()  # its wish to connect
        await send({"type": "websocket.close", "code": 1008, "reason": why})
        return
    body = why.encode()
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
    ]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": body})


def bound_connections(config: uvicorn.Config) -> None:
    """Have the server of a configuration keep to these bounds, whatever reads its HTTP."""
    config.load()
    protocol: Any = config.http_protocol_class

    class Bounded(protocol):  # type: ignore[misc]
        """A connection that is closed where it is idle and in the way."""

        def connection_made(self, transport: asyncio.Transport) -> None:
            super().connection_made(transport)
            self.number, self.address = next(_numbers), self.client[0] if self.client else ""
            self.head_bytes, self.cycle_before = 0, None
            self.loop.call_later(HEAD_S, self.end_without_request)
            if len(self.connections) > MAX_CONNECTIONS:
                idle = [one for one in self.connections if isinstance(one, Bounded) and one.idle]
                of_each = Counter(one.address for one in idle)
                max(idle, key=lambda one: (of_each[one.address], -one.number)).end()

        def data_received(self, data: bytes) -> None:
            if self.cycle is not self.cycle_before:
                self.head_bytes, self.cycle_before = 0, self.cycle
            self.head_bytes += len(data) if self.idle else 0
            if self.head_bytes > LONGEST_HEAD:
                self.end()
            else:
                super().data_received(data)

        @property
        def idle(self) -> bool:
            """Whether no request is being answered."""
            return self.cycle is None or bool(self.cycle.response_complete)

        def end_without_request(self) -> None:
            if self.cycle is None and self in self.connections:
                self.end()

        def end(self) -> None:
            """Close it at once; it does not count from here on."""
            self.connections.discard(self)
            self.transport.abort()

    config.http_protocol_class = Bounded
