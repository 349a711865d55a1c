"""Write the pages that follow from the sources: machine file, equations, parameters, packages, commands."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path
from typing import Any

import equation_index
import parameter_page
import reference_page

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "rotordrop"


def write(folder: Path) -> None:
    """Write all generated pages, touching only those whose text has changed."""
    folder.mkdir(exist_ok=True)
    pages = {"equations.md": equation_index.index_page(), "commands.md": command_page()}
    pages |= {f"api_{name}.md": package_page(name) for name in packages()}
    pages["api.md"] = api_page()
    pages["parameters.md"] = parameter_page.parameter_page()
    pages["machine_file.md"] = reference_page.machine_page()
    pages["profile.md"] = reference_page.profile_page()
    pages["twelve_numbers.md"] = reference_page.twelve_numbers()
    for name, text in pages.items():
        file = folder / name
        if not file.exists() or file.read_text(encoding="utf-8") != text:
            file.write_text(text, encoding="utf-8")
    for stale in set(folder.glob("*.md")) - {folder / name for name in (*pages, "validation.md")}:
        stale.unlink()


def packages() -> list[str]:
    """List the packages and modules of rotordrop in the order of its layers, highest first."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    rows = settings["tool"]["importlinter"]["contracts"][0]["layers"]
    names = [name.strip(" ()") for row in rows for name in row.split("|")]
    return [name for name in names if _source(name) is not None]


def api_page() -> str:
    """Write the list of the packages."""
    lines = [
        "# Packages",
        "",
        "In the order of the layers: a package imports only from those further down.",
        "",
        "| package | what it is about |",
        "|---|---|",
        *(f"| [`rotordrop.{name}`](api_{name}.md) | {_about(name)} |" for name in packages()),
        "",
        "```{toctree}",
        ":hidden:",
        "",
        *(f"api_{name}" for name in packages()),
        "```",
    ]
    return "\n".join([*lines, ""])


def package_page(name: str) -> str:
    """Write the page of one package: every public module with its functions and classes."""
    modules = [f"rotordrop.{name}"] if _source(name) == PACKAGE / f"{name}.py" else _modules(name)
    blocks = [line for module in modules for line in _module_block(module)]
    return "\n".join([f"# rotordrop.{name}", "", *blocks, ""])


def command_page() -> str:
    """Write what ``--help`` prints of both programs, verb by verb."""
    import typer

    from rotordrop.cli import app
    from rotordrop_bench.cli.app import BenchTable
    from rotordrop_bench.cli.app import app as bench

    parts = ["# Commands", ""]
    for name, program, table in (
        ("rotordrop", app.app, app.VerbTable),
        ("rotordrop-bench", bench, BenchTable),
    ):
        parts += [f"## {name}", "", _help(name, typer.main.get_command(program))]
        for verb, row in table.verbs().items():
            parts += [f"### {name} {verb}", "", _help(f"{name} {verb}", row.load())]
    parts += ["## Exit codes", "", (app.__doc__ or "").split("\n\n", 1)[1].strip(), ""]
    return "\n".join(parts)


def _help(name: str, command: Any) -> str:
    context = command.make_context(name, [], resilient_parsing=True)
    return f"```text\n{command.get_help(context).strip()}\n```\n"


def _module_block(module: str) -> list[str]:
    return [f"## {module}", "", "```{eval-rst}", f".. automodule:: {module}", "   :members:", "```", ""]


def _modules(name: str) -> list[str]:
    folder = PACKAGE / name
    files = sorted(file for file in folder.rglob("*.py") if not file.stem.startswith("_"))
    dotted = [".".join(["rotordrop", *file.relative_to(PACKAGE).with_suffix("").parts]) for file in files]
    return [f"rotordrop.{name}", *dotted]


def _source(name: str) -> Path | None:
    candidates = (PACKAGE / name / "__init__.py", PACKAGE / f"{name}.py")
    return next((file for file in candidates if file.exists()), None)


def _about(name: str) -> str:
    source = _source(name)
    assert source is not None
    text = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8"))) or ""
    return " ".join(text.split("\n\n")[0].split())
