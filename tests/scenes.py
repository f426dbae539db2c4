"""The motions that a page replays, as the command line has them made."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import rigidcli
from rigidcli.report import Report
from rigidcli.scene import Scene


def report_of(study: str, source: Path | dict[str, Any], settings: Sequence[str] = ()) -> Report:
    """The report of a study with the scene of its motion, if there is one."""
    if isinstance(source, Path):
        document = rigidcli.load(source, settings=settings)
    else:
        document = rigidcli.loads(json.dumps(source), settings=settings)
    report: Report = import_module(f"rigidcli.studies.{study}").run(document, scene=True)
    return report


def scene_of(study: str, source: Path | dict[str, Any], settings: Sequence[str] = ()) -> Scene:
    """The scene of the motion that a study finds."""
    scene = report_of(study, source, settings).scene
    assert isinstance(scene, Scene)
    return scene
