"""Conditions of `[[event]]` on channels, contacts and time, and what happens when they become true."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fsm.case.derived.event_words import TIME, Condition, conditions_of, quantity, turned
from fsm.case.models.case import Case
from fsm.case.models.event import event_names
from fsm.case.schema.known_names import nearest_name
from fsm.channels.offer import Model, Offer, State, offers_of
from fsm.channels.sample import models_of_case
from fsm.errors import CaseError, Fault
from fsm.model.elements.events import EventGroup
from fsm.solve.outcome.run_io import SavedState

_TINY, _FAR = 5e-324, 1e300
"""Least positive number, and one in place of infinite distances."""
_Value = Callable[[State], float]


class EventWatch:
    """Events of a case: values of their conditions, and their actions; see `fsm.solve.outcome.run_io.Watch`.

    Attributes
    ----------
    names : names of the events
    """

    def __init__(self, model: Model, source: str = "") -> None:
        self.events, faults = model.case.event, list[Fault]()
        self.names = event_names(self.events)
        offered = offers_of(model) if self.events else {}
        self._parts: list[list[tuple[Condition, _Value]]] = []
        self._times: list[list[float]] = []
        for number, event in enumerate(self.events):
            parts: list[tuple[Condition, _Value]] = []
            times: list[float] = []
            for condition in conditions_of(event.when):
                try:
                    if condition.subject == TIME:
                        times.append(quantity(condition.value, "s", model.case.units))
                    parts.append((condition, _value_of(condition, offered, model)))
                except ValueError as error:
                    faults.append(Fault(f"event.{number}.when", str(error)))
            self._parts.append(parts)
            self._times.append(times)
        if faults:
            raise CaseError(faults, source)

    def next_time(self, system: Any, t: float) -> float:
        """See `Watch`."""
        waits = zip(self._times, _group(system).happened.tolist(), strict=True)
        return min((time for times, done in waits for time in times if not done and time > t), default=math.inf)

    def values(self, system: Any, state: SavedState) -> np.ndarray:
        """See `Watch`."""
        at, happened = State(system, state), _group(system).happened.tolist()
        each = zip(self._parts, happened, strict=True)
        return np.array([-math.inf if done else min(value(at) for _, value in parts) for parts, done in each])

    def happen(self, system: Any, numbers: np.ndarray, state: SavedState) -> bool:
        """See `Watch`."""
        group = _group(system)
        poses = system.all_states(state.time, state.q, state.u)["poses"]
        for number in numbers.tolist():
            group.happen(number, state.time, poses)
        return any(action.verb == "end" for number in numbers.tolist() for action in group.actions[number])

    def rows(self, system: Any) -> list[dict[str, Any]]:
        """Events that happened, for the summary."""
        nothing = dict.fromkeys(("coordinate", "rate_before", "impulse", "largest"), "")
        return [
            {"time": time, "what": "; ".join(self.events[k].do), "joint": self.names[k], "unit": ""} | nothing
            for k, time in _group(system).times()
        ]

    def missing(self, system: Any) -> list[str]:
        """Warnings of events that did not happen."""
        each = zip(self.names, self.events, _group(system).happened.tolist(), strict=True)
        return [f"{name} did not happen: {event.when!r} never became true" for name, event, done in each if not done]


def event_lines(case: Case) -> list[str]:
    """Lines of `fsm check`: all events.

    Raises
    ------
    CaseError
        A channel does not exist, or a value does not have its unit.
    """
    names = EventWatch(models_of_case(case)[0]).names
    return [f"{name}: when {event.when}: {', then '.join(event.do)}" for name, event in zip(names, case.event, strict=True)]


def _group(system: Any) -> EventGroup:
    return next(group for group in system.groups if isinstance(group, EventGroup))


def _value_of(condition: Condition, offered: dict[str, Offer], model: Model) -> _Value:
    """Function of a state that is positive where a condition is true.

    Raises
    ------
    ValueError
        The channel does not exist or is no number, or the value does not have its unit.
    """
    if condition.contact:
        names = list(model.system.pair_names)
        pair = names.index(condition.subject if condition.subject in names else turned(condition.subject))
        return lambda state: _signed(min(-float(state.saved.observation.pairs.gap[pair]), _FAR), False)
    if condition.subject == TIME:
        limit = quantity(condition.value, "s", model.case.units)
        return lambda state: _signed(state.time - limit, False)
    offer, place = _offer_of(condition.subject, offered)
    bound, sense, strict = quantity(condition.value, offer.unit, model.case.units), condition.sense, condition.strict
    return lambda state: _signed(sense * (float(np.ravel(offer.at(state))[place]) - bound), strict)


def _offer_of(subject: str, offered: dict[str, Offer]) -> tuple[Offer, int]:
    """Channel of a condition, and the place of the component."""
    ways: dict[str, tuple[Offer, int]] = {}
    for offer in offered.values():
        labels = [label.removeprefix(offer.name).strip() for label in offer.info.labels]
        if len(labels) > 1:
            ways |= {f"{offer.name}.{label}": (offer, k) for k, label in enumerate(labels)}
        else:
            ways[offer.name] = offer, 0
    for name in (subject, f"joint.{subject}"):
        if name in ways:
            return ways[name]
    short = [name.removeprefix("joint.") for name in ways]
    raise ValueError(f"no channel is called {subject!r}{nearest_name(subject, _first(short, subject))}")


def _first(names: Sequence[str], subject: str) -> list[str]:
    """Names with those of the same object first."""
    own = subject.rpartition(".")[0]
    return sorted(names, key=lambda name: not (own and name.startswith(f"{own}.")))


def _signed(value: float, strict: bool) -> float:
    """A value that is never zero: at equality it is positive unless the condition is strict."""
    return value or (-_TINY if strict else _TINY)
