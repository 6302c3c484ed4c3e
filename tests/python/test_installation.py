"""What pip does with a checkout."""

import pathlib

import pytest

ROOT = pathlib.Path(__file__).parents[2]


def test_pip_builds_in_a_temporary_folder() -> None:
    settings = pytest.importorskip("scikit_build_core.settings.skbuild_read_settings")
    read = settings.SettingsReader.from_file(ROOT / "pyproject.toml").settings
    assert read.build_dir == ""  # a folder named here would stay in the checkout
