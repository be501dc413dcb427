"""Packages are compared with the hashes that are checked in."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
TOOL = ROOT / "python" / "check_hashes.py"
TEXT = (ROOT / "python" / "constraints.txt").read_text(encoding="utf-8")
KNOWN = runpy.run_path(str(TOOL))["known_hashes"](TEXT)


def test_every_version_has_hashes():
    pins = re.findall(r"^([\w.-]+)==(\S+)", TEXT, re.MULTILINE)
    assert len(pins) > 50
    assert {name for name, version in pins if not KNOWN[name, version]} == set()
    assert len(KNOWN) == len(pins)


def report(name, version, **archive):
    return {"install": [{"metadata": {"name": name, "version": version},
                         "download_info": {"url": "https://example.org/a.whl", **archive}}]}  # fmt: skip


NAME, VERSION = "markupsafe", next(version for name, version in KNOWN if name == "markupsafe")
GOOD, BAD = min(KNOWN[NAME, VERSION]), "0" * 64


@pytest.mark.parametrize(
    ("content", "wrong"),
    [
        (report("MarkupSafe", VERSION, archive_info={"hashes": {"sha256": GOOD}}), ""),
        (report("MarkupSafe", VERSION, archive_info={"hash": f"sha256={GOOD}"}), ""),
        (report("MarkupSafe", VERSION, archive_info={"hashes": {"sha256": BAD}}), f"sha256 {BAD}"),
        (report("MarkupSafe", VERSION, archive_info={}), "sha256 unknown"),
        (report("markupsafe", VERSION, vcs_info={}), "sha256 unknown"),
        (report("MarkupSafe", "0.0.1", archive_info={"hashes": {"sha256": BAD}}), ""),
        (report("jointfrf", "0.2.0", dir_info={"editable": True}), ""),
    ],
)
def test_a_package_of_another_hash_is_told(tmp_path, content, wrong):
    path = tmp_path / "report.json"
    path.write_text(json.dumps(content))
    done = subprocess.run([sys.executable, "-I", "-S", TOOL, path], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (int(bool(wrong)), "")
    assert wrong in done.stdout
    assert bool(done.stdout) == bool(wrong)


def test_the_set_up_compares_before_it_goes_on():
    text = (ROOT / "python" / "bootstrap.sh").read_text(encoding="utf-8")
    assert text.count("pip --disable-pip-version-check --no-input install") == 1
    reports = re.findall(r"\(exec_pip_install (build/\S+) ", text)
    checked = [report for report in reports if f"check_installed {report}\n" in text]
    # The package itself, whose dependencies are there, comes from no archive.
    assert len(reports) == 3
    assert [report for report in reports if report not in checked] == ["build/installed-own.json"]
    assert re.search(r"build/installed-own.json \S*--no-build-isolation --no-deps ", text)
    for report in checked:
        assert text.index(f"exec_pip_install {report} ") < text.index(f"check_installed {report}\n")
