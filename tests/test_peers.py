"""The runner of the comparisons with other programs, without running them."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture
def peers(tmp_path: Path, root: Path) -> Path:
    """The runner alone, in a checkout of its own."""
    folder = tmp_path / "tests" / "peers"
    folder.mkdir(parents=True)
    shutil.copy(root / "tests" / "peers" / "run.py", folder)
    return folder


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(folder / "run.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_every_comparison_says_what_it_needs(root: Path) -> None:
    scripts = [path for path in (root / "tests" / "peers").glob("*.py") if path.name != "run.py"]
    assert scripts
    for script in scripts:
        assert re.search(r"^# requires:( \S+)*$", script.read_text(encoding="utf-8"), re.MULTILINE), script


def test_an_unknown_comparison_is_refused(peers: Path) -> None:
    done = run(peers, "nothing")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "no such comparison: nothing\n"


@pytest.mark.slow
def test_what_cannot_be_installed_is_skipped_and_what_fails_is_named(peers: Path) -> None:
    (peers / "absent.py").write_text("# requires: ./no-such-folder\nprint('never')\n")
    (peers / "broken.py").write_text("# requires:\nraise SystemExit(3)\n")
    (peers / "fine.py").write_text("# requires:\nimport sys\nprint('ran', sys.argv[1:])\n")
    done = run(peers, "--", "--fast")
    assert done.returncode == 1
    assert "skipped: ERROR" in done.stdout
    assert "never" not in done.stdout
    assert "ran ['--fast']" in done.stdout
    assert done.stderr == "\nfailed: broken\n"
    assert run(peers, "fine").returncode == 0
