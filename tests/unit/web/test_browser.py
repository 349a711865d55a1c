"""The page in a headless Chromium: from upload to report, by keyboard, quiet, and talking to nobody else."""

import json
import re
import shutil
from urllib.parse import quote

import numpy as np
import pytest
from tests.unit.web.browser import CHROMIUM
from tests.unit.web.made_drops import give_estimate
from tests.unit.web.serving import Served
from tests.unit.web.steps import LOOKED, look_at, open_drop, press, quiet, send, words

from rotordrop.jobs.runner import publish, result_folder, running
from rotordrop.jobs.workspace import Workspace

pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")]


def test_from_upload_by_keys_to_figures_and_again_after_a_reload(browser, server, files):
    browser.open(server.address)
    browser.until("!document.getElementById('empty').hidden")
    assert server.token not in browser.evaluate("location.href")
    send(browser, list(files.values()))
    browser.until(LOOKED)
    browser.until("document.getElementById('status').innerText.includes('Released at')")
    browser.size(820, 1180)  # a tablet: the tabs had begun below its screen
    browser.until("document.getElementById('tabpanel').getBoundingClientRect().top < innerHeight - 150")
    assert browser.evaluate("document.documentElement.scrollWidth <= innerWidth")
    browser.size(1280, 800)
    plots = "[...document.querySelectorAll('#panels .u-over')].map((one) => one.clientHeight)"
    browser.until(f"Math.max(...{plots}) - Math.min(...{plots}) < 3")  # the last one was half the others
    browser.key("n")
    browser.until("document.querySelector('tr.here')")
    first = words(browser, "tr.here")
    browser.key("n")
    browser.until(f"document.querySelector('tr.here').innerText !== {json.dumps(first)}")
    browser.until("/[0-9]/.test(document.querySelector('#readout td').innerText)")
    browser.key("p")
    browser.until(f"document.querySelector('tr.here').innerText === {json.dumps(first)}")
    browser.key("u")
    browser.until("document.querySelector('#readhead').innerText.includes('mil')")
    browser.key("u")
    before = browser.evaluate("document.documentElement.dataset.theme")
    browser.key("t")
    assert browser.evaluate("document.documentElement.dataset.theme") != before
    browser.key("0")
    browser.until("Number(document.getElementById('to').value) > 1900")
    browser.key("?")
    browser.until("document.getElementById('keys').open")
    browser.key("Escape")
    for _ in range(60):
        browser.key("Tab")
        if browser.evaluate("document.activeElement.closest('#tabs') !== null"):
            break
    browser.key("ArrowRight")
    browser.until("document.querySelector('#tabs [aria-selected=true]').innerText === 'Events'")
    assert browser.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert "released" in words(browser, "#tabpanel")
    browser.call("Page.reload")
    browser.until(LOOKED)
    quiet(browser)


def test_an_estimate_goes_on_over_reload_and_restart_and_is_cancelled(browser, server, files):
    look_at(browser, server, list(files.values()))
    press(browser, "estimate")
    browser.until("document.getElementById('cancel')")
    browser.call("Page.reload")
    browser.until("document.getElementById('cancel')")
    quiet(browser)
    server.stop()
    assert running(server.space) == ["estimate"]
    second = Served(Workspace(server.space.path), server.port)
    try:
        browser.until("document.getElementById('cancel') || document.body.innerText.includes('tries again')")
        browser.call("Page.reload")
        browser.until("document.getElementById('cancel')")
        press(browser, "cancel")
        browser.until("document.body.innerText.includes('The estimate was cancelled')")
        job = second.ask("GET", "/api/jobs").told["jobs"][0]
        assert job["states"]["estimate"]["state"] == "cancelled"
    finally:
        second.stop()


def renamed(files, folder):
    """The record with channels that no machine file names."""
    import h5py

    named = folder / "mine.h5"
    named.write_bytes(files["record"].read_bytes())
    with h5py.File(named, "a") as file:
        places = []
        file.visit(places.append)
        # X stands a quarter turn before Y
        for old, new in (("S_NDE_A", "Y1"), ("S_NDE_B", "X1"), ("S_DE_A", "Y2"), ("S_DE_B", "X2")):
            place = next(name for name in places if name.endswith(old))
            file.move(place, place.removesuffix(old) + new)
    return named


def test_twelve_numbers_and_a_record_with_names_of_its_own_get_to_an_estimate(
    browser, server, tmp_path, files
):
    browser.open(server.address)
    browser.choose_files("#files", [renamed(files, tmp_path)])
    browser.until("document.getElementById('sending').open")
    browser.evaluate("document.querySelector('#numbers summary').click()")
    browser.until("document.querySelectorAll('#numberfields input').length >= 11")
    fields = "document.querySelectorAll('#numberfields input')"
    filled = f"for (const one of {fields}) {{one.value = one.placeholder}}"
    browser.evaluate(filled)
    press(browser, "send")
    browser.until("document.getElementById('mapping').open")
    assert "NDE_A" in words(browser, "#channelrows")
    said = words(browser, "#channelrows option:checked")
    assert re.fullmatch(r"\S*Y1, −?\d+ to \d+ µm", said), said  # short enough for a list of 320 px
    chosen = "[...document.querySelectorAll('#channelrows select')].map(one => one.value).join()"
    assert browser.evaluate(chosen).replace("displacement/", "") == "Y1,X1,Y2,X2"
    browser.evaluate("document.querySelector('#mapping .main').click()")
    browser.until(LOOKED)
    press(browser, "estimate")
    browser.until("/Estimating: (?!waiting|compiling|reading)/.test(document.body.innerText)")
    press(browser, "cancel")
    browser.until("document.body.innerText.includes('The estimate was cancelled')")
    quiet(browser)


def test_the_empty_page_offers_a_simulated_drop_to_try(browser, server):
    browser.open(server.address)
    browser.until("!document.getElementById('empty').hidden")
    press(browser, "tryit")
    browser.until(LOOKED)
    (job,) = server.ask("GET", "/api/jobs").told["jobs"]
    assert {"machine", "record", "tail"} < set(job["files"])
    assert browser.evaluate("!document.getElementById('simulated').hidden")
    quiet(browser)


def test_whoever_cannot_press_a_button_reads_why_and_no_trace_is_cut(browser, server, files):
    look_at(browser, server, [files["record"]])
    browser.until("document.getElementById('why').innerText.includes('the machine file')")
    assert browser.evaluate("document.getElementById('estimate').disabled")
    plots = "[...document.querySelectorAll('#panels .plot')]"
    browser.until(f"{plots}.every((one) => one.scrollHeight <= one.clientHeight)")
    for view in ("estimate", "waterfall", "check"):
        browser.evaluate(f"document.querySelector('[data-name={view}]').click()")
        browser.until(f"document.querySelector('[data-name={view}]').ariaSelected === 'true'")
        assert "needs the machine file. Drop it here" in words(browser, "#noreport")
    quiet(browser)


def test_a_record_of_rest_is_offered_as_the_tail(browser, server, tmp_path, files):
    """By its name before it is sent; else by what was seen in it."""
    names = {
        "Ruhelage.csv": "tail",
        "restart.csv": "record",
        "rest_2.csv": "tail",
        "measured_17.csv": "record",
    }
    made = [shutil.copy(files["tail"], tmp_path / name) for name in names]
    browser.open(server.address)
    browser.until("!document.getElementById('empty').hidden")
    browser.choose_files("#files", made)
    browser.until("document.getElementById('sending').open")
    roles = "[...document.querySelectorAll('#roles select')].map(one => one.value)"
    assert browser.evaluate(roles) == list(names.values())
    browser.key("Escape")
    browser.until("!document.getElementById('sending').open")
    send(browser, [files[role] for role in ("machine", "beside", "record")] + made[-1:])
    browser.until("document.getElementById('usetail')")
    assert words(browser, "#usetail") == "Use measured_17 as its settled tail"  # the drop is open
    press(browser, "usetail")
    browser.until("!document.getElementById('usetail')")
    browser.until("document.getElementById('status').innerText.includes('Released at')")
    assert browser.evaluate("dropname.innerText === 'drop_060' && !document.getElementById('usetail')")
    (job,) = server.ask("GET", "/api/jobs").told["jobs"]
    assert job["files"]["tail"]["name"] == "measured_17.csv"
    quiet(browser)


def test_a_file_that_cannot_be_read_is_shown_as_it_begins(browser, server, tmp_path):
    """The error, ways out, and the lines of the file that it speaks of."""
    bad = tmp_path / "export.csv"
    bad.write_text("Zeit;A;B\n0;1;2\n0;<b>x</b>;3\n", encoding="utf-8")
    browser.open(server.address)
    browser.until("!document.getElementById('empty').hidden")
    send(browser, [bad])
    browser.until("!document.getElementById('unread').hidden")
    browser.until("document.querySelectorAll('#unread li').length >= 3")
    assert words(browser, "#unread li:nth-child(3)") == "0;<b>x</b>;3"
    buttons = browser.evaluate("[...document.querySelectorAll('#status button')].map(one => one.innerText)")
    assert buttons == ["Channels …", "Look again", "Remove"]
    press(browser, "todrops")
    browser.until("document.getElementById('unread').hidden && !document.getElementById('list').hidden")


def test_two_cursors_and_their_address(browser, server, files):
    look_at(browser, server, list(files.values()))
    browser.key("n")
    browser.until("document.querySelector('tr.here')")
    browser.until("Math.abs(to.value - from.value - 18) < 0.01")  # that of an impact is drawn
    browser.until("/[0-9]X/.test(document.getElementById('readout').innerText)")
    browser.key("b")
    for _ in range(40):
        browser.key("ArrowRight")
    browser.until("document.getElementById('between').rows.length > 2")
    caption = words(browser, "#between caption")
    apart, rate = (float(one) for one in re.findall(r"([0-9.]+) (?:ms|Hz)", caption))
    assert apart == pytest.approx(2.0, abs=0.05)  # forty samples at 20 kHz, from between two of them
    assert apart * rate == pytest.approx(1e3, rel=1e-3)
    numbers = (
        "[...document.querySelectorAll('#between tbody tr')].map(r => [...r.cells].map(c => c.innerText))"
    )
    for _, at, then, change in browser.evaluate(numbers):
        at, then, change = (float(one.replace("\u2212", "-")) for one in (at, then, change))
        assert change == pytest.approx(then - at, abs=0.2)
    turns, order = (float(re.search(f"([0-9.]+){of}", caption).group(1)) for of in (" turns", "X"))
    assert turns == pytest.approx(60.0 * 2e-3, abs=0.01)  # of a rotor that was dropped from 60 Hz
    assert order == pytest.approx(1e3 / 2.0 / 60.0, rel=0.05)
    browser.until("location.hash.includes('mark=')")
    browser.call("Page.reload")
    browser.until("document.getElementById('between')?.hidden === false")
    assert words(browser, "#between caption") == caption
    quiet(browser)


def test_reports_are_shown_in_a_frame_without_rights(browser, server, files):
    """The report of the look, and that of the machine, which is made when it is asked for; back by Escape."""
    look_at(browser, server, list(files.values()))
    browser.evaluate("document.querySelector('[data-name=look]').click()")
    browser.until("!document.getElementById('reportframe').hidden && document.getElementById('main').hidden")
    assert browser.evaluate("reportframe.sandbox.value") == "allow-scripts allow-downloads allow-modals"
    assert browser.evaluate("reportframe.contentDocument") is None  # of another origin
    address = browser.evaluate("document.getElementById('reporttab').href")
    browser.until("location.hash.includes('report=look')")
    browser.evaluate("location.hash = location.hash.replace('report=look', 'report=check')")
    browser.until("document.getElementById('reportframe').src.includes('/check/')")
    browser.call("Page.reload")
    browser.until("document.getElementById('reportframe')?.src.includes('/check/')")
    browser.key("Escape")
    browser.until("document.getElementById('reports').hidden && !document.getElementById('main').hidden")
    browser.until(LOOKED)
    quiet(browser)
    browser.open(address)
    browser.until("document.documentElement.getAttribute('data-drawn')")
    assert "A look at drop_060" in words(browser, "body")
    browser.size(400, 800)
    seen = "[...document.querySelectorAll('.chart')].map(one => one.getBoundingClientRect())"
    browser.until(f"{seen}.every(one => one.right <= innerWidth && (one.width > 300 || !one.width))")
    browser.until("document.documentElement.scrollWidth <= innerWidth")
    quiet(browser)


def test_ratios_of_a_gap_are_ranges(browser, server):
    browser.open(server.address)
    browser.until("!document.getElementById('empty').hidden")
    for gap, said in (("[250, 300]", "0.900 to 1.08"), ("[300, 300]", "0.900"), ("null", "–")):
        call = f"import('/static/cursor.js').then(m => m.overGap(270, {gap}))"
        assert browser.evaluate(call) == said


def test_an_estimate_and_its_report_say_the_same(browser, server, files):
    """A whole estimate, from the button to its report."""
    look_at(browser, server, list(files.values()))
    press(browser, "estimate")
    browser.until("document.getElementById('cancel')")
    consistent = "The model follows the record."
    browser.until(f"document.getElementById('status').innerText.includes({consistent!r})")
    assert browser.evaluate("document.querySelectorAll('.panel canvas').length") == 4
    chosen = browser.evaluate("new URLSearchParams(location.hash.slice(1)).get('drop')")
    document = server.ask("GET", f"/api/jobs/{chosen}/estimate/document").told
    peak = document["bearings"]["NDE"]["peak_force_N"]["value"]
    shown = words(browser, "#status").replace("\u202f", "")
    assert f"NDE peak bearing force {peak:.0f} N" in shown
    quiet(browser)
    browser.evaluate("document.querySelector('[data-name=estimate]').click()")
    browser.until("document.getElementById('reportframe').src.includes('/estimate/')")
    browser.open(browser.evaluate("document.getElementById('reporttab').href"))
    browser.until("document.documentElement.getAttribute('data-drawn')")
    assert "drop_060" in words(browser, "body")
    assert "follows the record" in words(browser, "#verdict")
    quiet(browser)


def test_more_sensor_planes_than_bearings_are_drawn(browser, server, files):
    number = server.new_job(files)
    server.order(f"/api/jobs/{number}/look")
    assert server.settled(number, "look")["state"] == "done"
    _with_a_third_plane_and_an_estimate(server.space.job(number))
    browser.open(server.address)
    open_drop(browser, "drop")
    browser.until("document.querySelectorAll('.panel canvas').length === 4")
    orbits = "[...document.querySelectorAll('#orbits canvas')].map(c => c.ariaLabel.split(' ')[2]).join()"
    assert browser.evaluate(orbits) == "NDE,DE"
    high = "[p.ariaLabel, p.querySelector('.u-over').clientHeight]"
    panels = browser.evaluate(f"[...document.querySelectorAll('.panel')].map(p => {high})")
    assert [title for title, _ in panels[:2]] == ["Bearing force", "Maximum Hertz stress"]
    assert min(high for _, high in panels[:2]) > 1.3 * max(high for _, high in panels[2:])
    assert words(browser, "#estimate") == "Estimate again"
    press(browser, "whole")
    browser.until("document.querySelectorAll('.panel canvas').length === 5")
    assert browser.evaluate(orbits) == "NDE,DE,MID"
    press(browser, "early")
    browser.until("document.querySelectorAll('.panel canvas').length === 4")
    assert browser.evaluate(orbits) == "NDE,DE"
    _fits_a_telephone(browser)
    quiet(browser)


def _fits_a_telephone(browser):
    """Four figures of force, stress and motion on 400 px: high enough to read, and none leaves the screen."""
    browser.size(400, 800)
    plots = "[...document.querySelectorAll('.panel .u-over')]"
    browser.until(f"{plots}.every(one => one.clientHeight >= 80)")
    browser.until("document.documentElement.scrollWidth <= innerWidth")
    heads = "[...document.querySelectorAll('.panel header, .panel header *')]"
    assert browser.evaluate(f"{heads}.every(one => one.getBoundingClientRect().right <= innerWidth - 8)")
    apart = "p.previousElementSibling.getBoundingClientRect().bottom <= p.getBoundingClientRect().top"
    assert browser.evaluate(f"[...document.querySelectorAll('.plot')].every(p => {apart})")


def _with_a_third_plane_and_an_estimate(job):
    """Add a plane between the bearings to what was seen, and an estimate of the two bearings."""
    seen = shutil.copytree(result_folder(job, "look"), job.path / "look.part")
    page = json.loads((seen / "page.json").read_text())
    page["places"].append({**page["places"][0], "name": "MID"})
    (seen / "page.json").write_text(json.dumps(page))
    publish(job, "look", "1" * 16, seen, job.digests())
    give_estimate(job, 3000.0)


MARK = "window.stolen=1"
SCRIPTS = [
    f"<script>{MARK}</script>",
    f"<img src=x onerror={MARK}>",
    f"<svg/onload={MARK}>",
    f'"><script>{MARK}</script>',
    f"'-{MARK}-'",
    f"javascript:{MARK}",
    f"<iframe srcdoc='<script>parent.{MARK}</script>'>",
    f"</title><script>{MARK}</script>",
    f"<details open ontoggle={MARK}>",
    f"${{{MARK}}}",
    f"{{{{constructor.constructor('{MARK}')()}}}}",
    f"<input autofocus onfocus={MARK}>",
    f"</option></select><img src=x onerror={MARK}>",
    f"<math><mtext><table><mglyph><style><img src=x onerror={MARK}>",
    f"<a href=javascript:{MARK}>x</a>",
    f"<body onload={MARK}>",
    f"<object data=javascript:{MARK}>",
    f"<embed src=javascript:{MARK}>",
    f"<link rel=stylesheet href=javascript:{MARK}>",
    f"<meta http-equiv=refresh content='0;url=javascript:{MARK}'>",
]
WRAPPED = ["{}", "a{}b", "</script>{}", "]]>{}", "-->{}"]


def payloads():
    return [wrapping.format(script) for wrapping in WRAPPED for script in SCRIPTS]


def choose(browser, job):
    browser.evaluate(f"location.hash = 'drop={job}'")
    browser.until(f"!document.getElementById('actions').hidden && location.hash.includes('{job}')")


def test_no_script_in_a_name_is_executed(browser, server):
    """In the name of a job, of its files, of a plane and a channel, in a header entry, in an option."""
    assert len(payloads()) >= 100
    for number, script in enumerate(payloads()):
        plain = script.replace(";", "").replace("[", "").replace("\n", "")
        rows = [f"0.{n:04d};{y:.2f};0;{y:.2f};0" for n, y in enumerate(_fall())]
        head = f"# {plain}\ntime [s];X {plain} [um];Y {plain} [um];X2{plain} [um];Y2{plain} [um]\n"
        job = server.order(
            "/api/jobs", {"name": script, "options": {"gap": script, "operator": script}}
        ).told["id"]
        name = script.replace("/", "|").replace("#", "").replace("?", "") + ".csv"
        sent = (head + "\n".join(rows)).encode()
        done = server.ask("PUT", f"/api/jobs/{job}/files/record?name={quote(name)}", sent)
        assert done.status == 201, done.text
        if number % 10 == 0:
            told = server.space.job(job).read()
            server.space.job(job).write({**told, "options": {}})
            server.order(f"/api/jobs/{job}/look")
        elif number % 20 == 1:
            server.order(f"/api/jobs/{job}/look")
    jobs = [one["id"] for one in server.ask("GET", "/api/jobs").told["jobs"]]
    assert len(jobs) == len(payloads())
    browser.open(server.address)
    looked = []
    for job in jobs:
        states = server.ask("GET", f"/api/jobs/{job}").told["states"]
        if "look" in states:
            looked += [job] if server.settled(job, "look")["state"] == "done" else []
        choose(browser, job)
        if "look" in states:
            browser.until("!document.getElementById('status').innerText.includes('Looking')")
            for tab in ("Events", "Look", "Traces", "Impacts"):
                tabs = "[...document.querySelectorAll('[role=tab]')]"
                browser.evaluate(f"{tabs}.find(t => t.innerText === '{tab}')?.click()")
    assert len(looked) >= 8
    choose(browser, looked[0])
    browser.until("document.querySelector('.panel canvas')")
    press(browser, "channels")
    browser.until("document.getElementById('mapping').open")
    browser.evaluate("document.getElementById('mapping').close()")
    assert browser.evaluate("window.stolen") is None
    quiet(browser)


def _fall():
    """Floats for 50 ms, falls 250 µm, bounces once and lies [µm], at 10 kHz."""
    t = np.arange(0.0, 0.2, 1e-4)
    down = np.sqrt(2 * 250e-6 / 9.81)
    bounce = 0.4 * 9.81 * down * (t - down) - 0.5 * 9.81 * (t - down) ** 2
    path = -250 + 1e6 * np.where(t < down, 250e-6 - 0.5 * 9.81 * t**2, np.maximum(bounce, 0.0))
    return np.concatenate([np.zeros(500), path]) + 0.3 * (-1.0) ** np.arange(2500)
