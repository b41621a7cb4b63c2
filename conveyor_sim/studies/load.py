# SPDX-License-Identifier: Apache-2.0
"""Reads a study: YAML in, all that its runs need out, or an error that names file, line, field and value."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from conveyor_sim.errors import SceneError, StudyError
from conveyor_sim.scene import load_scene
from conveyor_sim.scene.part import validated
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.provenance import SceneFile, Sources
from conveyor_sim.scene.refusal import refused
from conveyor_sim.scene.yaml_lines import LONGEST_TEXT, Document
from conveyor_sim.studies.code import digest_of, files_of, function, located
from conveyor_sim.studies.metrics import WORDS, metric_of
from conveyor_sim.studies.setup import Setup
from conveyor_sim.studies.study import MSER, Study
from conveyor_sim.support.files import FileError, read_file
from conveyor_sim.support.resources import scene_path


def load_study(path: str | PathLike[str]) -> Setup:
    """Read a study file. Raises StudyError with one line for each problem of it, SceneError for those of its scene."""
    file = Path(path)
    try:
        text = read_file(file, LONGEST_TEXT).decode("utf-8")
    except FileError as error:
        raise StudyError(f"{path}: {error}, expected a study file") from None
    except UnicodeDecodeError:
        raise StudyError(f"{path}: not UTF-8 text, expected a study file in UTF-8") from None
    return parse_study(text, str(path), file.parent)


def parse_study(text: str, name: str = "<text>", folder: Path | None = None) -> Setup:
    """Read a study from YAML text; `name` stands for the file in errors. folder: where paths start; None: here.

    Raises as `load_study`.
    """
    folder = (folder or Path()).resolve()
    if not text.strip():
        raise StudyError(f"{name}: the file is empty, expected a study")
    try:
        document = Document(text, name)
        study = _study(document, name)
        problems = [*study.problems(), *_metric_problems(study, folder)]
        if problems:
            raise refused(problems, Sources(SceneFile(name, document)).place_of, name)
    except SceneError as error:
        raise StudyError(str(error)) from None
    code = {what: located(what, folder) if what else "" for what in (study.function or "", study.controller or "")}
    metrics = {name: _metric(what, folder) for name, what in study.metrics.items()}
    made = code[study.function or ""]
    if made:
        try:
            function(made)
        except StudyError as error:
            line = document.line_of(("function",))
            raise StudyError(f"{name}:{line}: function: {error}") from None
    scene = None if study.scene is None else load_scene(_scene_path(study.scene, folder))
    made_by = {str(file): digest_of(file) for what in code.values() if what for file in files_of(what)}
    asked, code_of_metrics = dict(study.metrics), dict[str, str]()
    for metric, what in metrics.items():
        if ":" in what.partition(" ")[0]:
            digests = {str(file): digest_of(file) for file in files_of(what)}
            asked[metric] = " ".join([study.metrics[metric], *digests.values()])
            code_of_metrics |= digests
    return Setup(
        study=study,
        path=name,
        source=text,
        text="" if scene is None else scene.source_text,
        name="" if scene is None else scene.source_name,
        overrides="" if scene is None else scene.overrides_text,
        function=made,
        controller=code[study.controller or ""],
        metrics=metrics,
        code=made_by | code_of_metrics,
        made_by=tuple(made_by),
        asked=asked,
    )


def _study(document: Document, name: str) -> Study:
    study = validated(Study, document.data)
    if isinstance(study, tuple):
        raise refused(study[0], Sources(SceneFile(name, document)).place_of, name, study[1])
    return study


def _metric_problems(study: Study, folder: Path) -> list[Problem]:
    problems: list[Problem] = []
    settling = False
    for name, what in study.metrics.items():
        try:
            settling = metric_of(_metric(what, folder)).series is not None or settling
        except StudyError as error:
            problems.append(Problem(("metrics", name), str(error)))
    if study.warm_up == MSER and not settling and not problems:
        words = ", ".join(word for word, found in WORDS.items() if found.series is not None)
        problems.append(Problem(("warm_up",), f"{MSER} given, expected one of these metrics, which show it: {words}"))
    return problems


def _metric(what: str, folder: Path) -> str:
    """Return a metric's text with the file of a function located."""
    return located(what, folder) if ":" in what.partition(" ")[0] else what


def _scene_path(scene: str, folder: Path) -> Path:
    """Beside the study, or else as every command finds it."""
    beside = folder / scene
    return beside if beside.is_file() else scene_path(scene)
