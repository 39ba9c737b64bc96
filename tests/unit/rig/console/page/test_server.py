"""The whole server on a real port, with raw requests: who gets in, and that nothing ends it."""

import html
import http.client
import json
import re
import socket
from contextlib import suppress

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.rig.console.page import (
    MAX_MESSAGES,
    Jobs,
    PageServer,
    Place,
    ServerState,
    access,
    cookie_name,
)

TOKEN = "t0ken-of-the-laboratory"
OTHERS = "http://evil.example"
SOCKET_IO = "/_nicegui_ws/socket.io/?EIO=4&transport="
PATHS = (
    "/",
    "/assets/page.js",
    "/vendored/uPlot.min.css",
    "/favicon.ico",
    "/nothing",
    "/live",
    f"{SOCKET_IO}polling",
    "/_nicegui/static/nicegui.js",
    "/?token=wrong&token=",
)


@pytest.fixture(scope="module")
def port(tmp_path_factory):
    """Serve the page of a folder to whoever has the token; return the port."""
    place = Place(tmp_path_factory.mktemp("sessions"), Settings(), "the defaults")
    server = PageServer(ServerState(place), Jobs(), "127.0.0.1", 0, TOKEN)
    server.start()
    yield int(server.address.partition("127.0.0.1:")[2].partition("/")[0])
    server.stop()


def ask(port, path="/", method="GET", body=None, **headers):
    """Return status, headers and text of an answer."""
    asked = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    asked.request(method, path, body, named)
    answer = asked.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read().decode(errors="replace")
    asked.close()
    return found


def cookie(port, value=TOKEN):
    return {"Cookie": f"{cookie_name(f'127.0.0.1:{port}')}={value}"}


def own(port):
    return {**cookie(port), "Origin": f"http://127.0.0.1:{port}"}


def live(port, path="/live", **headers):
    return connect(
        f"ws://127.0.0.1:{port}{path}",
        origin=headers.pop("Origin", None),
        additional_headers=headers,
    )


def secret(port):
    _, _, page = ask(port, **own(port))
    return page.partition('rig-page" content="')[2].partition('"')[0]


def flood(one):
    for _ in range(100 * MAX_MESSAGES):
        one.send('{"kind": "note", "what": "note", "text": "x"}')


def alive(port):
    """Whether a page is still served, and its socket answers."""
    with live(port, **own(port)) as one:
        one.send(json.dumps({"kind": "hello", "page": secret(port), "tab": "t" * 36}))
        return "state" in json.loads(one.recv(timeout=20))


@pytest.mark.parametrize("path", PATHS)
def test_without_the_token_nothing_is_seen(port, path):
    for headers in ({}, cookie(port, ""), cookie(port, f"{TOKEN}x")):
        status, given, text = ask(port, path, **headers)
        assert status in (303, 403)
        assert "set-cookie" not in given
        assert "rig-page" not in text
    for headers in ({}, cookie(port, "x"), {"Origin": f"http://127.0.0.1:{port}"}):
        with pytest.raises(InvalidStatus, match="403"), live(port, path, **headers):
            pass


@pytest.mark.parametrize("path", ["/", "/live", f"{SOCKET_IO}polling", f"{SOCKET_IO}websocket"])
def test_a_page_of_others_does_not_get_in_with_the_cookie_of_the_browser(port, path):
    known = cookie(port)
    for headers in (
        {"Origin": OTHERS},
        {"Origin": "null"},
        {"Origin": f"http://127.0.0.1:{port + 1}"},
        {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Dest": "iframe"},
        {"Host": f"evil.example:{port}", "Origin": f"http://evil.example:{port}"},
    ):
        assert ask(port, path, **known, **headers)[0] in (400, 403)
        assert ask(port, path, "POST", b"x", **known, **headers)[0] in (400, 403)
    for origin in (OTHERS, "null", f"http://127.0.0.1:{port + 1}", None):
        given = {"Origin": origin} if origin else {}
        with pytest.raises(InvalidStatus, match="403"), live(port, path, **known, **given):
            pass


def test_with_the_token_the_page_is_served_and_in_no_frame(port):
    status, headers, _ = ask(port, f"/?token={TOKEN}")
    assert (status, headers["location"]) == (303, "/")
    status, headers, text = ask(port, **own(port))
    assert status == 200
    assert "rig-page" in text
    assert headers["x-frame-options"] == "DENY"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert alive(port)


@pytest.mark.parametrize(
    "path",
    [
        "/assets/../access.py",
        "/assets/%2e%2e/access.py",
        "/assets/..%2faccess.py",
        "/assets//etc/passwd",
        "/vendored/../version.py",
        "/assets/page.js%00.css",
    ],
)
def test_a_path_leads_to_no_file_but_those_of_the_page(port, path):
    status, _, text = ask(port, path, **own(port))
    assert status in (400, 404)
    assert "import" not in text


def raw(port, lines):
    """Return what comes back for the lines of a request's head."""
    with socket.create_connection(("127.0.0.1", port), timeout=20) as asked:
        asked.sendall("\r\n".join([*lines, "", ""]).encode())
        return asked.recv(4096)


UPGRADE = (
    "Connection: Upgrade",
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
)


def test_a_request_names_this_server_once_and_plainly_and_a_path(port):
    """Host and first line as no browser sends them, with the token and its origin, on a socket."""
    here = f"127.0.0.1:{port}"
    known = [f"Cookie: {cookie_name(here)}={TOKEN}", f"Origin: http://{here}"]
    opens = {"/": (b" 200 ", known), "/live": (b" 101 ", [*known, *UPGRADE])}
    for path, (passed, rest) in opens.items():
        assert passed in raw(port, [f"GET {path} HTTP/1.1", f"Host: {here}", *rest])
        for target, hosts in (
            *((f"{scheme}://{here}{path}", [here]) for scheme in ("http", "https", "ftp", "ws")),
            (f"http://evil.example{path}", [here]),
            (f"http://user@{here}{path}", [here]),
            (f"//{here}{path}", ["evil.example"]),
            (path, []),
            (path, [here, here]),
            (path, [here, "evil.example"]),
            (path, ["evil.example", here]),
            (path, [f"{here}, evil.example"]),
            (path, [f"user@{here}"]),
            (path, [f"user:word@{here}"]),
            (path, [f"evil.example@{here}"]),
            (path, [f"http://{here}"]),
            (path, [f"{here}/"]),
            (path, [f"127.0.0.1.evil.example:{port}"]),
            (path, [f"10.1.2.3:{port}"]),
        ):
            head = [f"GET {target} HTTP/1.1", *(f"Host: {host}" for host in hosts)]
            answer = raw(port, [*head, *rest])
            assert answer.split()[1] in (b"400", b"403"), head
    assert b" 200 " not in raw(port, ["GET / HTTP/1.0", *known])
    assert alive(port)


def test_a_header_of_a_proxy_is_not_believed(port):
    here = f"127.0.0.1:{port}"
    known = {**cookie(port), "Origin": f"https://{here}"}
    for more in ({"X-Forwarded-Proto": "https"}, {"X-Forwarded-Host": here}):
        assert ask(port, **known, **more)[0] == 403
    assert ask(port, **cookie(port), Host="evil.example", X_Forwarded_Host=here)[0] == 400


def test_the_token_is_in_no_log_and_no_answer(port, caplog, capfd):
    ask(port, f"/?token={TOKEN}x")
    _, headers, text = ask(port, **own(port))
    assert TOKEN not in text
    assert headers["referrer-policy"] == "no-referrer"
    raw(port, [f"GET /?token={TOKEN} HTTP/1.1", "Host: evil.example"])
    assert TOKEN not in caplog.text + "".join(capfd.readouterr())


def test_requests_of_no_form_end_nothing(port):
    head = b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n"
    cookie = f"Cookie: {cookie_name('127.0.0.1')}={TOKEN}\r\n".encode()
    for raw in (
        b"\x00" * 1000,
        b"GET " + b"/" * 100_000 + b" HTTP/1.1\r\n\r\n",
        head + b"Cookie: " + b"a" * 100_000 + b"\r\n\r\n",
        head + b"Cookie: =;;=\xff\x00\r\n\r\n",
        head + b"Content-Length: " + b"9" * 5000 + b"\r\n\r\n",
        head.replace(b"127.0.0.1", b"[::1") + cookie + b"\r\n",
        head + b"Host: evil.example\r\n" + cookie + b"\r\n",
        head + cookie + b"Transfer-Encoding: chunked\r\n\r\nffffffff\r\n",
    ):
        with socket.create_connection(("127.0.0.1", port), timeout=20) as asked:
            asked.sendall(raw)
            asked.shutdown(socket.SHUT_WR)
            assert b" 200 " not in asked.recv(4096)
    many = b"x" * 1_000_000
    assert ask(port, f"{SOCKET_IO}polling", "POST", many, **own(port))[0] == 403
    assert alive(port)


@pytest.mark.parametrize(
    "said",
    [
        "[" * 4000,
        '{"a":' * 600 + "1" + "}" * 600,
        '{"kind": "hello", "page": {"x": 1}, "tab": []}',
        '{"kind": "note", "what": "rating", "by": "E", "epoch": 1, "score": ' + "9" * 400 + "}",
        '{"kind": "note", "text": "' + "x" * 60_000 + '"}',
        '{"kind": "hello", "page": "wrong", "tab": "t"}',
        "\0",
        b"\xff\xfe",
    ],
)
def test_a_socket_that_says_anything_else_first_is_closed(port, said):
    with live(port, **own(port)) as one:
        one.send(said)
        with pytest.raises(ConnectionClosed):
            one.recv(timeout=20)


def test_one_that_floods_is_cut_off_and_the_next_page_is_served(port):
    with live(port, **own(port)) as one:
        one.send(json.dumps({"kind": "hello", "page": secret(port), "tab": "f" * 36}))
        with pytest.raises(ConnectionClosed) as closed:
            flood(one)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    assert alive(port)


def test_messages_of_the_framework_with_other_types_end_nothing(port):
    """Packets of socket.io as its pages send them, to pages that are not theirs."""
    with live(port, f"{SOCKET_IO}websocket", **own(port)) as one:
        assert json.loads(one.recv(timeout=20)[1:])["sid"]
        one.send("40")
        assert one.recv(timeout=20).startswith("40")
        for packet in (
            '42["event",null]',
            '42["event",{"client_id":[],"listener_id":{},"args":"x"}]',
            '42["event",{"client_id":"../../x","listener_id":"y","args":[]}]',
            '42["handshake",{"client_id":1}]',
            '42["javascript_response",{"client_id":"x"}]',
            '42["log",{}]',
            "42[" + "[" * 3000,
            "451-",
        ):
            one.send(packet)
    assert alive(port)


@pytest.fixture
def silent(port):
    """Open connections that say nothing, or part of a head, before and after a page's socket."""
    made = []

    def open_some(count, said=b""):
        for _ in range(count):
            made.append(socket.create_connection(("127.0.0.1", port), timeout=20))
            with suppress(ConnectionError):  # it is closed already
                made[-1].sendall(said)
        return made

    yield open_some
    for one in made:
        one.close()


def ended(one):
    """Whether the server has closed a connection; waits for that."""
    try:
        return one.recv(1) == b""
    except ConnectionError:
        return True


def test_500_connections_that_say_nothing_leave_room_for_the_operator(port, silent):
    """The page that is open is heard, another is served; the oldest idle ones are closed."""
    with live(port, **own(port)) as page:
        page.send(json.dumps({"kind": "hello", "page": secret(port), "tab": "o" * 36}))
        silent(250)
        made = silent(250, b"GET / HTTP/1.1\r\nHost: ")
        page.send(json.dumps({"kind": "order", "command": "nonsense"}))
        while "say" not in json.loads(page.recv(timeout=20)):
            pass
        assert alive(port)
    assert all(ended(one) for one in made[: len(made) - access.MAX_CONNECTIONS])


def test_a_connection_without_a_request_is_closed_in_time(port, silent, monkeypatch):
    monkeypatch.setattr(access, "HEAD_S", 0.05)
    silent(2)
    assert all(map(ended, silent(1, b"GET / HTTP/1.1\r\n")))
    monkeypatch.undo()
    assert alive(port)


def test_a_head_without_an_end_is_cut_off(port, silent):
    (one,) = silent(1, b"GET / HTTP/1.1\r\n")
    # More than the buffers of both ends hold.
    with pytest.raises(ConnectionError):
        one.sendall(b"X-Long: x\r\n" * 2_000_000)
    assert alive(port)


@pytest.mark.parametrize("token", ["short", "x" * 15, "a b c d e f g h i j", "x;" * 20, "ä" * 20])
def test_a_token_that_can_be_guessed_is_refused(tmp_path, token):
    place = Place(tmp_path, Settings(), "the defaults")
    with pytest.raises(UserError, match="16 or more"):
        PageServer(ServerState(place), Jobs(), "127.0.0.1", 0, token)


def test_without_a_token_no_network_reaches_the_page(tmp_path):
    place = Place(tmp_path, Settings(), "the defaults")
    for host in ("0.0.0.0", "::", "192.168.0.7"):
        with pytest.raises(UserError, match="--no-token: whoever reaches"):
            PageServer(ServerState(place), Jobs(), host, 0, "")


def shown(page):
    """Return what a person reads of the page: texts and labels, also of what is folded."""
    (raw,) = re.findall(r"parseElements\(String\.raw`(.*?)`\)", page, re.DOTALL)
    texts = []
    for element in json.loads(html.unescape(raw)).values():
        props = element.get("props", {})
        texts += [element.get("text"), *(props.get(name) for name in ("label", "aria-label"))]
        texts += [each["label"] for each in props.get("options", ())]
        written = props.get("innerHTML") or ""
        texts += re.findall(r'(?:title|placeholder|aria-label)="([^"]*)"', written)
        texts += re.sub("<[^>]*>", "\n", written).split("\n")
    return [text.strip() for text in texts if text and text.strip()]


def test_no_label_of_the_page_is_a_name_of_the_program(port):
    """As a rename over the text once made of `Condition`."""
    page = ask(port, **cookie(port))[2]
    texts = shown(page)
    assert {"Condition, or its code", "Condition", "Start session", "EMERGENCY STOP"} <= {*texts}
    assert "sinusoid: work, impulse" in texts
    files = r"\S*/\S*|\S+\.toml"  # of this computer
    names = r"\b[A-Za-z][a-z]+[A-Z]\w*|\w*[a-z]_\w+|\w+\.\w+\b|\w+\(\)|[{}]"
    assert [text for text in texts if re.search(names, re.sub(files, "", text))] == []
