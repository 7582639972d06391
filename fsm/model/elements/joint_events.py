"""Events of joints: a latch closes or opens, a stop is hit. Kernels write them to the memory of the group.

Steps with error control end at events; the time of an event in a fixed step follows from the coordinates before and after
it. The rate before an event is that of the state before it. The impulse is the integral of the effort of stop and latch
until the coordinate leaves them for the first time; the largest effort of a latch is that of the whole run after it.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d
from fsm.kernels.jit import kernel
from fsm.laws.one_sided import NEAR, part_of_line, part_to
from fsm.model.elements import joint_laws as laws

LATCHES, OPENS, HITS = range(3)
"""What happens."""
_LOBATTO = float(np.sqrt(21.0) / 14.0)
"""Distance of the inner points of Lobatto's rule from the middle."""
WORDS = "latch closes", "latch opens", "stop is hit"


@kernel
def part_before_event(own: np.ndarray, i: int, c: float, rate: float, step: float, held: bool) -> float:
    """Part of a step (s), which ends at a coordinate and a rate, up to its first event; 2 without one. `held` as in
    `fsm.model.elements.joint_laws.stops_after`.
    """
    law, before = floats_2d(own, laws.LAWS)[i], laws.kept(own, laws.COORDINATE, i)
    part = laws.part_to_parting(own, i, c, rate, step, held)
    begins, ends = step * laws.kept(own, laws.RATE, i), step * rate
    if law[laws.STOP] > 0.0:
        part = min(part, part_to(before, c, law[laws.UPPER], NEAR * max(1.0, abs(law[laws.UPPER])), begins, ends))
        part = min(part, part_to(-before, -c, -law[laws.LOWER], NEAR * max(1.0, abs(law[laws.LOWER])), -begins, -ends))
    if law[laws.LATCH] > 0.0:
        sense, near = law[laws.LATCH_SENSE], NEAR * max(1.0, abs(law[laws.LATCH_AT]))
        if laws.kept(own, laws.LATCHED, i) == 0.0:
            part = min(
                part, part_to(sense * before, sense * c, sense * law[laws.LATCH_AT], near, sense * begins, sense * ends)
            )
        else:  # on the way back the damping of a closed latch begins at once
            back = law[laws.PLAY] - sense * law[laws.LATCH_AT]
            part = min(part, part_to(-sense * before, -sense * c, back, near, -sense * begins, -sense * ends))
        if laws.kept(own, laws.LATCHED, i) != 0.0 and law[laws.OPENS_AT] < np.inf:
            effort, most = -sense * laws.stops(own, i, c, rate)[0], law[laws.OPENS_AT]
            part = min(part, part_of_line(-sense * laws.kept(own, laws.BEFORE, i), effort, most, laws.STRONG * most))
    return part


@kernel
def _add(own: np.ndarray, what: int, i: int, t: float, rate: float, c: float) -> int:
    """Add an event; returns its number from 1 on, or -1 if there is no place left, which only counts it."""
    memory = floats_1d(own, laws.KEPT)
    begin = laws.FIELDS * integers_1d(own, laws.KINDS).shape[0]
    number = int(memory[begin])
    memory[begin] = number + 1.0
    if number >= laws.MOST_EVENTS:
        return -1
    first = begin + 1 + laws.EVENT * number
    memory[first], memory[first + 1], memory[first + 2], memory[first + 3] = float(what), float(i), t, rate
    memory[first + 4] = memory[first + 5] = 0.0
    memory[first + 6], memory[first + 7] = c, 1.0
    return number + 1


@kernel
def _follow(own: np.ndarray, number: int, effort: float, impulse: float, touching: bool) -> None:
    """Add to the impulse of an event while it lasts, and keep the largest effort."""
    if number <= 0:
        return
    memory = floats_1d(own, laws.KEPT)
    first = laws.FIELDS * integers_1d(own, laws.KINDS).shape[0] + 1 + laws.EVENT * (number - 1)
    memory[first + 5] = max(memory[first + 5], abs(effort))
    if memory[first + 7] > 0.0:
        memory[first + 4] += impulse
        if not touching:
            memory[first + 7] = 0.0


@kernel
def _impulse(own: np.ndarray, i: int, c: float, rate: float, step: float, part: float) -> float:
    """Integral of the effort of stop and latch over the last part of a step, by Lobatto's rule with five points of the cubic
    between both states.
    """
    memory, m = floats_1d(own, laws.KEPT), integers_1d(own, laws.KINDS).shape[0]
    c_before = memory[laws.COORDINATE * m + i]
    begins, ends, way = step * memory[laws.RATE * m + i], step * rate, c - c_before
    two, three, total = 3.0 * way - 2.0 * begins - ends, begins + ends - 2.0 * way, 0.0
    for k in range(-2, 3):
        x = 1.0 - part * (0.5 - (0.25 * k if abs(k) == 2 else k * _LOBATTO))
        between, faster = c_before + x * (begins + x * (two + x * three)), begins + x * (2.0 * two + 3.0 * x * three)
        effort = memory[laws.BEFORE * m + i]
        if k > -2 or part < 1.0:  # an event in the step begins at its limit
            start = c_before if part == 1.0 else between
            effort = laws.stops_after(own, i, start, between, faster / step, False)[0]
        total += (0.05 if abs(k) == 2 else 16.0 / 45.0 if k == 0 else 49.0 / 180.0) * effort
    return abs(total) * part * step


@kernel
def note_events(own: np.ndarray, i: int, t: float, c: float, rate: float) -> float:
    """Close and open the latch of a coordinate, and note events of latch and stop, at the end of a step; returns the energy
    of a latch that opens, J.
    """
    law, memory, m = floats_2d(own, laws.LAWS)[i], floats_1d(own, laws.KEPT), integers_1d(own, laws.KINDS).shape[0]
    c_before, impact = memory[laws.COORDINATE * m + i], memory[laws.IMPACT * m + i]
    step, hit, closed = t - memory[laws.TIME * m + i], 1.0, 1.0  # parts of the step after the events
    memory[laws.TIME * m + i] = t
    memory[laws.LATCHED * m + i] = np.sign(memory[laws.LATCHED * m + i])
    if law[laws.STOP] == 0.0 and law[laws.LATCH] == 0.0:
        return 0.0
    if law[laws.LATCH] > 0.0 and memory[laws.LATCHED * m + i] == 0.0:
        past, near = law[laws.LATCH_SENSE] * (c - law[laws.LATCH_AT]), NEAR * max(1.0, abs(law[laws.LATCH_AT]))
        if past >= -near and abs(rate) <= law[laws.SLOWER]:
            way = law[laws.LATCH_SENSE] * (c - c_before)
            back = max(past, 0.0) / way if way > past else 0.0  # part of the step after the latch
            speed = law[laws.LATCH_SENSE] * impact
            # a stop at the same place has changed the rate of a light edge at once
            if past <= near or laws.stops(own, i, c, rate)[0] == 0.0:
                speed += (1.0 - back) * (rate - speed)
            memory[laws.LATCHED * m + i], closed = 2.0, back
            memory[laws.IN_LATCH * m + i] = _add(own, LATCHES, i, t - back * step, speed, law[laws.LATCH_AT])
    effort = laws.stops_after(own, i, c, c, rate, False)[0]
    outside = c < law[laws.LOWER] or c > law[laws.UPPER]
    if law[laws.STOP] > 0.0 and outside and memory[laws.IN_STOP * m + i] == 0.0:
        limit = law[laws.LOWER] if c < law[laws.LOWER] else law[laws.UPPER]
        way = abs(c - c_before)
        back = abs(c - limit) / way if way >= abs(c - limit) else 0.0
        sign = -1.0 if c < law[laws.LOWER] else 1.0
        impact = abs(rate) if laws.before_stops(own, i, c) else impact
        # a coordinate that rests on a stop, as at the start, does not hit it
        rests = abs(impact) < law[laws.SLOWEST] and sign * (c_before - limit) >= -NEAR * max(1.0, abs(limit))
        memory[laws.IN_STOP * m + i] = -1.0 if rests else _add(own, HITS, i, t - back * step, sign * impact, limit)
        hit = back
    # where a damped stop or latch no longer pushes, the effort is that of a depth of NEAR
    least = 2.0 * NEAR * max(1.0, abs(c)) * (law[laws.STOP] + law[laws.LATCH])
    for which in (laws.IN_STOP, laws.IN_LATCH):
        number, part = int(memory[which * m + i]), hit if which == laws.IN_STOP else closed
        impulse = _impulse(own, i, c, rate, step, part) if number > 0 and step > 0.0 else 0.0
        _follow(own, number, effort, impulse, part < 1.0 or abs(effort) > least)
    if not outside:
        memory[laws.IN_STOP * m + i] = 0.0
    opened = laws.released(own, i, c, rate)
    if laws.opens(own, i, c, rate):
        memory[laws.LATCHED * m + i] = -2.0
        memory[laws.IN_LATCH * m + i] = 0.0
        _add(own, OPENS, i, t, rate, c)
        effort = laws.stops_after(own, i, c, c, rate, False)[0]
    memory[laws.BEFORE * m + i] = effort
    return opened
