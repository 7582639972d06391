"""Names and parameters of laws in a case, including laws of extensions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NoReturn

from pydantic import BaseModel, ValidationError, ValidationInfo
from pydantic_core import PydanticCustomError, PydanticKnownError

from fsm.case.schema.units import did_you_mean, with_unit
from fsm.registry import AddedLaw


def check_law(value: Any, built_in: Iterable[str], added: Mapping[str, AddedLaw]) -> Any:
    """Check the name of a law; an unknown name raises an error that lists all names."""
    names = [*built_in, *added]
    if value not in names:
        listed = [f"'{name}'" for name in names]
        expected = " or ".join([", ".join(listed[:-1]), listed[-1]] if len(listed) > 1 else listed)
        raise PydanticKnownError("literal_error", {"expected": expected})
    return value


def check_element_law(value: Any, added: Mapping[str, AddedLaw]) -> Any:
    """Name of the law of an element, which an extension must have added."""
    return value if value is None else check_kind(value, added)


def check_kind(value: Any, added: Mapping[str, AddedLaw]) -> Any:
    """Name of a kind of elements, which an extension must have added."""
    if not added:
        _refuse(f"{with_unit(value, None)} needs an extension that adds it; name its file in `extensions`")
    return check_law(value, (), added)


def check_parameters(
    value: Any, law: object, added: Mapping[str, AddedLaw], info: ValidationInfo, key: str = "law"
) -> dict[str, Any] | None:
    """Parameters of a law (or of another key) of an extension, in SI; other laws have no parameters."""
    known = added.get(law) if isinstance(law, str) else None
    if known is None or known.parameters is None:
        if not value or key not in info.data:  # the value of the key is wrong, which has its own fault
            return None
        _refuse(f"not used with {key} = {with_unit(law, None)}; only those of extensions have parameters; remove this key")
    try:
        return dict(known.parameters.model_validate(value or {}, context=info.context).model_dump(exclude_none=True))
    except ValidationError as error:
        _refuse("; ".join(_text(detail, list(known.parameters.model_fields)) for detail in error.errors(include_url=False)))


def with_parameters(written: Mapping[str, Any], law: object, added: Mapping[str, AddedLaw]) -> dict[str, Any]:
    """Section with an empty section for the parameters of an extension, so that the validation reports missing
    parameters.
    """
    known = added.get(law) if isinstance(law, str) else None
    return {"parameters": {}, **written} if known is not None and known.parameters is not None else dict(written)


def only_given(section: BaseModel, data: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of a section that the case gives; defaults of keys that the law of an extension does not use may be invalid."""
    return {key: value for key, value in data.items() if key in section.model_fields_set}


def _text(detail: Any, keys: list[str]) -> str:
    place = ".".join(str(key) for key in detail["loc"])
    if detail["type"] == "extra_forbidden":
        return f"{place}: unknown key{did_you_mean(place, keys) or '; allowed here: ' + ', '.join(keys)}"
    if detail["type"] == "missing":
        return f"{place}: missing; this key is required"
    message = str(detail["ctx"]["error"]) if detail["type"] == "value_error" else detail["msg"]
    return f"{place}: {message[:1].lower()}{message[1:]}" if place else message


def _refuse(text: str) -> NoReturn:
    raise PydanticCustomError("quantity", "{text}", {"text": text})
