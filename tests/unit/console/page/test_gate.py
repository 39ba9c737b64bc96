"""Who gets past the gate: names, origins, tokens, sizes."""

import asyncio

import pytest

from rigidimeter.console.page.gate import (
    COOKIE,
    LONGEST_BODY,
    Gate,
    host_allowed,
    is_loopback,
    same_origin,
)

OWN = {"host": "127.0.0.1:8765", "origin": "http://127.0.0.1:8765"}


def ask(token="", kind="http", method="GET", query="", **headers):
    """Return status (or "passed") and headers of the answer to one request."""
    sent = []

    async def app(scope, receive, send):
        sent.append("passed")

    async def receive():
        return {"type": "websocket.connect"}

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind,
        "query_string": query.encode(),
        "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
    }
    if kind == "http":
        scope["method"] = method
    asyncio.run(Gate(app, token, ["localhost"])(scope, receive, send))
    first = sent[0]
    if first == "passed":
        return "passed", {}
    return first.get("status") or first["type"], dict(first.get("headers", []))


@pytest.mark.parametrize(
    ("host", "allowed"),
    [
        ("127.0.0.1:8765", True),
        ("localhost:1", True),
        ("LOCALHOST", True),
        ("[::1]:8765", True),
        ("192.168.0.7", True),
        ("evil.example:8765", False),
        ("127.0.0.1.evil.example", False),
        ("localhost.evil.example", False),
        ("", False),
        ("[::1", False),
    ],
)
def test_only_addresses_and_own_names_are_asked_for(host, allowed):
    """The name of a stranger that was made to point here is what DNS rebinding needs."""
    assert host_allowed(host, ["localhost"]) == allowed


@pytest.mark.parametrize(
    ("origin", "same"),
    [
        ("http://127.0.0.1:8765", True),
        ("http://127.0.0.1:8766", False),
        ("http://127.0.0.1", False),
        ("http://evil.example", False),
        ("http://127.0.0.1:8765.evil.example", False),
        ("null", False),
        ("", False),
    ],
)
def test_a_socket_is_opened_by_own_pages_alone(origin, same):
    assert same_origin(origin, OWN["host"]) == same
    found, _ = ask(kind="websocket", host=OWN["host"], origin=origin)
    assert found == ("passed" if same else "websocket.close")


def test_what_acts_must_say_where_it_comes_from():
    assert ask(host=OWN["host"])[0] == "passed"  # an address typed in
    assert ask(method="POST", host=OWN["host"])[0] == 403
    assert ask(method="POST", **OWN)[0] == "passed"
    assert ask(kind="websocket", host=OWN["host"])[0] == "websocket.close"
    assert ask(host="evil.example", origin="http://evil.example")[0] == 403


def test_without_the_token_nobody_looks_or_acts():
    for given in ({}, {"cookie": f"{COOKIE}=wrong"}, {"cookie": "=;,bad"}):
        assert ask("right", host=OWN["host"], **given)[0] == 403
        assert ask("right", kind="websocket", **OWN, **given)[0] == "websocket.close"
    assert ask("right", **OWN, cookie=f"{COOKIE}=right")[0] == "passed"
    assert ask("right", kind="websocket", **OWN, cookie=f"a=b; {COOKIE}=right")[0] == "passed"


def test_the_token_leaves_the_address_for_a_cookie():
    status, headers = ask("right", query="token=right", host=OWN["host"])
    assert (status, headers[b"location"]) == (303, b"/")
    assert headers[b"set-cookie"] == f"{COOKIE}=right; Path=/; HttpOnly; SameSite=Strict".encode()
    status, headers = ask("right", query="token=wrong", host=OWN["host"])
    assert b"set-cookie" not in headers


def test_large_requests_are_refused():
    for length in (str(LONGEST_BODY + 1), "-1", "many"):
        assert ask(method="POST", **OWN, content_length=length)[0] == 403
    assert ask(method="POST", **OWN, transfer_encoding="chunked")[0] == 403


@pytest.mark.parametrize(
    ("host", "loopback"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("lab", False)],
)
def test_any_address_but_the_loopback_needs_a_token(host, loopback):
    assert is_loopback(host) == loopback
