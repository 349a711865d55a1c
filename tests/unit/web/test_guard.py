"""Who may ask: foreign hosts, pages and tokens are refused in every form, before any handler."""

import os
import socket

import pytest

from rotordrop.web.guard import POLICY

FOREIGN = {
    "Host": "evil.example:{port} 127.0.0.1 localhost:80 127.0.0.1.evil.example:{port} 127.0.0.2:{port} "
    "[::ffff:127.0.0.1]:{port} user@127.0.0.1:{port}",
    "Origin": "http://evil.example https://127.0.0.1:{port} http://127.0.0.1:1 null "
    "http://127.0.0.1:{port}.evil.example",
    "Sec-Fetch-Site": "cross-site same-site none",
    "X-Rotordrop-Token": "{token}x {half} {lower}",
}
FORMS = [(name, form) for name, forms in FOREIGN.items() for form in forms.split()]
FORMS += [("Host", ""), ("X-Rotordrop-Token", "")]


@pytest.mark.parametrize(("name", "form"), FORMS)
def test_a_foreign_form_is_refused_before_any_handler(served, name, form):
    own = {"Host": f"127.0.0.1:{served.port}", "X-Rotordrop-Token": served.token}
    token = {"token": served.token, "half": served.token[:20], "lower": served.token.swapcase()}
    asked = {**own, name: form.format(port=served.port, **token)}
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


@pytest.mark.parametrize(
    ("path", "headers"),
    [
        ("/", {}),
        ("/", {"Host": "evil.example:{port}"}),
        ("/static/page.js", {"Host": "127.0.0.1:{port}", "Sec-Fetch-Site": "cross-site"}),
    ],
)
def test_a_foreign_host_or_page_gets_not_even_a_part_of_the_page(served, path, headers):
    given = [(name, value.format(port=served.port)) for name, value in headers.items()]
    assert served.ask("GET", path, headers=given).status in ((403,) if headers else (400, 403))


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "[::1]"])
def test_the_own_page_is_let_through(served, host):
    headers = [("Host", f"{host}:{served.port}"), ("Origin", f"http://{host}:{served.port}")]
    headers += [("Sec-Fetch-Site", "same-origin"), ("X-Rotordrop-Token", served.token)]
    assert served.ask("GET", "/api/jobs", headers=headers).status == 200


def test_every_answer_carries_the_policy(served):
    for path in ("/", "/static/page.js", "/api/jobs", "/nowhere", "/api/nowhere"):
        headers = [("Host", "evil.example")] if path == "/api/nowhere" else None
        answer = served.ask("GET", path, headers=headers)
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
        found = {entry[4][0] for entry in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
        for address in (one for one in found if not one.startswith("127.")):
            with pytest.raises(OSError):
                connection.connect((address, served.port))


UPS = ("..", "%2e%2e", "..%00", ".%2e", "%252e%252e", "..%c0%af")
ENDS = (
    ("/", "token"),
    ("%2f", "etc/passwd"),
    ("\\", "etc%2fpasswd"),
    ("%252f", "token"),
    ("//", "etc/passwd"),
)
TRAVERSALS = [f"{up}{between}" * 3 + end for up in UPS for between, end in ENDS]


def test_no_traversal_reaches_a_file(served):
    job = served.new_job({})
    secret = served.token.encode()
    for form in TRAVERSALS:
        for place in ("/static/", "/api/jobs/", f"/api/jobs/{job}/look/", f"/report/{job}/", "/"):
            answer = served.ask("GET", place + form)
            assert answer.status in (400, 403, 404, 405), (place + form, answer.status)
            assert secret not in answer.body and b"root:" not in answer.body
        answer = served.put(job, "beside", form, b"x")
        assert answer.status in (201, 400), (form, answer.text)
    inside = served.space.jobs_folder / job / "files"
    written = [file for file in served.space.path.rglob("*") if file.is_file() and file.read_bytes() == b"x"]
    assert {file.resolve().parent for file in written} <= {inside.resolve()}
