"""Who gets past the gate: names, origins, tokens, sizes."""

import asyncio
import itertools

import pytest

from rigidimeter.rig.console.page import (
    LONGEST_BODY,
    AccessCheck,
    cookie_name,
    in_url,
    is_loopback,
    same_origin,
    slow_enough,
)

OWN = {"host": "127.0.0.1:8765", "origin": "http://127.0.0.1:8765"}
COOKIE = cookie_name(OWN["host"])


def ask(token="", kind="http", method="GET", query="", path="/", reached="127.0.0.1", **headers):
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
        "path": path,
        "server": (reached, 8765),
        "query_string": query.encode(),
        "headers": [
            (name.replace("_", "-").encode(), value.encode())
            for name, values in headers.items()
            for value in ([values] if isinstance(values, str) else values)
        ],
    }
    if kind == "http":
        scope["method"] = method
    asyncio.run(AccessCheck(app, token, ["localhost"])(scope, receive, send))
    first = sent[0]
    if first == "passed":
        return "passed", {}
    return first.get("status") or first["type"], dict(first.get("headers", []))


HERE = "192.168.0.7"


@pytest.mark.parametrize(
    ("host", "allowed"),
    [
        (f"{HERE}:8765", True),
        (HERE, True),
        ("localhost:1", True),
        ("LOCALHOST", True),
        ("evil.example:8765", False),
        (f"{HERE}.evil.example", False),
        ("localhost.evil.example", False),
        ("192.168.0.8:8765", False),
        ("", False),
        ("[::1", False),
        (f"user@{HERE}:8765", False),
        (f"evil.example@{HERE}", False),
        (f"{HERE}:8765, evil.example", False),
        (f"{HERE}/x", False),
        (f"{HERE}:8765:1", False),
        (f"http://{HERE}", False),
        ([], False),
        ([HERE, HERE], False),
        (["evil.example", HERE], False),
        ([HERE, "evil.example"], False),
    ],
)
def test_one_host_header_names_this_computer(host, allowed):
    """The name of a stranger that was made to point here is what DNS rebinding needs."""
    assert (ask(host=host, reached=HERE)[0] == "passed") == allowed
    # With the token in its address too: the cookie would be that of another name.
    assert (ask("t", query="token=t", host=host, reached=HERE)[0] == 303) == allowed
    named = host if isinstance(host, str) else HERE
    opened = ask(kind="websocket", host=host, origin=f"http://{named}", reached=HERE)
    assert (opened[0] == "passed") == allowed


@pytest.mark.parametrize(
    ("reached", "host"),
    [
        ("::1", "[::1]:8765"),
        ("::ffff:192.168.0.7", f"{HERE}:8765"),
        ("2001:db8::7", "[2001:db8::7]"),
    ],
)
def test_an_address_of_either_version_is_the_one_that_was_reached(reached, host):
    assert ask(host=host, reached=reached)[0] == "passed"
    assert in_url(reached) in host


@pytest.mark.parametrize(
    "path",
    ["http://evil.example/", "http://127.0.0.1:8765/", "https://127.0.0.1/", "ftp://a/", "*", ""],
)
def test_the_first_line_of_a_request_names_a_path_alone(path):
    for kind in ("http", "websocket"):
        assert ask(kind=kind, path=path, **OWN)[0] in (403, "websocket.close")


@pytest.mark.parametrize(
    ("origin", "same"),
    [
        ("http://127.0.0.1:8765", True),
        ("http://127.0.0.1:8766", False),
        ("https://127.0.0.1:8765", False),
        ("ftp://127.0.0.1:8765", False),
        ("chrome-extension://127.0.0.1:8765", False),
        ("http://user@127.0.0.1:8765", False),
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
    assert ask(host="evil.example", origin="http://evil.example")[0] == 400


def test_without_the_token_nobody_looks_or_acts():
    for given in ({}, {"cookie": f"{COOKIE}=wrong"}, {"cookie": "=;,bad"}):
        assert ask("right", host=OWN["host"], **given)[0] == 403
        assert ask("right", kind="websocket", **OWN, **given)[0] == "websocket.close"
    assert ask("right", **OWN, cookie=f"{COOKIE}=right")[0] == "passed"
    assert ask("right", kind="websocket", **OWN, cookie=f"a=b; {COOKIE}=right")[0] == "passed"


def test_the_token_leaves_the_address_for_a_cookie():
    status, headers = ask("right", query="token=right", host=OWN["host"])
    assert (status, headers[b"location"]) == (303, b"/")
    assert headers[b"set-cookie"] == f"{COOKIE}=right; Path=/; HttpOnly; SameSite=Lax".encode()
    status, headers = ask("right", query="token=wrong", host=OWN["host"])
    assert b"set-cookie" not in headers


def test_a_report_s_links_carry_the_token_and_what_acts_needs_more():
    """A sandboxed report has no origin, so its links come from another site, as a browser says."""
    link = {"sec_fetch_site": "cross-site", "sec_fetch_dest": "document"}
    assert ask("right", host=OWN["host"], **link, cookie=f"{COOKIE}=right")[0] == "passed"
    elsewhere = {"host": OWN["host"], "origin": "null", "cookie": f"{COOKIE}=right"}
    assert ask("right", method="POST", **elsewhere)[0] == 403
    assert ask("right", kind="websocket", **elsewhere)[0] == "websocket.close"


def test_two_programs_on_one_computer_keep_their_tokens_apart():
    other = cookie_name("127.0.0.1:9000")
    assert ask("right", **OWN, cookie=f"{other}=wrong; {COOKIE}=right")[0] == "passed"
    assert ask("right", **OWN, cookie=f"{other}=right")[0] == 403


def test_large_requests_are_refused():
    for length in (str(LONGEST_BODY + 1), "-1", "many", "9" * 5000):
        assert ask(method="POST", **OWN, content_length=length)[0] == 403
    assert ask(method="POST", **OWN, transfer_encoding="chunked")[0] == 403


@pytest.mark.parametrize(
    ("host", "loopback"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("lab", False)],
)
def test_the_loopback_is_told_from_other_addresses(host, loopback):
    assert is_loopback(host) == loopback


@pytest.mark.parametrize(
    ("site", "dest", "passes"),
    [
        ("none", "document", True),
        ("same-origin", "script", True),
        ("cross-site", "document", True),  # a link was followed
        ("cross-site", "iframe", False),
        ("cross-site", "image", False),
        ("same-site", "empty", False),  # a server at another port
    ],
)
def test_nothing_is_loaded_for_pages_of_others(site, dest, passes):
    found, _ = ask(host=OWN["host"], sec_fetch_site=site, sec_fetch_dest=dest)
    assert (found == "passed") == passes


def socket_of(messages, now_s):
    """Return what the application receives of a socket, and what is sent to it."""
    heard, sent = [], []

    async def app(scope, receive, send):
        while (message := await receive())["type"] == "websocket.receive":
            heard.append(message["text"])

    async def receive():
        return {"type": "websocket.receive", "text": next(messages)}

    async def send(message):
        sent.append(message)

    async def one(scope, receive, send):
        await app(scope, slow_enough(receive, send, now_s), send)

    asyncio.run(one({}, receive, send))
    return heard, sent


def test_a_socket_that_says_too_much_is_closed():
    """400 at once, then 200 a second: of 10,000 a second only the first 408 are heard."""
    ticks = itertools.count()
    heard, sent = socket_of(iter(["x"] * 10_000), lambda: next(ticks) / 2 / 10_000)
    assert 400 <= len(heard) <= 412
    assert [(one["type"], one["code"]) for one in sent] == [("websocket.close", 1008)]


def test_a_page_that_beats_is_heard_for_ever():
    ticks = itertools.count()
    words = iter(["beat"] * 20_000)
    with pytest.raises(RuntimeError, match="StopIteration"):
        socket_of(words, lambda: next(ticks) / 2 / 25)
