"""Who may ask: foreign hosts, pages and tokens are refused in every form, before any handler."""

from __future__ import annotations

import base64
import os
import socket

import pytest

from rotordrop.web.guard import POLICY

FOREIGN_HOSTS = [
    "evil.example", "evil.example:{port}", "127.0.0.1", "localhost", "127.0.0.1:1", "localhost:80",
    "127.0.0.1.evil.example:{port}", "localhost.evil.example:{port}", "evil.example#127.0.0.1:{port}",
    "127.0.0.2:{port}", "0.0.0.0:{port}", "[::]:{port}", "[::ffff:127.0.0.1]:{port}", "2130706433:{port}",
    "0x7f.1:{port}", "127.1:{port}", "localhost.:{port}", "user@127.0.0.1:{port}", "127.0.0.1:{port}, evil",
    "127.0.0.1:{port}/", "127.0.0.1:0{port}", "",
]  # fmt: skip
FOREIGN_ORIGINS = [
    "http://evil.example", "https://127.0.0.1:{port}", "http://127.0.0.1", "http://127.0.0.1:1", "null",
    "http://localhost:{port}", "http://127.0.0.1:{port}.evil.example", "http://127.0.0.1:{port}/", "file://",
    "http://[::1]:{port}", "HTTP://127.0.0.1:{port}", "http://127.0.0.1:{port} http://evil.example", "",
    "chrome-extension://abcdef", "http://0.0.0.0:{port}",
]  # fmt: skip
FOREIGN_SITES = ["cross-site", "same-site", "none", "Same-Origin", "same-origin, cross-site", "", "anything"]
WRONG_TOKENS = [
    "", " ", "wrong", "{token}x", "x{token}", "{half}", "{turned}", "{token} {token}", "Bearer {token}",
    "{token},", "%00{token}", "{lower}", "null", "undefined", "0", "{coded}",
]  # fmt: skip


def _words(template: str, served) -> str:
    token = served.token
    return template.format(
        port=served.port, token=token, half=token[:20], turned=token[::-1], lower=token.swapcase(),
        coded=base64.b64encode(token.encode()).decode(),
    )  # fmt: skip


FORMS = (
    [("Host", form) for form in FOREIGN_HOSTS]
    + [("Origin", form) for form in FOREIGN_ORIGINS]
    + [("Sec-Fetch-Site", form) for form in FOREIGN_SITES]
    + [("X-Rotordrop-Token", form) for form in WRONG_TOKENS]
)


def test_sixty_forms_are_tried():
    assert len(FORMS) >= 60


@pytest.mark.parametrize(("name", "form"), FORMS)
def test_a_foreign_form_is_refused_before_any_handler(served, name, form):
    own = {"Host": f"127.0.0.1:{served.port}", "X-Rotordrop-Token": served.token}
    asked = {**own, name: _words(form, served)}
    before = os.listdir(served.space.jobs_folder)
    for method, path, body in (
        ("GET", "/api/jobs", None),
        ("POST", "/api/jobs", b'{"name": "theirs"}'),
        ("DELETE", "/api/jobs/0123456789abcdef", None),
    ):
        answer = served.ask(method, path, body, headers=list(asked.items()))
        assert answer.status in (400, 401, 403), (answer.status, answer.text)
        assert b"jobs" not in answer.body
    assert os.listdir(served.space.jobs_folder) == before


@pytest.mark.parametrize("name", ["Host", "X-Rotordrop-Token", "Origin", "Sec-Fetch-Site"])
def test_a_header_that_is_there_twice_is_refused(served, name):
    own = [("Host", f"127.0.0.1:{served.port}"), ("X-Rotordrop-Token", served.token)]
    own += [("Origin", f"http://127.0.0.1:{served.port}"), ("Sec-Fetch-Site", "same-origin")]
    assert served.ask("GET", "/api/jobs", headers=own).status == 200
    twice = [*own, next(entry for entry in own if entry[0] == name)]
    assert served.ask("GET", "/api/jobs", headers=twice).status in (400, 401, 403)


def test_a_missing_host_is_refused(served):
    assert served.ask("GET", "/", headers=[]).status in (400, 403)


def test_a_foreign_host_gets_not_even_the_page(served):
    assert served.ask("GET", "/", headers=[("Host", f"evil.example:{served.port}")]).status == 403


def test_a_foreign_page_may_not_load_a_part_of_the_page(served):
    headers = [("Host", f"127.0.0.1:{served.port}"), ("Sec-Fetch-Site", "cross-site")]
    assert served.ask("GET", "/static/page.js", headers=headers).status == 403


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "[::1]"])
def test_the_own_page_is_let_through(served, host):
    headers = [("Host", f"{host}:{served.port}"), ("Origin", f"http://{host}:{served.port}")]
    headers += [("Sec-Fetch-Site", "same-origin"), ("X-Rotordrop-Token", served.token)]
    assert served.ask("GET", "/api/jobs", headers=headers).status == 200


def test_every_answer_carries_the_policy(served):
    for path in ("/", "/static/page.js", "/api/jobs", "/nowhere", "/api/nowhere"):
        answer = served.ask(
            "GET", path, headers=None if path != "/api/nowhere" else [("Host", "evil.example")]
        )
        assert answer.headers["content-security-policy"] == POLICY
        assert answer.headers["x-content-type-options"] == "nosniff"
    assert "unsafe" not in POLICY


def test_a_web_socket_is_refused(served):
    with socket.create_connection(("127.0.0.1", served.port)) as connection:
        told = (
            f"GET /api/jobs HTTP/1.1\r\nHost: 127.0.0.1:{served.port}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n"
        )
        connection.sendall(told.encode())
        assert connection.recv(100).split()[1] in (b"401", b"403", b"400")


def test_the_server_listens_on_this_computer_only(served):
    with socket.socket() as connection:
        connection.settimeout(2)
        others = [
            entry[4][0] for entry in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)
            if not entry[4][0].startswith("127.")
        ]  # fmt: skip
        for address in others:
            with pytest.raises(OSError):
                connection.connect((address, served.port))


def _traversals() -> list[str]:
    """At least 200 ways to name a file that is not there to be named."""
    ups = ["..", "%2e%2e", "%2E%2E", "..%00", "....", ".%2e", "%2e.", "%252e%252e", "..%c0%af", "..\\", "..;"]
    seps = ["/", "%2f", "%2F", "\\", "%5c", "%252f", "//", "/./"]
    ends = ["token", "etc/passwd", "etc%2fpasswd"]
    return [f"{up}{sep}" * 3 + end for up in ups for sep in seps for end in ends]


def test_no_traversal_reaches_a_file(served):
    forms = _traversals()
    assert len(forms) >= 200
    job = served.new_job({})
    secret = served.token.encode()
    for form in forms:
        for place in ("/static/", "/api/jobs/", f"/api/jobs/{job}/look/", "/report/", "/"):
            path = place + form
            answer = served.ask("GET", path)
            assert answer.status in (400, 403, 404, 405), (path, answer.status)
            assert secret not in answer.body
            assert b"root:" not in answer.body
    for form in forms:
        answer = served.ask("PUT", f"/api/jobs/{job}/files/beside?name={form}", b"x")
        assert answer.status in (201, 400), (form, answer.text)
    inside = served.space.jobs_folder / job / "files"
    written = [file for file in served.space.path.rglob("*") if file.is_file() and file.read_bytes() == b"x"]
    found = {file.resolve().parent for file in written}
    assert found <= {inside.resolve()}
