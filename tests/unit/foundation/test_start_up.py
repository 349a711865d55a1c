"""Imports and help stay light, a wheel compiles nothing, every wrong call is refused in words."""

import json
import os
import re
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.published import bearing, published, value

import rotordrop as rd
from rotordrop.errors import RotordropError
from rotordrop.evidence.clearance import measure_clearance
from rotordrop.ledger.book import drop_of_estimate, logged_drops
from rotordrop.restart.card import restart_card
from rotordrop.rotor.reduction import Reduction
from rotordrop.rotor.suspension import spring
from rotordrop.severity.ranking import DropSeverity
from rotordrop.simulate.case import MagnetEvent, StateStart
from rotordrop.spectrum.coast_down import WaterfallChoice
from rotordrop.study.repeat import repeat_study
from rotordrop.study.summary import exceedance, quantile

HEAVY = set("scipy scipy.signal numba llvmlite plotly pandas xarray h5py matplotlib pint".split())
HEAVY |= {"pydantic", "jinja2", "numpy"}
CASES = [["-c", "import rotordrop"], ["-m", "rotordrop", "--help"]]


@pytest.mark.parametrize("arguments", CASES, ids=["import", "help"])
def test_no_heavy_module_is_imported(arguments):
    done = subprocess.run(
        [sys.executable, "-X", "importtime", *arguments], capture_output=True, text=True, check=True
    )
    imported = set(re.findall(r"\|\s+([\w.]+)$", done.stderr, flags=re.MULTILINE))
    assert "rotordrop" in imported, "the list of imports was not read"
    assert not imported & HEAVY


@pytest.mark.parametrize("words", [["compare", "A", "B"], ["log", "add", "LOG", "A"]], ids=["compare", "log"])
def test_what_reads_estimates_loads_neither_compiler_nor_scipy_nor_elements(words, tmp_path):
    places = {"LOG": tmp_path / "log.db", "A": tmp_path / "a.json", "B": tmp_path / "b.json"}
    for name, speed in (("A", 60.0), ("B", 75.0)):
        numbers = {"peak_force_N": value(speed, 0.9 * speed, 1.1 * speed), "peak_stress_Pa": value(1e9)}
        drop = published(record=f"{name}.h5", speed_Hz=speed, bearings={"DE": bearing(numbers)})
        places[name].write_text(json.dumps(drop.as_json()))
    program = (
        "import sys\nfrom rotordrop.cli.app import run\n"
        f"assert run({[str(places.get(word, word)) for word in words]!r}) == 0\n"
        "assert not {'numba', 'scipy', 'rotordrop.elements.table'} & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.DEVNULL)


LIGHT = {
    "the report on an estimate loads no simulation": """
import sys, rotordrop.estimation, rotordrop.report.estimate_page
assert 'rotordrop.simulate.drop' not in sys.modules
""",
    "a look with a machine file loads no unit library and no signal library": """
import sys
from importlib.resources import files
from rotordrop.cli.app import run
place = files('rotordrop.examples') / 'lp400' / 'drop_060.h5'
machine = files('rotordrop.machine.examples') / 'lp400.toml'
assert run(['look', str(machine), str(place)]) == 0
loaded = {'pint', 'scipy.signal', 'scipy.ndimage', 'scipy.stats'} & set(sys.modules)
assert not loaded, loaded
""",
    "public names are loaded on first use": """
import sys, rotordrop
assert 'rotordrop.units' not in sys.modules
assert round(rotordrop.parse_quantity('60 Hz', 'speed'), 2) == 376.99
assert 'rotordrop.units' in sys.modules
""",
}


@pytest.mark.parametrize("program", LIGHT.values(), ids=LIGHT)
def test_what_is_not_needed_is_not_loaded(program):
    subprocess.run([sys.executable, "-c", program], check=True, stdout=subprocess.DEVNULL)


def test_every_public_name_exists_and_others_do_not():
    import rotordrop

    for name in rotordrop.__all__:
        assert getattr(rotordrop, name) is not None, name
    assert set(rotordrop.__all__) <= set(dir(rotordrop))
    with pytest.raises(AttributeError, match="module 'rotordrop' has no attribute 'simulate_everything'"):
        rotordrop.simulate_everything  # noqa: B018


ROOT = Path(__file__).parents[3]


def called(*words, folder, **environment):
    """Standard error of a command that must succeed."""
    done = subprocess.run(
        [sys.executable, "-m", *words],
        cwd=folder,
        env={key: value for key, value in os.environ.items() if not key.startswith("NUMBA_")} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stderr


@pytest.mark.slow
def test_a_wheel_with_kernels_compiles_nothing(tmp_path):
    tool = [sys.executable, ROOT / "tools" / "kernels.py", tmp_path / "kernels", "check", "simulate"]
    assert subprocess.run(tool, check=False).returncode == 0
    called(
        *("pip", "wheel", "--no-deps", "--no-build-isolation", "-w", str(tmp_path), str(ROOT)),
        folder=tmp_path,
        ROTORDROP_KERNELS=str(tmp_path / "kernels"),
    )
    (wheel,) = tmp_path.glob("rotordrop-*.whl")
    assert f"cp{sys.version_info.major}{sys.version_info.minor}" in wheel.name
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(tmp_path / "installed")
    on = "lp400/machine.toml"
    for command in ("init --example lp400 lp400", f"check {on}", f"simulate {on} --speed 60Hz"):
        said = called(
            *("rotordrop", *command.split()),
            folder=tmp_path,
            PYTHONPATH=str(tmp_path / "installed"),
            XDG_CACHE_HOME=str(tmp_path / "cache"),
        )
        assert "Compiling" not in said
    assert not (tmp_path / "cache").exists()


MACHINE, PAPER, SMALL = (rd.example_machine(name) for name in ("lp400", "paper", "small"))
NAMES = [sensor.name for sensor in MACHINE.sensors]
TIME = np.arange(200) / 20e3
SIGNALS = np.random.default_rng(1).normal(0.0, 1e-6, (200, 4))


def made(time=TIME, signals=SIGNALS, unit="m", speed="60 Hz", **more):
    return rd.Record.from_arrays(MACHINE, time, signals, unit=unit, speed=speed, **more)


RECORD = made()
LATE = MagnetEvent(action="off", time=5.0)
DROP = DropSeverity(name="a", value=1.0, standard_error=0.1)
MOMENTS = pd.DataFrame({"time [s]": TIME, NAMES[0]: TIME, NAMES[1]: pd.to_timedelta(TIME)})
UNEVEN = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 200))
OTHER = rd.Record.from_arrays(PAPER, TIME, SIGNALS, unit="m", speed="60 Hz")


def plain(**fields):
    given = {"time": TIME, "signals": SIGNALS, "sensors": MACHINE.sensors, "sampling_rate": 20e3}
    return rd.Record(**(given | fields))


def force(record=RECORD, **options):
    return rd.estimate_force(MACHINE, record, **options)


def coast(**fields):
    return rd.CoastDownCase(**({"speed": 10.0} | fields))


def jump(**fields):
    return rd.UnbalanceJump(**({"node": 1, "amount": 1e-3, "time": 0.0} | fields))


def placed(displacement=SIGNALS[:2, :2], velocity=SIGNALS[:2, :2]):
    return rd.PlacedStart(displacement=displacement, velocity=velocity)


AWAY = rd.LevitatedStart(offset=np.full((2, 2), 0.1))


def dropped(start):
    return rd.simulate_drop(MACHINE, case(start=start, reduction="quick", duration=1e-3))


def case(**fields):
    return rd.DropCase(**({"speed": "60 Hz"} | fields))


def framed(index):
    return rd.Record.from_dataframe(MACHINE, pd.DataFrame(SIGNALS, columns=NAMES, index=index), unit="m")


WRONG = {
    # masks, kinds of numbers, lengths
    "complex readings": (lambda: made(signals=SIGNALS + 1j), "signals is a ndarray.*complex128"),
    "texts for readings": (lambda: made(signals=np.full((200, 4), "a")), "signals is .* no array of real"),
    "times not finite": (lambda: made(time=np.where(TIME > 0, TIME, np.nan)), "time holds 1 values"),
    "moments for times": (lambda: made(time=TIME.astype("M8[s]")), "time is .*datetime64"),
    "speed of another length": (lambda: plain(speed=np.ones(10)), r"speed has the shape \(10,\).*\(200,\)"),
    "fewer speeds": (lambda: plain(speed_time=TIME[:3], speed_readings=TIME[:2]), r"shape \(2,\).*\(3,\)"),
    "no unit": (lambda: made(unit=None), "unit is None; expected a text or a Mapping. Say it"),
    "a unit of nothing": (lambda: made(unit=""), r"the unit of \w+ is ''; say it, for example unit='um'"),
    "speed as a number": (lambda: made(speed=60), "speed = 60 has no unit; write '60 Hz'"),
    "speed without unit": (lambda: made(speed="60"), "'60' has no unit; a speed needs one"),
    "few times": (lambda: made(TIME[:10]), r"time has the shape \(10,\) and the signals have 200 samples"),
    "a number for the rate": (lambda: made(16000), "time is one number, 16000; .* sampling rate as text"),
    "few columns": (lambda: made(signals=SIGNALS[:, :3]), r"shape \(200, 3\); expected \(samples, 4\), one"),
    "one channel": (lambda: made(signals={NAMES[0]: TIME}), f"no channel for .*{NAMES[1]}|{NAMES[1]}"),
    "a counted table": (lambda: framed(None), "no column 'time' and its index only counts rows"),
    "rate below zero": (lambda: made(time="-20 kHz"), "sampling rate in time is -2.*positive"),
    "time backwards": (lambda: made(time=TIME[::-1]), "the time runs backwards.*sort"),
    "unit of time": (lambda: made(time_unit="h"), "time_unit is 'h'; expected one of s, ms, us, min"),
    "columns of other names": (lambda: made(signals=pd.DataFrame(SIGNALS, None, list("abcd"))), "no channel"),
    "two levels": (lambda: framed(pd.MultiIndex.from_product([[0], TIME])), "one level of index.*reset"),
    "array for a frame": (lambda: rd.Record.from_dataframe(MACHINE, SIGNALS), "frame is a ndarray"),
    # settings
    "integrator": (lambda: case(integrator="rk4"), "integrator is 'rk4'; expected one of tsit5, dp5"),
    "spin": (lambda: case(spin="no"), "spin is 'no'; expected one of dynamic"),
    "drop of a lifetime": (lambda: case(duration=1e9), "1e.09 s.*3600 s at most"),
    "fine steps": (lambda: case(output_step=1e-12), "makes 2e.11 of them"),
    "step beyond the end": (lambda: case(output_step=1.0), "makes 0.2 of them; expected 1"),
    "jump before": (lambda: jump(time=-1.0), "time is -1.*at least 0"),
    "half a node to jump": (lambda: jump(node=2.5), "node is 2.5.* whole"),
    "delay before": (lambda: rd.LevitatedStart(delay=-1.0), "delay is -1.*at least 0"),
    "orbit of letters": (lambda: rd.LevitatedStart(orbit="12 um"), "orbit is .* no array of real numbers"),
    "endless repeats": (lambda: rd.sweep(MACHINE, {"speed": ["60 Hz"]}, repeats=10**12), "drops = .* 1e8"),
    "a million speeds": (lambda: rd.campbell_diagram(SMALL, np.arange(1e5)), "number of speeds is 100000"),
    "a fast rotor": (lambda: rd.campbell_diagram(SMALL, [0.0, 1e12]), "highest speed .* up to 100000"),
    "lines without end": (lambda: rd.campbell_diagram(SMALL, [9.0], count=10**12), "count is .* up to 1000"),
    "many stiffnesses": (lambda: rd.critical_speed_map(SMALL, np.arange(1.0, 2e4)), "stiffnesses is 19999"),
    "a stiffness of a star": (lambda: rd.critical_speed_map(SMALL, [1e300]), "largest stiffness .* 1e.300"),
    "fewer modes than none": (lambda: Reduction(modes=-3), "modes is -3; expected a whole .* at least 2"),
    "a name for a mode": (lambda: Reduction(attachment="no"), "attachment is 'no'; expected True or False"),
    "a path with a zero": (lambda: rd.load_machine("a\0b"), "path is 'a.x00b'; expected a text or a path"),
    "a number beyond floats": (lambda: rd.look(RECORD, gap=10**400), "gap is 1000.*expected a finite number"),
    "readings beyond floats": (lambda: made(signals=[[10**400] * 4]), "signals is a list .* too large"),
    "known beyond floats": (lambda: rd.Known(value=10**400), "value is 1000.*finite number"),
    "outside the gap": (lambda: dropped(AWAY), "of NDE, whose air gap is"),
    "placed outside the gap": (lambda: dropped(placed(np.full((2, 2), 1e-3))), "whose air gap is"),
    "a state of text": (lambda: StateStart(state="rest"), "state is 'rest' that is no array of real numbers"),
    "many turns": (lambda: rd.LevitatedStart(rotor_angle=1e300), "rotor_angle is 1e.300; .* up to 6283"),
    "a remanent force of a star": (lambda: rd.LevitatedStart(remanent_force=np.full((2, 2), 1e12)), "1e.07"),
    "an unbalance in g mm": (lambda: jump(amount=500.0), "amount .* up to 10"),
    "no unbalance": (lambda: jump(amount=0.0), "amount .* expected a positive"),
    "an event after the end": (lambda: case(magnets=[LATE]), "time of an event .* is 5.0; .* up to 0.2"),
    "no action": (lambda: MagnetEvent(action="x", time=0.0), "action is 'x'; expected one of off"),
    "an axis of none": (lambda: MagnetEvent(action="off", time=0.0, axis="z"), "axis is 'z'; .* one of x, y"),
    "an event at a text": (lambda: MagnetEvent(action="off", time="1 s"), "time is '1 s'; expected a finite"),
    "an event of nothing": (lambda: MagnetEvent.read(None), "event is None; expected a text"),
    "years of coasting": (lambda: coast(duration=1e12), "duration is 1.*up to 86400"),
    "severity of nothing": (lambda: DropSeverity(name=None, value=1.0, standard_error=0.1), "name is None"),
    "a speed of light": (lambda: made(speed=1e9), "speed is 1000000000.0; .* up to 100000"),
    "a rate of light": (lambda: made(time="1e300 Hz"), "sampling_rate is 1e.300; .* up to 1e.09"),
    "a mask of numbers": (lambda: plain(missing=SIGNALS), "missing .* expected .*True or False"),
    "marks of a table": (lambda: plain(marks=SIGNALS), r"marks has the shape \(200, 4\)"),
    "times of a table": (lambda: plain(time=TIME[:, None]), r"time has the shape \(200, 1\)"),
    "nothing to save to": (lambda: dropped(placed()).save(None), "path is None; expected a text or a path"),
    "balls of another": (lambda: dropped(placed()).ball_loads(SMALL, "NDE"), "name of the machine is 'Small"),
    "a bearing of truth": (lambda: dropped(placed()).peak_force(True), "no touchdown bearing True; there"),
    "what holds it": (lambda: force(held=SIGNALS), "held is a ndarray; expected one of free-free, AMBs"),
    "digits": (lambda: rd.format_quantity(1.0, "length", digits=400), "digits is 400; .* up to 17"),
    "a window of nothing": (lambda: RECORD.window(None, 0.1), "nothing lies between nan s and 0.1 s"),
    "magnets of nothing": (lambda: MACHINE.with_magnets_on(None), r"names is None; expected a list"),
    "a limit that is none": (lambda: exceedance(TIME, np.nan), "limit is nan; expected a finite number"),
    "a share of nothing": (lambda: quantile(TIME, None), "share is None; expected a finite number"),
    "a machine for its name": (lambda: logged_drops("l.db", machine=SMALL), "name of a machine is a Machine"),
    "an estimate of nothing": (lambda: drop_of_estimate(None, "A"), "drop is None; expected a Drop"),
    "a table for a coast-down": (
        lambda: rd.waterfall(MACHINE, __file__),
        "recorded one first: .*read_record",
    ),
    "an uneven clock": (lambda: rd.waterfall(MACHINE, made(time=UNEVEN)), "% of the steps of the clock are"),
    "an empty record": (lambda: plain(time=[], signals=SIGNALS[:0]), r"shape \(0, 4\).* one time"),
    "a clock that stands": (lambda: force(plain(time=0 * TIME), held="free-free"), "an even clock"),
    "speeds of none": (lambda: force(plain(speed=np.nan * TIME), held="free-free"), "mean speed .* nan"),
    "rest as text": (lambda: coast(rest="5 s"), "rest is '5 s'"),
    "speed in mm": (lambda: case(speed="60 mm"), "'60 mm' is not a speed"),
    "speed of nothing": (lambda: case(speed=None), r"speed is None; .* or a number \[rad/s\]"),
    "speed that is none": (lambda: case(speed=np.nan), "speed is nan rad/s; expected a finite number"),
    "no duration": (lambda: case(duration=0.0), "duration is 0.0; expected a positive, finite number"),
    "no tolerance": (lambda: case(tolerance=-1e-6), "tolerance is -1e-06; expected a positive"),
    "an endless output": (lambda: case(output_step=np.inf), "output_step is inf; expected a positive"),
    "a step that is none": (lambda: case(largest_step=np.nan), "largest_step is nan; expected a positive"),
    "an odd step": (lambda: coast(output_step=7e-5), "a whole .* 1e5 at most, must fit into 0.2 s"),
    "a fine step": (lambda: coast(output_step=1e-9), "a whole number of steps, 1e5 at most"),
    "a slow start": (lambda: coast(speed=0.001), r"a coast-down starts above 0\.01 rad/s"),
    "rest below zero": (lambda: coast(rest=-1.0), r"rest is -1\.0; expected"),
    "a loose scheme": (lambda: coast(settled_error=1.0), "settled_error is 1.0; .* up to 1e-06"),
    "several speeds": (lambda: case(speed=np.array([1.0, 2.0])), "speed is array.* expected a text such as"),
    "reduction": (lambda: case(reduction="fine"), "reduction is 'fine'; expected one of accurate, quick"),
    "certify as text": (lambda: rd.simulate_drop(MACHINE, case(), certify="no"), "certify is 'no'.* True"),
    "start of stamps": (lambda: made(start="1 s"), r"shape \(200,\) and .* from 1 s; give"),
    "rating in tonnes": (lambda: rd.find_bearing("7203", static_load_rating=5.0), "no balls .* rating"),
    "quick as text": (lambda: rd.Tracked(quick="no"), "quick is 'no'; expected True or False"),
    "rating": (lambda: rd.find_bearing("7203", static_load_rating=np.nan), "static_load_rating .* nan"),
    "number of a bearing": (lambda: rd.find_bearing(7203), "designation is 7203; expected a text"),
    "look at a speed": (lambda: rd.look(RECORD, speed=np.nan), "speed"),
    "look with a map": (lambda: rd.look(RECORD, mapping=["S=X"]), "expected none with a Record"),
    "bandwidth": (lambda: force(held="free-free", bandwidth="100 m"), "'100 m' is not a frequency"),
    "no gap": (lambda: rd.look(RECORD, gap=0.0), r"gap \[m\] is 0.0; expected a positive"),
    "gap below zero": (lambda: rd.look(RECORD, gap="-100 um"), r"gap \[m\] is -"),
    "gap of a street": (lambda: rd.look(RECORD, gap="250 m"), r"gap \[m\] is 250.* up to 0.1"),
    "gap that is no number": (lambda: rd.look(RECORD, gap=np.nan), r"gap \[m\] is nan"),
    "micrometres as metres": (lambda: rd.look(made(signals=1e8 * SIGNALS)), "readings span .* m, .*'um'"),
    "another machine": (lambda: rd.check_record(RECORD, SMALL), "record has sensor .* for another machine"),
    "tail of another": (lambda: rd.estimate_drop(PAPER, OTHER, RECORD), "tail has sensor .* another machine"),
    "half a node": (lambda: force(nodes=[2.5]), r"nodes\[0\] is 2.5"),
    "no drop to restart after": (lambda: restart_card(None), "drop is None; expected a Drop"),
    "one earlier drop": (lambda: restart_card(published(), earlier=published()), r"earlier\[0\] is a tuple"),
    "one drop to rank": (lambda: rd.rank_drops([DROP]), "1 drop given, at least two"),
    "an interval upside down": (lambda: DropSeverity.from_interval("a", 2.5, (3.0, 2.0)), "'a': .* upside"),
    "names of checks": (lambda: restart_card(published(), checks=["good"]), "checks is a list"),
    "a number foreseen": (lambda: restart_card(published(), foreseen=5), "foreseen is 5"),
    "a number for a lift check": (lambda: measure_clearance(5), "record is 5; expected a text or"),
    "a name for a machine": (lambda: measure_clearance("lift.csv", machine="lp400"), "machine is 'lp400'"),
    "amplitude": (lambda: WaterfallChoice(amplitude_kind="rms"), "amplitude_kind is 'rms'; expected one of"),
    "direction": (lambda: WaterfallChoice(components=("z",)), "a component is 'z'; expected one of x, y"),
    "no frequency": (lambda: WaterfallChoice(highest_frequency=np.nan), "highest_frequency is nan"),
    "a fast start": (lambda: placed(velocity=np.full((2, 2), 1e6)), "the largest velocity is .* up to 100"),
    "repeats at a text": (lambda: repeat_study(MACHINE, "60 Hz", duration=0.2), "speed .* is '60 Hz'"),
    "repeats of no time": (lambda: repeat_study(MACHINE, 377.0, duration=-1.0), "duration .* is -1.0"),
    "no speed": (lambda: made(speed=np.nan), "speed is nan"),
    "an endless start": (lambda: made(time="20 kHz", start=np.inf), "start is inf"),
    "a rate that is none": (lambda: plain(sampling_rate=np.nan), "sampling_rate is nan"),
    "an infinite rate": (lambda: plain(sampling_rate=np.inf), "sampling_rate is inf"),
    "no reading at all": (lambda: force(made(signals=np.nan * SIGNALS)), "holds no reading at all"),
    "a force without node": (lambda: force(held="free-free", known_forces=5), "known_forces is 5"),
    "another mask": (lambda: plain(missing=SIGNALS[:3] > 0), r"missing .* \(3, 4\); expected \(200, 4\)"),
    "readings without times": (lambda: replace(RECORD, speed_time=None), "speed_readings belong"),
    "names for sensors": (lambda: replace(RECORD, sensors=NAMES), r"sensors\[0\] is 'S_NDE_A'"),
    "known as text": (lambda: rd.Known(value="3"), "value is '3'; expected a number"),
    "a backward interval": (lambda: rd.Known(value=1.0, interval_90=(2, 0)), "the lower one first"),
    "an error below zero": (lambda: rd.Known(value=1.0, standard_error=-1.0), "standard_error is -1.0"),
    "a status nobody gives": (lambda: rd.Known(value=1.0, status="sure"), "status is 'sure'"),
    "a number for a path": (lambda: MACHINE.with_values({5: 1e-4}), "a path is 5; expected a text"),
    "no channels": (lambda: RECORD.of_channels([]), r"columns is \[\]; expected one or more, each once"),
    "a channel twice": (lambda: RECORD.of_channels([0, 0]), r"columns is \[0, 0\]"),
    "a start of three numbers": (lambda: placed(np.zeros(3)), r"shape \(3,\); expected \(bearings, 2\)"),
    "half a node for a spring": (lambda: spring(3.5, 1e6), "node is 3.5; expected a whole number"),
    "no stiffness": (lambda: spring(3, np.nan), "stiffness or damping of a link holds 1 values"),
    "model of another": (lambda: rd.build_drop_model(MACHINE, "quick").with_machine(SMALL), "another rotor"),
    "moments for readings": (lambda: rd.Record.from_dataframe(MACHINE, MOMENTS, unit="m"), "no channel"),
    "a gigahertz": (lambda: case(speed="1 GHz"), "speed is 6283185307.* up to 100000"),
    "a coarse tolerance": (lambda: case(tolerance=0.1), "tolerance is 0.1; expected .* up to 0.001"),
    "no such channel": (lambda: RECORD.of_channels([9]), "column is 9; expected a whole number"),
    "tail of two": (lambda: rd.check_record(RECORD, MACHINE, RECORD.of_channels([0, 1])), "tail has S_NDE"),
    "no bearing": (lambda: rd.find_bearing("zzz"), "no bearing 'zzz'.*give the geometry"),
    "speeds that are texts": (lambda: rd.campbell_diagram(MACHINE, ["60 Hz"]), "speeds is a list that"),
    # what was given for what
    "a path for a drop": (lambda: rd.changes("a.json", "b.json"), r"drops\[0\] is 'a.json'; expected a Drop"),
    "numbers for drops": (lambda: rd.rank_drops([1.0, 2.0]), r"drops\[0\] is 1.0; expected a DropSeverity"),
    "a case of a drop": (lambda: rd.simulate_coast_down(MACHINE, case()), "case is a DropCase"),
    "exchanged": (lambda: rd.estimate_drop(RECORD, MACHINE), "machine is a Record; expected a Machine"),
    "file for a record": (lambda: rd.estimate_drop(MACHINE, "drop.csv"), "record is 'drop.csv'.*read_record"),
    "frame for a record": (lambda: rd.estimate_drop(MACHINE, pd.DataFrame()), "record is a DataFrame"),
    "one for several": (lambda: rd.estimate_drops(MACHINE, RECORD), r"expected a list.*records=\[...\]"),
    "none for several": (lambda: rd.estimate_drops(MACHINE, []), "records is empty"),
    "few tails": (lambda: rd.calibrate_machine(MACHINE, [RECORD, RECORD], [None]), "1 tails for 2 records"),
    "names": (lambda: rd.estimate_drops(MACHINE, [RECORD], names=["a", "b"]), "2 names for 1 records"),
    "case as a table": (lambda: rd.simulate_drop(MACHINE, {"speed": 1.0}), "case is a dict.*DropCase"),
    "text for a machine": (lambda: rd.simulate_drop("m.toml", case()), "machine is 'm.toml'.*load_machine"),
    "model of nothing": (lambda: rd.build_drop_model(None), "machine is None"),
    "profile as a table": (lambda: rd.read_record("a.csv", MACHINE, profile={}), "profile is a dict"),
    "map as a text": (lambda: rd.read_record("a.csv", MACHINE, mapping="A=B"), "mapping is 'A=B'.*list"),
    "look at an array": (lambda: rd.look(SIGNALS), "record is a ndarray; expected"),
    "gate of an array": (lambda: rd.check_record(SIGNALS, MACHINE), "record is a ndarray"),
    "threads": (lambda: rd.sweep(MACHINE, {"speed": ["60 Hz"]}, threads=-1, drops=1), "threads is -1"),
    "repeats": (lambda: rd.sweep(MACHINE, {"speed": ["60 Hz"]}, repeats=0), "repeats is 0"),
    "one value to vary": (lambda: rd.sweep(MACHINE, {"speed": "60 Hz"}), r"speed is '60 Hz'.*speed=\["),
    "result of nothing": (lambda: rd.load_result(None), "path is None; expected a text or a path"),
    "document of nothing": (lambda: rd.read_document(3), "path is 3; expected a text or a path"),
    "study of nothing": (lambda: rd.load_study(None), "path is None; expected a text or a path"),
    "text to save": (lambda: rd.save_machine("m", "m.toml"), "machine is 'm'; expected a Machine"),
    "list of examples": (lambda: rd.example_record_path(["x"]), "name is a list; expected a text"),
    "path of nothing": (lambda: rd.load_machine(None), "path is None; expected a text or a path"),
    "gravity in m/s": (lambda: rd.Machine(gravity="9 m/s"), "gravity: '9 m/s' is not an acceleration"),
}


@pytest.mark.parametrize(("call", "words"), WRONG.values(), ids=list(WRONG))
def test_a_wrong_call_is_refused_in_words(call, words):
    with pytest.raises(RotordropError, match=words):
        call()


def test_tables_and_masked_arrays_are_read_as_they_are_meant():
    masked = np.ma.masked_array(SIGNALS, np.zeros(SIGNALS.shape, dtype=bool))
    masked[7, 2] = np.ma.masked
    record = made(signals=masked)
    assert np.argwhere(record.missing).tolist() == [[7, 2]]
    assert record.signals[7, 2] != SIGNALS[7, 2]  # bridged, not taken
    frame = pd.DataFrame(SIGNALS, columns=NAMES)[NAMES[::-1]]
    np.testing.assert_allclose(made(signals=frame).signals, SIGNALS)
    index = pd.Timestamp("2026-03-01", tz="Europe/Berlin") + pd.to_timedelta(TIME, unit="s")
    frame = pd.DataFrame(SIGNALS, columns=NAMES, index=pd.DatetimeIndex(index, name="time"))
    record = rd.Record.from_dataframe(MACHINE, frame, unit="m", speed="60 Hz")
    np.testing.assert_allclose(record.time, TIME, atol=1e-9)
    assert rd.UnbalanceJump(node=np.int64(2), amount=np.float32(1e-3), time=0).node == 2


def test_arrays_of_the_caller_stay_his_and_a_window_is_no_copy():
    time, signals = TIME.copy(), SIGNALS.copy()
    record = plain(time=time, signals=signals)
    time[0], signals[0] = -1.0, 1.0
    assert record.time[0] == 0.0
    np.testing.assert_array_equal(record.signals, SIGNALS)
    with pytest.raises(ValueError, match="read-only"):
        record.signals[0] = 0.0
    assert np.shares_memory(RECORD.window(1e-3, 2e-3).signals, RECORD.signals)
