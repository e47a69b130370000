"""Runs every comparison with another program in this folder: `make bench-peers`.

Each script but this one is run by an environment of its own, apart from the package's, with what its
line `# requires:` names (as for pip). What cannot be installed is skipped, and the reason is printed.
`python tests/peers/run.py embree opencv` runs only those; what follows `--` goes to the scripts.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
ENVIRONMENTS = ROOT / "target" / "peers"


def requirements(script: Path) -> list[str]:
    """What the script's `# requires:` line names."""
    found = re.search(r"^# requires:(.*)$", script.read_text(encoding="utf-8"), re.MULTILINE)
    return found.group(1).split() if found else []


def prepare(script: Path) -> Path:
    """The interpreter of the script's environment; built when it or its requirements are new.

    Raises RuntimeError with pip's last error.
    """
    folder = ENVIRONMENTS / script.stem
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    needed = requirements(script)
    done = folder / "installed.txt"
    if done.is_file() and done.read_text().split() == needed:
        return python
    print(f"{script.stem}: installing {' '.join(needed) or 'nothing'}", flush=True)
    venv.create(folder, with_pip=True, clear=True)
    command = [str(python), "-m", "pip", "install", "-q", "--disable-pip-version-check", *needed]
    if needed:
        installed = subprocess.run(command, capture_output=True, text=True, check=False)
        if installed.returncode:
            errors = [line for line in installed.stderr.splitlines() if line.startswith("ERROR")]
            raise RuntimeError(errors[-1] if errors else f"pip ended with {installed.returncode}")
    done.write_text("\n".join(needed))
    return python


def main() -> int:
    """Runs the scripts; 1 when one of them failed."""
    arguments = sys.argv[1:]
    split = arguments.index("--") if "--" in arguments else len(arguments)
    names, passed = arguments[:split], arguments[split + 1 :]
    scripts = [path for path in sorted(HERE.glob("*.py")) if path.name != Path(__file__).name]
    unknown = set(names) - {path.stem for path in scripts}
    if unknown:
        print(f"no such comparison: {', '.join(sorted(unknown))}", file=sys.stderr)
        return 2
    failed = []
    for script in scripts:
        if names and script.stem not in names:
            continue
        print(f"\n== {script.stem}", flush=True)
        try:
            python = prepare(script)
        except (RuntimeError, OSError, subprocess.SubprocessError) as error:
            print(f"skipped: {error}", flush=True)
            continue
        environment = {**os.environ, "PYTHONPATH": str(ROOT / "python"), "PYTHONSAFEPATH": "1"}
        run = subprocess.run([str(python), str(script), *passed], env=environment, check=False)
        if run.returncode:
            failed.append(script.stem)
    if failed:
        print(f"\nfailed: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
