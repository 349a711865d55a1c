"""Requests made from the table of operations, sound and unsound: none ends in an error of the server."""

import json
import random
from urllib.parse import quote

import pytest

from rotordrop.jobs.runner import Runner
from rotordrop.web.app import OPERATIONS

EACH = 40
ODD = [
    *"0 -1 1e308 1e-320 nan inf -inf 0x10 4000 100 99 4001 1_0 ١ null true [] {} 😀 .. ../.. % %zz".split(),
    *"' \" y0 x0 y0,y1 drop a.csv a.gz .csv look estimate machine record <script> ; &".split(),
    *("", " ", "force 0", "a" * 3000, "\x00", "\u202e"),
]
BODIES = [
    *(b"", b"{}", b"[]", b"null", b"{", b"\xff\xfe", b'{"name": 5}', b'{"options": []}', b"9" * 16000),
    *(b'{"options": {"gap": "1 mm"}}', b'{"method": "replay"}', b'{"method": ["a"]}'),
    *(b"[" * 9000, b'{"a": ' * 2000, b'{"name": "\\ud800"}', b'{"name": "\\u0000"}', b"x" * 20_000),
]


def _filled(template, job, generator):
    parts = {
        "job": [job, job, job, "0" * 16, *ODD],
        "verb": ["look", "look", "estimate", "waterfall", *ODD],
        "role": ["machine", "record", "tail", "beside", *ODD],
        "name": ["page.js", "page.css", *ODD],
        "run": ["0" * 16, *ODD],
        "key": ["a" * 64, *ODD],
    }
    for name, values in parts.items():
        safe = "%" if generator.random() < 0.1 else ""
        template = template.replace(f"{{{name}}}", quote(generator.choice(values), safe=safe))
    return template


@pytest.mark.parametrize("operation", OPERATIONS, ids=lambda one: f"{one.method} {one.path}")
def test_no_request_ends_in_an_error_of_the_server(served, files, operation, monkeypatch):
    monkeypatch.setattr(Runner, "_begin", lambda *_: None)  # what is asked for waits: no child per request
    job = served.new_job({"record": files["record"]})
    generator = random.Random(operation.path + operation.method)
    for number in range(EACH):
        if number % 10 == 9 and served.ask("GET", f"/api/jobs/{job}").status == 404:
            job = served.new_job({"record": files["record"]})
        path = _filled(operation.path, job, generator)
        asked = [
            f"{name}={quote(generator.choice(ODD))}"
            for name in operation.query
            for _ in range(generator.choice([0, 1, 1, 2]))
        ]
        path += f"?{'&'.join(asked)}" if asked else ""
        body = generator.choice(BODIES) if operation.method in ("POST", "PUT") else None
        answer = served.ask(operation.method, path, body)
        assert answer.status < 500, (operation.method, path, body, answer.text)
    assert json.loads(served.ask("GET", "/api/jobs").body)["jobs"] != []
    for one in served.ask("GET", "/api/jobs").told["jobs"]:
        served.ask("DELETE", f"/api/jobs/{one['id']}")
