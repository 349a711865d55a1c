"""Vectors of orders, shaft centreline, orbit of a turn: what the page draws beside the traces."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from tests.unit.web.browser import CHROMIUM, Browser

from rotordrop.spectrum.orders import track_orders
from rotordrop.spectrum.speed_profile import fit_speed_profile
from rotordrop.web.drawn import vectors_of
from rotordrop.web.python_lines import vector_lines

RATE, TURN = 2000.0, 2.0 * np.pi


def test_the_vectors_sent_are_those_that_turn_with_the_shaft():
    time = np.arange(int(8 * RATE)) / RATE
    read = time[::100]
    noise = np.random.default_rng(1).normal(0.0, 1e-3, len(read))
    profile = fit_speed_profile(read, TURN * (50.0 - 2.0 * read) + noise)
    angle = profile.angle_at(time)
    x, y = 3e-6 * np.exp(0.7j), 2e-6 * np.exp(-1.1j)
    moved = np.stack([(x * np.exp(1j * angle)).real, (y * np.exp(1j * angle)).real], axis=1)
    track = track_orders(moved, RATE, profile, orders=(1.0, 2.0))
    told = vectors_of(track)
    assert len(told["time"]) == len(told["speed"]) > 20
    assert told["speed"][0] > told["speed"][-1]
    made = {"found": SimpleNamespace(planes={"NDE": SimpleNamespace(track=track)})}
    exec(vector_lines("NDE").replace("slow = 0.0", f"slow = {TURN * 36.0}"), made)
    near = np.nanargmin(np.abs(track.speed - TURN * 36.0))
    assert made["vectors"][1.0][near] == pytest.approx([0.0, 0.0])
    assert made["vectors"][1.0][0] == pytest.approx(track.amplitude[0, 0] - track.amplitude[near, 0])
    for axis, vector in (("x", x), ("y", y)):
        rows = np.array(told["orders"]["1"][axis])
        assert rows[:, 0] + 1j * rows[:, 1] == pytest.approx(vector, abs=1e-3 * abs(vector))
        assert np.abs(np.array(told["orders"]["2"][axis])[:, :2]).max() < 0.01 * abs(vector)


def test_the_centreline_is_where_the_shaft_is_on_average(server):
    time = np.arange(int(2 * RATE)) / RATE  # of so many samples a turn is more than a hundredth
    centre = np.where(time < 1.0, -20.0, -60.0)  # [µm]
    x, y = 30.0 + 40.0 * np.cos(TURN * 50.0 * time), centre + 40.0 * np.sin(TURN * 50.0 * time)
    rows = "\n".join(f"{t:.6f},{a:.4f},{b:.4f}" for t, a, b in zip(time, x, y, strict=True))
    table = f"time [s],X [um],Y [um]\n{rows}\n".encode()
    job = server.new_job({"record": ("record.csv", table)}, speed="50 Hz", planes="NDE: X 0 deg, Y 90 deg")
    server.order(f"/api/jobs/{job}/look")
    assert server.settled(job, "look")["state"] == "done"
    told = server.ask("GET", f"/api/jobs/{job}/look/page").told["centreline"]
    seen = np.array([told["planes"][0]["x"], told["planes"][0]["y"]])
    assert seen.shape[1] == len(told["time"]) > 50
    begun, ended = np.array(told["time"]) < 0.9, np.array(told["time"]) > 1.1
    assert np.ptp(seen[0]) < 2e-7  # a look puts its centre where it thinks best
    assert np.ptp(seen[1][begun]) < 2e-7
    assert seen[1][ended] - seen[1][begun].mean() == pytest.approx(-40e-6, abs=2e-7)


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_slow_roll_is_taken_off_as_a_vector_and_one_turn_is_filtered(server, tmp_path):
    browser = Browser(tmp_path / "profile")
    try:
        browser.open(server.address)
        browser.until("!document.getElementById('empty').hidden")
        x = "[[5, 1, 0], [null, null, null], [2, -1, 0]]"
        told = f"{{speed: [314, 100, 31.4], orders: {{1: {{x: {x}, y: {x}}}}}}}"
        found = browser.evaluate(
            f"import('/static/vectors.js').then(m => JSON.stringify(m.vectors({told}, 1, 5).x))"
        )
        assert '"re":3,"im":2' in found and '"re":0,"im":0' in found and ",null," in found
        nearest = browser.evaluate(  # of 50, 15.9 and 5 Hz; nothing is known at the second
            f"import('/static/vectors.js').then(m => JSON.stringify([45, 16].map(f => "
            f"m.vectors({told}, 1, f).x.rows)))"
        )
        first, last = nearest.split("]],[[") if "]],[[" in nearest else nearest[1:-1].split("],[")
        assert '"re":0,"im":0' in first and '"re":-3,"im":-2' in first
        assert '"re":3,"im":2' in last and '"re":0,"im":0' in last
        kept = browser.evaluate(
            f"import('/static/vectors.js').then(m => JSON.stringify(m.vectors({told}, 1, 0).x))"
        )
        assert '"re":5,"im":1' in kept and '"taken":null' in kept
        values = "t.map(v => 3 + 2 * Math.cos(7 * v) - Math.sin(7 * v) + 4 * Math.cos(14 * v))"
        apart = (
            "import('/static/cursor.js').then(m => { const n = 400, T = 2 * Math.PI / 7, "
            f"t = Array.from({{length: n}}, (_, i) => i * T / n), v = {values}, "
            "f = m.once(t, v, 0, T); return Math.max(...f.map((one, i) => "
            "Math.abs(one - (3 + 2 * Math.cos(7 * t[i]) - Math.sin(7 * t[i]))))); })"
        )
        assert browser.evaluate(apart) < 1e-9
    finally:
        browser.close()


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_gap_ratios_are_ranges_scales_have_marks_and_sentences_the_chosen_units(server, tmp_path):
    browser = Browser(tmp_path / "profile")
    try:
        browser.open(server.address)
        browser.until("!document.getElementById('empty').hidden")

        def told(module, call):
            return json.loads(
                browser.evaluate(f"import('/static/{module}').then(m => JSON.stringify(m.{call}))")
            )

        assert told("cursor.js", "overGap(270, [250, 300])") == "0.900 to 1.08"
        assert told("cursor.js", "overGap(270, [300, 300])") == "0.900"
        assert told("cursor.js", "overGap(270, null)") == "–"
        for low, high in ((1.36, 1.68), (0.02, 0.05), (-3.0, 1.6), (-0.7, 0.4)):
            marks = told("waterfall.js", f"scaleOf({low}, {high})")
            assert len(marks) >= 2
            assert all(10**low <= one <= 10**high for one in marks)
        browser.evaluate(
            "import('/static/units.js').then(m => { m.learn({length: {SI: [1e-6, 'µm'], "
            "US: [25.4e-6, 'mil']}, force: {SI: [1, 'N'], US: [4.448, 'lbf']}}); m.choose('US'); })"
        )
        said = "gap 273.1 µm (269.5 to 276.7 µm), 88.96 N, 5 N s/m at 60 Hz, 5 N/µm"
        assert told("units.js", f"inWords({said!r})") == (
            "gap 10.75 mil (10.61 to 10.89 mil), 20.00 lbf, 5 N s/m at 60 Hz, 5 N/µm"
        )
        browser.evaluate("import('/static/units.js').then(m => m.choose('SI'))")
        assert told("units.js", f"inWords({said!r})") == said
    finally:
        browser.close()
