"""The licences in docs/security.md are those that the installed packages declare."""

import re
import sys
from importlib.metadata import PackageNotFoundError, distribution, requires
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROW = re.compile(r"^\| ([\w, …]+) \| [^|]* \| ([^|]+) \|$", re.MULTILINE)
LISTED = {
    name: licence.strip()
    for names, licence in ROW.findall((ROOT / "docs" / "security.md").read_text())
    for name in names.split(", ")
    if name not in ("package", "…")
}
LICENCE = re.compile(r"<license[^>]*>\s*(.*?)\s*</license>")
# what brings nothing of its own to what is run, or is ROS and in the table by the package in it
OTHERS = {"setuptools", "ros-jazzy-rclpy", "ros-jazzy-common-interfaces"}


def declared(name):
    """Licence of a package: of ROS by its package.xml, else by the metadata of its wheel."""
    found = Path(sys.prefix) / "share" / name / "package.xml"
    if found.exists():
        return LICENCE.search(found.read_text())[1]
    about = distribution(name).metadata
    classes = [text for text in about.get_all("Classifier") or [] if text.startswith("License")]
    named = [text.split(" :: ")[-1] for text in classes]
    return about.get("License-Expression") or ", ".join(named) or about.get("License")


@pytest.mark.parametrize("name", LISTED)
def test_a_licence_is_the_one_that_the_package_declares(name):
    try:
        assert declared(name) == LISTED[name]
    except PackageNotFoundError:
        pytest.skip("not installed here")


def test_all_that_is_required_is_listed():
    needed = [text for text in requires("climber_uk") if "extra" not in text]
    extras = [text for text in requires("climber_uk") if re.search("ros|analysis|campaign", text)]
    names = {re.split(r"[^\w-]", text)[0] for text in [*needed, *extras]}
    assert names >= {"numpy", "rosbags", "ros-jazzy-rclpy"}
    assert names - OTHERS <= LISTED.keys()
