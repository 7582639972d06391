"""Reading of files with a model of their own, such as those of `fsm study`, `fsm optimise` and `fsm calibrate force`."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from fsm.case.loading.toml_file import read_toml
from fsm.case.schema.faults import faults_of
from fsm.case.schema.model import Model
from fsm.errors import CaseError

File = TypeVar("File", bound=Model)


def read_file(path: Path, model: type[File]) -> File:
    """Content of a file.

    Raises
    ------
    CaseError
        The file has faults; all are listed.
    """
    data = read_toml(path)
    try:
        return model.model_validate(data, context={"units": "SI"})
    except ValidationError as error:
        raise CaseError(faults_of(error, data, (), "SI", model), str(path)) from None
