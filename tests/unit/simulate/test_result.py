"""A result on disk: the same after reading, readable by others, refused when damaged or of another kind."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from rotordrop.errors import OutputError, SimulationError
from rotordrop.simulate.case import DropCase
from rotordrop.simulate.drop import simulate_drop
from rotordrop.simulate.result import ContactLog, DropResult, load_result


@pytest.fixture(scope="module")
def saved(drop, tmp_path_factory):
    path = tmp_path_factory.mktemp("drop") / "drop.h5"
    drop.save(path)
    return path


def test_a_result_survives_the_disk(drop, saved):
    again = load_result(saved)
    for item in fields(DropResult):
        one, two = getattr(drop, item.name), getattr(again, item.name)
        if isinstance(one, np.ndarray):
            assert np.array_equal(one, two), item.name
        elif item.name not in ("contacts", "certificate"):
            assert one == two, item.name
    for item in fields(ContactLog):
        one, two = getattr(drop.contacts, item.name), getattr(again.contacts, item.name)
        assert np.array_equal(one, two, equal_nan=True), item.name
    assert again.certificate.sentence() == drop.certificate.sentence()


def test_the_certificate_of_a_checked_drop_is_kept(quick, tmp_path):
    result = simulate_drop(quick, DropCase(speed=300.0, duration=0.012), certify=True)
    assert result.certificate.peak_change_tolerance is not None
    assert np.all(result.certificate.peak_change_tolerance < 5e-3)
    assert np.all(result.certificate.peak_change_truncation < 0.05)
    result.save(tmp_path / "drop.h5")
    again = load_result(tmp_path / "drop.h5").certificate
    assert again.peak_change_truncation == pytest.approx(result.certificate.peak_change_truncation)
    assert "eight more modes" in again.sentence()


def test_netcdf_readers_see_names_units_and_axes(drop, saved):
    xarray = pytest.importorskip("xarray")
    pytest.importorskip("h5netcdf")
    with xarray.open_dataset(saved, engine="h5netcdf") as data:
        assert data["bearing_force"].dims == ("time", "bearing", "axis")
        assert data["bearing_force"].attrs["units"] == "N"
        assert list(data["bearing"].values) == ["NDE", "DE"]
        chosen = data["bearing_force"].sel(bearing="DE", axis="y")
        assert chosen.values == pytest.approx(drop.bearing_force[:, 1, 1])


def test_a_result_becomes_a_labelled_data_set(drop):
    pytest.importorskip("xarray")
    data = drop.to_xarray()
    assert data["max_stress"].sel(bearing="NDE").max() == np.max(drop.max_stress[:, 0])
    assert data.attrs["outcome"] == drop.outcome


@pytest.mark.parametrize("share", [0.0, 0.2, 0.9])
def test_a_truncated_file_is_refused(saved, tmp_path, share):
    content = saved.read_bytes()
    broken = tmp_path / "broken.h5"
    broken.write_bytes(content[: int(share * len(content))])
    with pytest.raises(SimulationError, match=r"broken\.h5 cannot be read as a drop result"):
        load_result(broken)


def test_a_file_of_another_kind_is_refused(tmp_path):
    import h5py

    path = tmp_path / "other.h5"
    with h5py.File(path, "w") as file:
        file["time"] = [0.0, 1.0]
    with pytest.raises(SimulationError, match=r"other\.h5 has format None; expected 'rotordrop drop 2'"):
        load_result(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SimulationError, match=r"gone\.h5 cannot be read"):
        load_result(tmp_path / "gone.h5")


def test_nothing_is_left_behind_when_the_folder_is_missing(drop, tmp_path):
    with pytest.raises(OutputError, match="nowhere"):
        drop.save(tmp_path / "nowhere" / "drop.h5")
    assert list(tmp_path.iterdir()) == []


def test_displacement_at_the_bearing_nodes_is_the_displacement(drop, quick):
    nodes = [bearing.node for bearing in quick.machine.touchdown_bearings]
    assert drop.at_nodes(nodes) == pytest.approx(drop.displacement, abs=1e-18)


@pytest.mark.parametrize(
    ("field", "value"),
    [("duration", 0.0), ("tolerance", -1e-6), ("output_step", np.inf), ("largest_step", np.nan)],
)
def test_impossible_settings_are_refused(field, value):
    with pytest.raises(SimulationError, match=rf"{field} is .*; expected a positive, finite number"):
        DropCase(speed=300.0, **{field: value})


def test_a_speed_that_is_no_number_is_refused():
    with pytest.raises(SimulationError, match="speed is nan rad/s; expected a finite number"):
        DropCase(speed=np.nan)
