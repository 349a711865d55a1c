"""Machines on the page: reports of the commands about a machine, kept with the drop that has its file."""

from __future__ import annotations

import json

import pytest
from tests.unit.web.browser import CHROMIUM, Browser
from tests.unit.web.serving import Served
from tests.unit.web.steps import quiet, words

from rotordrop.web.running import publish, write_state


def machine_alone(server: Served, files) -> str:
    return server.new_job({role: files[role] for role in ("machine", "beside")})


def test_a_machine_alone_is_checked_by_the_command(server, files):
    number = machine_alone(server, files)
    assert server.order(f"/api/jobs/{number}/check").status == 202
    assert server.settled(number, "check", 300)["state"] == "done"
    page = server.ask("GET", f"/api/jobs/{number}/check/page").told
    assert page["command"] == "rotordrop check lp400.toml"
    assert "load_machine('lp400.toml')" in page["python"]
    document = server.ask("GET", f"/api/jobs/{number}/check/document").told
    assert document["machine"].startswith("LP-400")
    address = server.order(f"/api/jobs/{number}/check/report").told["address"]
    report = server.ask("GET", address)
    assert report.headers["x-frame-options"] == "SAMEORIGIN"
    assert report.headers["content-security-policy"].startswith("sandbox")
    assert "share of the weight" in report.text


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ("drops = ", "the plan cannot be read as TOML"),
        ("drops = 2\n[vary]\nnonsense = { uniform = [0, 1] }", "nonsense"),
        ("machine = '/etc/passwd'\ndrops = 0", "drops"),  # the machine of a plan is that of the job
    ],
)
def test_a_plan_that_cannot_be_used_is_refused_in_the_words_of_the_command(server, files, plan, words):
    number = machine_alone(server, files)
    server.order(f"/api/jobs/{number}/study", {"plan": plan})
    state = server.settled(number, "study", 120)
    assert state["state"] == "failed"
    assert words in state["error"]
    assert "passwd" not in state["error"]
    assert str(server.space.path) not in state["error"]


def test_what_needs_a_machine_and_what_needs_a_record_is_said(server, files):
    record, machine = server.new_job({"record": files["record"]}), machine_alone(server, files)
    assert "no machine file was sent" in server.order(f"/api/jobs/{record}/check").text
    assert "no record was sent" in server.order(f"/api/jobs/{machine}/look").text
    too_long = server.order(f"/api/jobs/{machine}/study", {"plan": "#" * 8001})
    assert (too_long.status, "the option plan is" in too_long.text) == (400, True)


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_the_tabs_of_a_machine_show_its_reports_in_a_frame_without_rights(server, files, tmp_path):
    number = machine_alone(server, files)
    job = server.space.job(number)
    made = job.path / "speeds.made"
    made.mkdir()
    told = {"command": "rotordrop critical-speeds lp400.toml", "python": "diagram = 1\n", "files": {}}
    (made / "page.json").write_text(json.dumps(told))
    (made / "document.json").write_text("{}")
    script = "<script>try { parent.stolen = 1 } catch { document.body.id = 'refused' }</script>"
    (made / "report.html").write_text(f"<title>x</title><body><h1>Campbell</h1>{script}")
    publish(job, "speeds", "0" * 16, made)
    write_state(job, "speeds", {"state": "done", "run": "0" * 16, "fraction": 1.0, "options": {}})
    browser = Browser(tmp_path / "profile")
    try:
        browser.open(server.address)
        browser.until("!document.getElementById('empty').hidden")  # a machine alone is no drop
        browser.evaluate("tomachines.click()")
        browser.until("document.querySelector('#machinerows')")
        assert "critical speeds" in words(browser, "#machinerows")
        browser.evaluate("document.querySelector('#machinerows a').click()")
        browser.until("document.querySelector('#tab-speeds')")
        browser.evaluate("document.querySelector('#tab-check').focus()")
        browser.key("ArrowRight")
        browser.until("document.querySelector('#machinepanel iframe')")
        browser.until("document.querySelector('#tab-speeds').ariaSelected === 'true'")
        assert "tab=speeds" in browser.evaluate("location.hash")
        browser.evaluate("new Promise(done => setTimeout(done, 500))")
        assert browser.evaluate("window.stolen") is None
        browser.evaluate("[...document.querySelectorAll('#machinepanel [role=menuitem]')][3].click()")
        browser.until("document.getElementById('lines').open")
        assert words(browser, "#code").strip() == "rotordrop critical-speeds lp400.toml"
        quiet(browser)
    finally:
        browser.close()
