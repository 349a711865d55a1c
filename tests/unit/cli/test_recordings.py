"""Recordings given on the command line: one drop must not count as two."""

from __future__ import annotations

from pathlib import Path

import pytest

from rotordrop.cli.app import run
from rotordrop.cli.estimate import require_own_drops
from rotordrop.errors import UsageError
from rotordrop.machine import example_path
from rotordrop.record.examples import example_record_path
from rotordrop.record.record import Record


def test_equal_files_under_two_names_are_refused(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.csv", "b.csv", "c.csv")]
    for path, content in zip(paths, ("t,x", "t,y", "t,x"), strict=True):
        path.write_text(content)
    require_own_drops(paths[:2])
    with pytest.raises(UsageError, match=r"a\.csv and .*c\.csv are the same recording .* Leave one"):
        require_own_drops(paths)


def test_a_missing_file_is_left_to_the_reader(tmp_path: Path) -> None:
    require_own_drops([tmp_path / "none.csv", tmp_path / "other.csv"])


@pytest.mark.parametrize("verb", ["estimate", "calibrate"])
def test_a_tail_of_another_recorder_has_a_profile_of_its_own(
    verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also one without a speed, as recorders of slow data have none."""
    text = example_record_path("lp400_drop_060_tail").read_text()
    other, rules = tmp_path / "slow.csv", tmp_path / "slow.toml"
    other.write_text(text.replace("S_NDE_A", "X1").replace("S_DE_B", "Y2"))
    rules.write_text('[channels]\nS_NDE_A = "X1"\nS_DE_B = "Y2"\n')
    seen = []

    def noted(_machine: object, _records: object, tails: list[Record], **_others: object) -> None:
        seen.extend(tails)
        raise UsageError("seen")

    monkeypatch.setattr("rotordrop.estimation.estimate_drops", noted)
    monkeypatch.setattr("rotordrop.twin.calibrated.calibrate_machine", noted)
    call = [
        verb,
        str(example_path("lp400")),
        str(example_record_path("lp400_drop_060")),
        "--tail",
        str(other),
    ]
    call += ["--output", str(tmp_path / "m.toml")] if verb == "calibrate" else []
    assert run(call) == 3
    assert "no channel 'S_NDE_A' for sensor S_NDE_A (2 sensors have none)" in capsys.readouterr().err
    assert run([*call, "--tail-profile", str(rules)]) == 64
    assert seen[0].channel_names == ("S_NDE_A", "S_NDE_B", "S_DE_A", "S_DE_B")
    assert seen[0].speed is None
