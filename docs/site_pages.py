"""What the site makes of the sources: Python, Fortran and C references, the gallery of cases, docstrings for Sphinx."""

import re
import subprocess
import sys
from pathlib import Path

import jointfrf as jf

#: Packages in the order in which a user meets them, and headings of the reference.
_PACKAGES = {
    "identification": "From FRFs to a joint",
    "channels": "From channels to joint DOFs, and what is wrong with them",
    "messages": "Findings",
    "frf": "FRFs, noise, bands",
    "assembly_file": "Assemblies in files",
    "substructuring": "Coupling and decoupling",
    "laws": "Laws of joints",
    "joint": "Joints",
    "models": "Models",
    "solids": "Solid bodies",
    "amplitude": "Joints over amplitude",
    "pooling": "Several assemblies",
    "planning": "Planning",
    "studies": "Studies",
    "report": "Figures and pages",
    "parallel": "Sweeps and processes",
    "kernel": "Algebra of every line",
}

#: Sections of the site, and the documents of each in reading order, as files of the repository.
_SECTIONS = {
    "Start": [
        "README.md",
        "docs/quickstart.md",
        "docs/tutorial.md",
        "docs/coming-from.md",
        "docs/matlab.md",
        "docs/julia.md",
        "docs/related-tools.md",
    ],
    "How to": [
        "docs/measured-file.md",
        "docs/checks.md",
        "docs/common-problems.md",
        "docs/model-fit.md",
        "docs/sides.md",
        "docs/levels.md",
        "docs/pools.md",
        "docs/planning.md",
        "docs/studies.md",
        "docs/report.md",
        "docs/embedding.md",
        "docs/platforms.md",
        "docs/performance.md",
        "docs/cases.md",
    ],
    "Theory": [
        "docs/validation.md",
        "docs/theory.md",
        "docs/equations.md",
        "docs/engine.md",
        "docs/accuracy.md",
        "docs/noise-readings.md",
        "docs/benchmarks.md",
    ],
    "Reference": [
        "docs/python.md",
        "docs/generated/api/index.md",
        "docs/generated/fortran.md",
        "docs/command-line.md",
        "docs/messages.md",
        "docs/glossary.md",
        "docs/files.md",
        "docs/assembly-keys.md",
        "docs/case-keys.md",
    ],
    "Project": [
        "CONTRIBUTING.md",
        "CODE_OF_CONDUCT.md",
        "fortran/README.md",
        "python/packaging/README.md",
        "SECURITY.md",
        "CHANGELOG.md",
        "tests/benchmarks/history.md",
    ],
}


def write_pages(root: Path, folder: Path, version: str) -> None:
    """Write all pages that are made.

    Parameters
    ----------
    root : Path
        The checkout.
    folder : Path
        Where they are written.
    version : str
    """
    (folder / "api").mkdir(parents=True, exist_ok=True)
    _write(folder / "api" / "index.md", _python_reference())
    _write(folder / "fortran.md", _fortran_reference(root, folder, version))
    _write(folder / "gallery.md", _gallery(root))
    listed = {name for names in _SECTIONS.values() for name in names}
    others = sorted(str(page.relative_to(root)) for page in root.glob("docs/*.md"))
    for title, names in _SECTIONS.items():
        more = [name for name in others if name not in {*listed, "docs/index.md"}] if title == "How to" else []
        _write(folder / f"{title.lower().replace(' ', '-')}.md", _section(root, title, [*names, *more]))


def escape_docstring(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Escape what Sphinx would take for its own marks: bars of moduli, underscores at the end of a word."""
    in_example = False
    for i, line in enumerate(lines):
        in_example = line.lstrip().startswith(">>>") or (in_example and bool(line.strip()))
        if not in_example:
            parts = re.split(r"(``.*?``|`.*?`)", line)
            parts[::2] = [re.sub(r"\||(?<=\w)_(?!\w)", r"\\\g<0>", part) for part in parts[::2]]
            lines[i] = "".join(parts)


def _write(path: Path, text: str) -> None:
    """Write a page, unless it is there with this text: else all that depends on it is built again."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _section(root: Path, title: str, names: list[str]) -> str:
    """Return the page of a section: its documents, each with its first sentence."""
    text = [f"# {title}"]
    for name in names:
        heading, _, rest = (root / name).read_text(encoding="utf-8").partition("\n")
        prose = [text for text in re.split(r"\n\s*\n", rest.strip()) if not text.startswith(("`" * 3, "|", "<", "#"))]
        first = prose[0].replace("\n", " ")
        sentence = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", re.split(r"(?<=[.:])\s", first)[0])
        text.append(f"- [{heading.lstrip('# ')}](../../{name}): {sentence.rstrip(':.')}.")
    documents = "\n".join(f"../../{name.removesuffix('.md')}" for name in names)
    if title == "Start":
        text[1:1] = [
            "- [Short examples](examples/index.rst), each a script and a notebook",
            "- [Gallery of cases](gallery.md)",
        ]
        documents += "\nexamples/index\ngallery"
    return f"{text[0]}\n\n" + "\n".join(text[1:]) + f"\n\n```{{toctree}}\n:hidden:\n:maxdepth: 1\n\n{documents}\n```\n"


def _python_reference() -> str:
    """Return the list of all public names, by package."""
    by_title: dict[str, list[str]] = {title: [] for title in [*_PACKAGES.values(), "Errors, names and other things"]}
    for name in jf.__all__:
        module = getattr(getattr(jf, name), "__module__", "jointfrf.").replace("workbench.", "")
        by_title[_PACKAGES.get(module.split(".")[1], "Errors, names and other things")].append(f"jointfrf.{name}")
    by_title["Files: jointfrf.io"] = [f"jointfrf.io.{name}" for name in jf.io.__all__]
    text = [
        "# Python reference",
        "Every public name, with shapes, units, errors and equations. By task: [Python](../../python.md).",
    ]
    for title, names in by_title.items():
        if names:
            listed = "\n".join(sorted(names, key=str.lower))
            text += [
                f"## {title}",
                f"```{{eval-rst}}\n.. autosummary::\n   :toctree: .\n   :nosignatures:\n\n{_indented(listed)}\n```",
            ]
    return "\n\n".join(text) + "\n"


def _indented(text: str) -> str:
    return "\n".join(f"   {line}" for line in text.splitlines())


def _fortran_reference(root: Path, folder: Path, version: str) -> str:
    """Return the reference of the kernel, which is made from its one flat file."""
    api = root / "fortran" / "api"
    sources = [api / "api.F90", *(root / "fortran" / name for name in ("status.f90", "engine.F90"))]
    folder = folder / "kernel"
    folder.mkdir(exist_ok=True)
    command = [sys.executable, "-m", "generate", "reference", "--version", version, "--output", str(folder)]
    subprocess.run([*command, *map(str, sources)], check=True, cwd=api)
    text = (folder / "jointfrf.md").read_text(encoding="utf-8")
    for page in folder.iterdir():  # man pages belong to the installation
        page.unlink()
    folder.rmdir()
    return text


def _gallery(root: Path) -> str:
    """Return the page of all cases: the first sentence of each, its picture where there is one."""
    text = [
        "# Gallery of cases",
        "Each is computed by `./cases/run NAME`; their pictures here are those of the checkout.",
    ]
    pages = sorted(root.glob("cases/*/README.md"))
    for readme in pages:
        title, _, rest = readme.read_text(encoding="utf-8").partition("\n")
        first = re.split(r"\n\s*\n", rest.strip())[0].replace("\n", " ")
        link = f"../../cases/{readme.parent.name}/README.md"
        text += [f"## {title.lstrip('# ')}", first, f"[All of it]({link})"]
        text += [
            f"![{title.lstrip('# ')}]({link.rsplit('/', 1)[0]}/{picture.name})"
            for picture in readme.parent.glob("*.png")
        ]
    listed = "\n".join(f"../../cases/{readme.parent.name}/README" for readme in pages)
    text.append(f"```{{toctree}}\n:hidden:\n\n{listed}\n```")
    return "\n\n".join(text) + "\n"
