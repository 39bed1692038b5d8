"""Write requirements.txt anew, with the hashes of what its index has: `python requirements.py`.

Versions are those of requirements.txt as it is. Of each, what pip would install by Python 3.11 to
3.13 on x86-64 Linux is fetched from PyPI (200 MB each) and hashed.
"""

import hashlib
import os
import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

FILE = Path(__file__).with_name("requirements.txt")
PYTHONS = "3.11", "3.12", "3.13"
INDEX = "https://pypi.org/simple"
ONLY_SOURCE = "empy"  # of which there is no wheel


def fetch(python: str, pinned: str, directory: Path) -> None:
    """Fetch what a Python would be given of the requirements, from no mirror."""
    (directory / "pinned.txt").write_text(pinned)
    words = ["--no-deps", "--only-binary", ":all:", "--no-binary", ONLY_SOURCE]
    words += ["--index-url", INDEX, "--python-version", python, "--dest", directory]
    words += ["--requirement", directory / "pinned.txt"]
    environment = {name: v for name, v in os.environ.items() if name != "PIP_FIND_LINKS"}
    environment["PIP_CONFIG_FILE"] = os.devnull
    command = [sys.executable, "-m", "pip", "download", "--quiet", *words]
    subprocess.run(command, check=True, env=environment)


def hashes(directory: Path) -> dict[str, set[str]]:
    """Hashes by name and version, as in numpy==2.4.6."""
    found: dict[str, set[str]] = {}
    for file in directory.glob("*-*"):
        name, version = re.sub(r"\.tar\.gz$", "", file.name).split("-")[:2]
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        found.setdefault(f"{normal(name)}=={version}", set()).add(digest)
    return found


def normal(name: str) -> str:
    """Name of a package as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def main() -> None:
    """Fetch, and write."""
    lines = [line.split(" --hash")[0] for line in FILE.read_text().splitlines()]
    with TemporaryDirectory() as temporary:
        for python in PYTHONS:
            fetch(python, "\n".join(lines), Path(temporary))
        found = hashes(Path(temporary))
    for number, line in enumerate(lines):
        if line and not line.startswith("#"):
            name, version = line.split("==")
            digests = sorted(found[f"{normal(name)}=={version}"])
            lines[number] = " ".join([line, *(f"--hash=sha256:{digest}" for digest in digests)])
    FILE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
