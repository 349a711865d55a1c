"""What is computed of a machine alone: the reports of the commands, kept with the drop that has its file."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path
from typing import Any

from rotordrop.document import parse_toml
from rotordrop.errors import UsageError
from rotordrop.files import write_json, write_text
from rotordrop.report.origin import command_line
from rotordrop.web.commands import said_by_command
from rotordrop.web.running import Verb
from rotordrop.web.workspace import Job, beside

COMMANDS: dict[str, list[str]] = {
    "check": ["check", "machine.toml"],
    "speeds": ["critical-speeds", "machine.toml"],
    "unbalance": ["critical-speeds", "machine.toml", "--unbalance"],
    "study": ["study", "run", "study.toml"],
    "design": ["study", "design", "design.toml"],
}
"""The command of each, in a folder that has the machine file under this name."""
_MACHINE = "from rotordrop import load_machine\n\nmachine = load_machine({machine!r})\n"
PYTHON = {
    "check": "from rotordrop.rotor.machine_summary import machine_warnings, summarise_machine\n"
    + _MACHINE
    + "summary = summarise_machine(machine)\nwarnings = machine_warnings(machine, summary)\n",
    "speeds": "import numpy as np\nfrom rotordrop.rotor.campbell import campbell_diagram\n"
    "from rotordrop.rotor.critical_speeds import critical_speed_map\n"
    + _MACHINE
    + "found = critical_speed_map(machine, whirl='forward')\n"
    "speeds = np.linspace(0.0, 1.1 * float(machine.speed.nominal), 61)  # [rad/s]\n"
    "diagram = campbell_diagram(machine, speeds, 'touchdown bearings')\n",
    "unbalance": "from rotordrop.rotor.unbalanced import resolved_response\n"
    + _MACHINE
    + "held = 'AMBs' if machine.ambs else 'touchdown bearings'\n"
    "response = resolved_response(machine, 1.5 * float(machine.speed.nominal), held)\n",
    "study": "from rotordrop.study.plan import load_study\nfrom rotordrop.study.run import run_study\n\n"
    "results = run_study(load_study('study.toml'), 'study')\n",
    "design": "from rotordrop.study.design import best_designs, load_design\n\n"
    "found = best_designs(load_design('design.toml'), 'design')\n",
}


def write_machine_page(
    job: Job, verb: Verb, made: Path, told: dict[str, Any], memory: int, seconds: int
) -> None:
    """Let a command write its report and its numbers about the machine of a job."""
    file = job.file("machine")
    if file is None:
        raise UsageError("this needs a machine file; drop it on the page")
    name = job.read()["files"]["machine"]["name"]
    work = made.with_name(f"{verb}.work-{told['run']}")
    work.mkdir()
    shutil.copy(file, work / "machine.toml")
    for role in beside(job):
        if (place := job.file(role)) is not None:
            shutil.copy(place, work / place.name)
    arguments, files = COMMANDS[verb], {}
    if verb in ("study", "design"):
        plan = _plan(str(told["options"].get("plan", "")))
        write_text(work / f"{verb}.toml", f'machine = "machine.toml"\n{plan}')
        files[f"{verb}.toml"] = f"machine = {json.dumps(name)}\n{plan}"
    written = [
        "--report",
        str(made.resolve() / "report.html"),
        "--json",
        str(made.resolve() / "document.json"),
    ]
    said_by_command([*arguments, *written], memory=memory, seconds=seconds, folder=work)
    if not (made / "report.html").is_file():
        raise UsageError(f"{verb} found nothing that could be shown")
    command = command_line([name if word == "machine.toml" else word for word in arguments])
    python = PYTHON[verb].format(machine=name)
    write_json(made / "page.json", {"command": command, "python": python, "files": files})


def _plan(text: str) -> str:
    """A plan without the machine it names: it is that of the job."""
    try:
        parse_toml(text)
    except ValueError as error:
        raise UsageError(f"the plan cannot be read as TOML: {error}") from None
    kept = [line for line in text.splitlines() if not re.match(r"\s*machine\s*=", line)]
    return "\n".join([*kept, ""])
