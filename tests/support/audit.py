"""Looks for known vulnerabilities of what the container installs: `make audit` runs `python -m
tests.support.audit`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.support.hashes import PATH

VULNERABLE_EXIT = 1
UNREACHABLE_EXIT = 3
TIMEOUT_S = "15"
AUDIT = (sys.executable, "-m", "pip_audit", "--require-hashes", "--disable-pip")
OPTIONS = ("--progress-spinner", "off", "--timeout", TIMEOUT_S, "--format", "json")


def verdict(report: dict[str, Any]) -> tuple[int, str]:
    """Return the exit code for a report of pip-audit, and what to say.

    pip-audit finds no vulnerability in a package that it could not look up: such a report is no
    clean one.
    """
    packages = report["dependencies"]
    vulnerable = []
    for package in packages:
        for found in package.get("vulns", ()):
            fixed = ", ".join(found["fix_versions"]) or "no version yet"
            line = f"{package['name']} {package['version']}: {found['id']}, fixed in {fixed}"
            vulnerable.append(line)

    if vulnerable:
        return VULNERABLE_EXIT, "\n".join(vulnerable)

    skipped = [package["name"] for package in packages if "skip_reason" in package]
    if skipped:
        return UNREACHABLE_EXIT, (
            f"no source of vulnerabilities knows {len(skipped)} of {len(packages)} packages here: "
            "nothing is known of them, run `make audit` where such a source can be reached"
        )
    return 0, f"no vulnerability is known of {len(packages)} packages"


def main() -> None:
    """The command. Ends with 0 if no vulnerability is known, 1 if one is, and 3 if no source of
    them can be reached.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "audit.json"
        command = [*AUDIT, *OPTIONS, "--requirement", str(PATH), "--output", str(path)]
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        if path.exists():
            code, said = verdict(json.loads(path.read_text()))
        else:
            code = UNREACHABLE_EXIT
            last = (run.stderr.strip().splitlines() or ["it said nothing"])[-1]
            said = f"no source of vulnerabilities was reached: {last}"

    sys.stdout.write(f"{said}\n")
    sys.exit(code)


if __name__ == "__main__":
    main()
