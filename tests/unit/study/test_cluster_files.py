"""What stands in tools/cluster does what a study needs."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from rotordrop.cli.app import run

CLUSTER = Path(__file__).parents[3] / "tools" / "cluster"
STUDY = """machine = "machine.toml"
drops = 3
shard = 1
speed = "60 Hz"
duration = "2 ms"
reduction = "quick"
"""


@pytest.fixture
def study(tmp_path) -> Path:
    assert run(["init", str(tmp_path), "--example", "small"]) == 0
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


def finished(study: Path) -> int:
    return len(list((study.parent / "study" / "shards").glob("*.npy")))


def test_a_worker_of_the_kubernetes_job_finishes_a_study(study):
    job, policy = yaml.safe_load_all((CLUSTER / "study.yaml").read_text())
    pod = job["spec"]["template"]
    worker = pod["spec"]["containers"][0]
    assert run([part.replace("/studies", str(study.parent)) for part in worker["args"]]) == 0
    assert finished(study) == 3
    assert worker["securityContext"]["readOnlyRootFilesystem"]
    assert pod["spec"]["securityContext"]["runAsNonRoot"]
    assert policy["spec"]["podSelector"]["matchLabels"] == pod["metadata"]["labels"]


def test_a_worker_of_the_slurm_array_finishes_a_study(study):
    places = [str(Path(sys.executable).parent), os.environ["PATH"]]
    subprocess.run(
        ["sh", str(CLUSTER / "study.sbatch"), study.name],
        cwd=study.parent,
        env=os.environ | {"PATH": os.pathsep.join(places)},
        check=True,
        capture_output=True,
    )
    assert finished(study) == 3


def test_the_image_takes_all_that_an_installation_needs():
    taken = (CLUSTER.parents[1] / ".containerignore").read_text().splitlines()
    assert taken[0] == "*"
    for line in taken[1:]:
        assert (CLUSTER.parents[1] / line.removeprefix("!")).exists(), line
    assert {"!src", "!pyproject.toml", "!requirements.lock"} <= set(taken)
