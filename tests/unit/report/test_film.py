"""The film of a drop: what its frames show, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image, ImageColor

from rotordrop.errors import OutputError
from rotordrop.estimate.bearing_drop import AirGap, BearingDrop, History, Motion, Origin, highest
from rotordrop.report.film import (
    FOOT,
    FORCE,
    FRAME_TIME,
    FRAMES,
    HEAD,
    PANEL,
    REACH,
    ROTOR,
    require_film,
    write_film,
)

GAP = 200e-6


def _bearing(name: str, sense: float) -> BearingDrop:
    """A rotor that goes once along its clearance circle in 0.2 s and presses outward where it is."""
    time = np.linspace(0.0, 0.2, 2001)
    angle = sense * 2.0 * np.pi * time / 0.2
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    force = History(label="", time=time, values=np.full(len(time), 1000.0))
    return BearingDrop(
        name=name,
        motions=(Motion(label="", time=time, displacement=GAP * outward),),
        force=force,
        force_vector=-1000.0 * outward,
        stress=force,
        peak_force=highest(force, "N", Origin.SIMULATION),
        peak_stress=highest(force, "Pa", Origin.SIMULATION),
        air_gap=AirGap.of(GAP),
    )


@pytest.fixture(scope="module")
def film(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("film") / "drop.gif"
    write_film([_bearing("NDE", 1.0), _bearing("DE", -1.0)], path, simulated=True)
    return path


def _frame(path: Path, number: int) -> np.ndarray:
    with Image.open(path) as image:
        image.seek(number)
        return np.asarray(image.convert("RGB")).astype(int)


def _middle(frame: np.ndarray, colour: str, columns: slice) -> tuple[float, float]:
    """Centre (x right, y up, from the middle of a panel) of what has nearly a colour [px]."""
    square = frame[HEAD : HEAD + PANEL, columns]
    near = np.abs(square - ImageColor.getrgb(colour)).sum(axis=2) < 60
    rows, places = np.nonzero(near)
    return float(places.mean()) - 0.5 * PANEL, 0.5 * PANEL - float(rows.mean())


def test_it_lasts_twelve_seconds_with_a_panel_for_each_bearing(film: Path) -> None:
    with Image.open(film) as image:
        assert image.n_frames == FRAMES  # type: ignore[attr-defined]
        assert image.size == (2 * PANEL, HEAD + PANEL + FOOT)
        assert image.info["duration"] == 1e3 * FRAME_TIME


@pytest.mark.parametrize("number", [74, 149, 224])
def test_rotor_and_arrow_are_where_the_drop_has_them(film: Path, number: int) -> None:
    frame, angle = _frame(film, number), 2.0 * np.pi * (number + 1) / FRAMES
    for columns, sense in ((slice(0, PANEL), 1.0), (slice(PANEL, None), -1.0)):
        outward = np.array([np.cos(angle), np.sin(sense * angle)])
        rotor = np.array(_middle(frame, ROTOR, columns))
        assert_allclose(rotor, 0.5 * PANEL * REACH * outward, atol=2.0)
        arrow = np.array(_middle(frame, FORCE, columns)) - rotor
        assert arrow @ outward > 0.9 * np.hypot(*arrow) > 10.0


def test_a_force_that_is_over_at_the_end_of_a_frame_has_no_arrow_in_it(tmp_path: Path) -> None:
    """Rotor and arrow are of one instant: a blow from 100.2 to 100.4 ms ends before its frame, at 100.7."""
    bearing, path = _bearing("NDE", 1.0), tmp_path / "blow.gif"
    time = bearing.force.time
    blow = (time > 0.1001) & (time < 0.1005)
    assert bearing.force_vector is not None
    write_film([replace(bearing, force_vector=np.where(blow[:, None], bearing.force_vector, 0.0))], path)
    near = np.abs(_frame(path, 150)[HEAD : HEAD + PANEL] - ImageColor.getrgb(FORCE)).sum(axis=2) < 60
    assert not near.any()


def test_a_simulated_drop_says_so_in_every_frame(tmp_path: Path, film: Path) -> None:
    measured = tmp_path / "measured.gif"
    write_film([_bearing("NDE", 1.0), _bearing("DE", -1.0)], measured)
    for number in (0, 150, FRAMES - 1):
        differs = np.any(_frame(film, number) != _frame(measured, number), axis=2)
        assert differs[-30:].any()
        assert not differs[: HEAD + PANEL].any()


def test_a_drop_that_is_not_certain_has_no_single_number(tmp_path: Path, film: Path) -> None:
    unsure = tmp_path / "unsure.gif"
    write_film([_bearing("NDE", 1.0), _bearing("DE", -1.0)], unsure, simulated=True, certain=False)
    differs = np.any(_frame(film, 100) != _frame(unsure, 100), axis=2)
    assert differs[HEAD + PANEL : -30].any()
    assert not differs[: HEAD + PANEL].any()


@pytest.mark.parametrize("name", ["drop.mp4", "drop"])
def test_another_format_is_refused(name: str) -> None:
    with pytest.raises(OutputError, match=r"is not a format of films; write \.gif"):
        require_film(Path(name))


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rotordrop.report.film.find_spec", lambda name: None)
    with pytest.raises(OutputError, match=r"pip install 'rotordrop\[film\]'"):
        require_film(Path("drop.gif"))
