"""Laws on the coordinate of a joint or on the length between two points: kernels of `fsm.model.elements.joint_forces`.

Each law is an effort against the coordinate c (an angle with all turns, or a length) with its slopes, its energy and its
dissipated power; a motor pushes along c. A row of the table `LAWS` has the parameters of all laws of one coordinate, and the
memory has its state at the last accepted step.

A stop or latch beyond a limit by p has k p + d p', or k p (1 + b p'/v) with the speed v of the impact (Hunt and Crossley,
J. Appl. Mech. 42 (1975) 440), which returns with e v for (1 + e) b = log((1 + b)/(1 - e b)), whatever the inertia; neither
pulls. The effort of the damping begins with a jump: a step that ends just beyond a stop has the effort before the jump, and
the next step that after it. Friction is M tanh(c'/v), or the bristles of `fsm.laws.friction.lugre` with a constant
coefficient: s is their deflection over the largest one, M s their moment. A harness has (o + u)/2 + s (o - u)/2 between its
curves of opening and closing, with a slider s, and so has a spring with hysteresis.
"""

from __future__ import annotations

import numpy as np

from fsm.kernels.addresses import floats_1d, floats_2d, integers_1d, integers_2d
from fsm.kernels.jit import kernel
from fsm.kernels.pieces import pieces_at, program_at
from fsm.laws.one_sided import NEAR, ends_at, mean_loss, one_sided, part_of_line, part_to
from fsm.laws.step import step
from fsm.model.elements.element_group import OWN

KINDS, LINES, LAWS, FIRST, ROWS, KEPT, PROGRAMS, FELT, FELT_OF, HELD, PIECES = range(OWN, OWN + 11)
"""Rows of the table of the group."""
LOAD, SPRING, REST, DAMPER, LOWER, UPPER, STOP, STOP_DAMPER = range(8)
LATCH_AT, LATCH_SENSE, PLAY, LATCH, LATCH_DAMPER, SLOWER, OPENS_AT, REBOUND, SLOWEST = range(8, 17)
SIDE, TABLE_AT, GAS, GAS_AT, COLUMN, EXPONENT = range(17, 23)
FRICTION, FOLLOWS, SLIP_RATE, PRESLIDING, SLIDER, MOTOR, RATIO, WHEEL, BAND = range(23, 32)
SPRING_SLIDER, SPRING_BEGINS = 32, 33
COLUMNS = 34
"""Columns of the laws."""
OF_SPRING, OF_DAMPER, OF_HARNESS, OF_WIDTH, OF_MOTOR, OF_SPRING_WIDTH = range(6)
TABLES = 6
"""Tables of a coordinate, of effort over coordinate or over rate, with rows (coordinate or rate, effort, slope); without
slopes (NaN) the effort is straight between the rows, else cubic."""
FREE, PUSH = range(2)
"""Programs of a coordinate: change of the free length, and of the motor."""
NO_MOTOR, TORQUE, CURVE, GOVERNED = range(4)
"""Kinds of motors."""
COORDINATE, LATCHED, BRISTLE, HARNESS, IMPACT, EFFORT, BENT, LOST, TIME, BEFORE, IN_STOP, IN_LATCH, RATE = range(13)
SPRING_SLID = 13
FIELDS = 14
"""Memory of a coordinate: coordinate, state of the latch (0 open, 1 closed, 2 closed at the end of the last step, -1 opened
by force, -2 at the end of the last step), deflection of the bristles,
slider of the harness, rate before a stop, effort and energy of bristles and sliders, energy lost by them in the last step,
time, effort of stop and latch, the numbers of their present events, from 1 on (-1: at rest on a stop), the rate, and the
slider of the spring."""

EVENT = 8
"""Numbers of an event: what, row, time (s), rate before, impulse, largest effort, coordinate, whether it lasts."""
MOST_EVENTS = 256
EVENTS = EVENT * MOST_EVENTS

Law = tuple[float, float, float, float, float]
"""Effort, its slopes by coordinate and by rate, energy (J), dissipated power (W)."""
_ELASTIC = 0.8
"""Elastic limit of bristles, relative to their largest deflection."""
_LEAST = 1e-6
"""Least column of gas, relative to that of the extended length; iterates may pass it."""
STRONG = 1e-6
"""Part of the largest effort of a latch within which it opens."""


@kernel(inline=True)
def kept(own: np.ndarray, field: int, i: int) -> float:
    """Memory of a coordinate."""
    return float(floats_1d(own, KEPT)[field * integers_1d(own, KINDS).shape[0] + i])


@kernel
def table_at(own: np.ndarray, i: int, which: int, c: float) -> tuple[float, float, float]:
    """Value of a table, its slope, and its integral from the first row on; straight beyond the rows."""
    first, rows = integers_1d(own, FIRST), floats_2d(own, ROWS)
    begin, end = first[TABLES * i + which], first[TABLES * i + which + 1]
    if end - begin < 2:
        return 0.0, 0.0, 0.0
    straight = np.isnan(rows[begin, 2])
    energy, k = 0.0, begin
    while k < end - 2 and c > rows[k + 1, 0]:
        wide = rows[k + 1, 0] - rows[k, 0]
        energy += 0.5 * wide * (rows[k, 1] + rows[k + 1, 1])
        if not straight:
            energy += wide * wide * (rows[k, 2] - rows[k + 1, 2]) / 12.0
        k += 1
    wide, past = rows[k + 1, 0] - rows[k, 0], c - rows[k, 0]
    slope = (rows[k + 1, 1] - rows[k, 1]) / wide
    if straight:
        return rows[k, 1] + slope * past, slope, energy + past * (rows[k, 1] + 0.5 * slope * past)
    if past < 0.0:
        slope = rows[k, 2]
        return rows[k, 1] + slope * past, slope, energy + past * (rows[k, 1] + 0.5 * slope * past)
    two = (3.0 * slope - 2.0 * rows[k, 2] - rows[k + 1, 2]) / wide
    three = (rows[k, 2] + rows[k + 1, 2] - 2.0 * slope) / (wide * wide)
    beyond, past = max(past - wide, 0.0), min(past, wide)
    value = rows[k, 1] + past * (rows[k, 2] + past * (two + past * three))
    slope = rows[k, 2] + past * (2.0 * two + past * 3.0 * three)
    energy += past * (rows[k, 1] + past * (0.5 * rows[k, 2] + past * (two / 3.0 + 0.25 * past * three)))
    return value + slope * beyond, slope, energy + beyond * (value + 0.5 * slope * beyond)


@kernel
def _bend_of_table(own: np.ndarray, i: int, which: int, c: float) -> float:
    """Second derivative of a table."""
    first, rows = integers_1d(own, FIRST), floats_2d(own, ROWS)
    begin, end = first[TABLES * i + which], first[TABLES * i + which + 1]
    if end - begin < 2 or np.isnan(rows[begin, 2]) or c < rows[begin, 0] or c > rows[end - 1, 0]:
        return 0.0
    k = begin
    while k < end - 2 and c > rows[k + 1, 0]:
        k += 1
    wide = rows[k + 1, 0] - rows[k, 0]
    slope = (rows[k + 1, 1] - rows[k, 1]) / wide
    two = (3.0 * slope - 2.0 * rows[k, 2] - rows[k + 1, 2]) / wide
    three = (rows[k, 2] + rows[k + 1, 2] - 2.0 * slope) / (wide * wide)
    return float(2.0 * two + 6.0 * three * (c - rows[k, 0]))


@kernel
def _program(own: np.ndarray, i: int, which: int, t: float) -> tuple[float, float]:
    """Value and slope of a program; zero without one."""
    number = integers_2d(own, PROGRAMS)[i, which]
    if number < 0:
        return 0.0, 0.0
    value, slope, _ = program_at(pieces_at(own, PIECES), number, t)
    return value, slope


@kernel
def _elastic(own: np.ndarray, i: int, t: float, c: float, rate: float) -> tuple[float, float, float, float, float, float]:
    """Law of spring, gas and damper, and the power that a moving free length puts in."""
    law = floats_2d(own, LAWS)[i]
    moved, pace = _program(own, i, FREE, t)
    past = c - law[REST] - moved
    effort, by_c, energy = table_at(own, i, OF_SPRING, c - law[TABLE_AT] - moved)
    effort += law[LOAD] + law[SPRING] * past
    by_c += law[SPRING]
    energy += law[LOAD] * past + 0.5 * law[SPRING] * past * past
    if law[GAS] > 0.0:
        left, n = max(law[COLUMN] + c - law[GAS_AT], _LEAST * law[COLUMN]), law[EXPONENT]
        pushed = law[GAS] * (law[COLUMN] / left) ** n
        effort -= pushed
        by_c += n * pushed / left
        if n == 1.0:
            energy -= law[GAS] * law[COLUMN] * np.log(left / law[COLUMN])
        else:
            energy += (pushed * left - law[GAS] * law[COLUMN]) / (n - 1.0)
    put_in = -effort * pace
    if law[SIDE] != 0.0 and not law[SIDE] * effort > 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    rate -= pace
    damped, by_rate, _ = table_at(own, i, OF_DAMPER, rate)
    damped += law[DAMPER] * rate
    by_rate += law[DAMPER]
    if law[SIDE] != 0.0 and not law[SIDE] * (effort + damped) > 0.0:  # it slackens faster than the spring returns
        return 0.0, 0.0, 0.0, energy, -effort * rate, put_in + effort * pace
    return effort + damped, by_c, by_rate, energy, damped * rate, put_in - damped * pace


@kernel
def stops(own: np.ndarray, i: int, c: float, rate: float) -> Law:
    """Law of both stops and of the latch in a step from the last accepted state."""
    return stops_after(own, i, kept(own, COORDINATE, i), c, rate, False)


@kernel
def stops_after(own: np.ndarray, i: int, before: float, c: float, rate: float, held: bool) -> Law:
    """Law of both stops and of the latch in a step that begins at the coordinate `before`.

    `held`: the step ends at the first event, and up to there the law is smooth. A stop that does not touch at its begin has
    no effort, a damped stop that pushes there may pull, and one that no longer pushes there loses its energy.
    """
    effort = by_c = by_rate = energy = lost = 0.0
    for side in range(_sides(own, i)):
        sense, limit, stiffness, damper, rebound = _stop(own, i, side)
        beyond, faster, depth = sense * (c - limit), sense * rate, sense * (before - limit)
        near = NEAR * max(1.0, abs(limit))
        if held and depth < -near:
            continue
        if held and damper > 0.0 and rebound == 0.0:
            elastic, push = stiffness * beyond, stiffness * beyond + damper * faster
            pushes = depth + damper / stiffness * sense * kept(own, RATE, i) > near
            if pushes or depth > near:
                energy += 0.5 * elastic * beyond
                if pushes or (beyond > 0.0 and push > 0.0):
                    effort += sense * push
                    by_c += stiffness
                    by_rate += damper
                    lost += damper * faster * faster
                else:
                    lost -= elastic * faster
                continue
        if not held and ends_at(depth, beyond, near):
            damper = 0.0
        damper += stiffness * max(beyond, 0.0) * rebound
        push, slope, damping, stored, heat = one_sided(beyond, faster, stiffness, damper)
        effort += sense * push
        by_c += slope * (1.0 + rebound * faster)
        by_rate += damping
        energy += stored
        lost += heat
    return effort, by_c, by_rate, energy, lost


@kernel
def _sides(own: np.ndarray, i: int) -> int:
    """Number of stops that act: lower, upper, and the latch if it is closed."""
    return 3 if kept(own, LATCHED, i) > 0.0 else 2


@kernel
def _stop(own: np.ndarray, i: int, side: int) -> tuple[float, float, float, float, float]:
    """Sense, limit, stiffness, damping and rebound of a stop or latch."""
    law = floats_2d(own, LAWS)[i]
    if side == 2:
        return -law[LATCH_SENSE], law[LATCH_AT] - law[LATCH_SENSE] * law[PLAY], law[LATCH], law[LATCH_DAMPER], 0.0
    rebound = law[REBOUND] / max(kept(own, IMPACT, i), law[SLOWEST]) if law[REBOUND] > 0.0 else 0.0
    return -1.0 if side == 0 else 1.0, law[LOWER + side], law[STOP], law[STOP_DAMPER], rebound


@kernel
def mean_loss_of_stops(own: np.ndarray, i: int, before: float, c: float, rate: float) -> float:
    """Mean dissipated power of stops and latch in a step between two coordinates, W; of those that acted in the step, if its
    end is accepted.
    """
    total, sides = 0.0, _sides(own, i)
    if c == kept(own, COORDINATE, i) and before != c:
        sides = 3 if kept(own, LATCHED, i) == 1.0 or kept(own, LATCHED, i) == -2.0 else 2
    for side in range(sides):
        sense, limit, stiffness, damper, rebound = _stop(own, i, side)
        total += mean_loss(sense * (before - limit), sense * (c - limit), sense * rate, stiffness, damper, rebound)
    return total


@kernel
def before_stops(own: np.ndarray, i: int, c: float) -> bool:
    """Whether a coordinate is between its stops, or only as far beyond one as a step that ends there."""
    law = floats_2d(own, LAWS)[i]
    low, high = law[LOWER], law[UPPER]
    return bool(low - NEAR * max(1.0, abs(low)) <= c <= high + NEAR * max(1.0, abs(high)))


@kernel
def part_to_parting(own: np.ndarray, i: int, c: float, rate: float, step: float, held: bool) -> float:
    """Part of a step (s) up to the state in which a damped stop or latch no longer pushes, see `part_of_line`. `held`: also
    up to the limit, if it no longer pushes at the begin; see `stops_after`.
    """
    part, before, faster = 2.0, kept(own, COORDINATE, i), kept(own, RATE, i)
    for side in range(_sides(own, i)):
        sense, limit, stiffness, damper, rebound = _stop(own, i, side)
        if damper == 0.0 or rebound > 0.0 or not sense * (before - limit) > 0.0:
            continue
        late = sense * damper / stiffness
        pushed, pushes = sense * (before - limit) + late * faster, sense * (c - limit) + late * rate
        near = NEAR * max(1.0, abs(limit))
        part = min(part, part_of_line(-pushed, -pushes, 0.0, near))
        if held and pushed <= near:
            begins, ends = -sense * step * faster, -sense * step * rate
            part = min(part, part_to(-sense * (before - limit), -sense * (c - limit), 0.0, near, begins, ends))
    return part


@kernel
def opens(own: np.ndarray, i: int, c: float, rate: float) -> bool:
    """Whether a latch opens: also where its damping begins, if that alone is too strong."""
    law = floats_2d(own, LAWS)[i]
    if not kept(own, LATCHED, i) > 0.0 or law[OPENS_AT] == np.inf:
        return False
    sense, limit, stiffness, damper, _ = _stop(own, i, 2)
    beyond = sense * (c - limit)
    effort = stiffness * max(beyond, 0.0) + damper * sense * rate
    return bool(beyond > -NEAR * max(1.0, abs(limit)) and effort > (1.0 - STRONG) * law[OPENS_AT])


@kernel
def released(own: np.ndarray, i: int, c: float, rate: float) -> float:
    """Energy of a latch that opens when a step ends at this coordinate and rate, J; it is lost."""
    law = floats_2d(own, LAWS)[i]
    if not opens(own, i, c, rate):
        return 0.0
    return float(0.5 * law[LATCH] * max(law[LATCH_SENSE] * (law[LATCH_AT] - c) - law[PLAY], 0.0) ** 2)


@kernel
def _largest_friction(own: np.ndarray, i: int) -> float:
    """Largest moment or force of friction; its part from the reaction has the multipliers of the last iteration."""
    law, felt, of = floats_2d(own, LAWS)[i], floats_1d(own, FELT), integers_2d(own, FELT_OF)[i]
    size = 0.0
    for k in range(of[0], of[1]):
        size += felt[k] * felt[k]
    return float(law[FRICTION] + law[FOLLOWS] * np.sqrt(size))


@kernel
def _bent(own: np.ndarray, i: int, c: float) -> tuple[float, float]:
    """Deflection of the bristles at a coordinate, and its slope; see `fsm.laws.friction.lugre`."""
    before, reach = kept(own, BRISTLE, i), floats_2d(own, LAWS)[i, PRESLIDING]
    y = (c - kept(own, COORDINATE, i)) / reach
    ahead = before + y
    if not ahead * y > 0.0:
        return ahead, 1.0 / reach
    alpha, slope = step((abs(ahead) - _ELASTIC) / (1.0 - _ELASTIC))
    x, by_y = alpha * abs(y), np.sign(y) * (alpha + slope / (1.0 - _ELASTIC) * abs(y))
    fall = np.exp(-x)
    if x < 1e-3:
        phi, phi_slope = 1.0 - x * (0.5 - x / 6.0), -0.5 + x * (1.0 / 3.0 - x / 8.0)
    else:
        phi = -np.expm1(-x) / x
        phi_slope = (fall - phi) / x
    return fall * before + phi * y, (phi + (phi_slope * y - fall * before) * by_y) / reach


@kernel
def friction(own: np.ndarray, i: int, c: float, rate: float) -> Law:
    """Law of friction."""
    law = floats_2d(own, LAWS)[i]
    if law[FRICTION] == 0.0 and law[FOLLOWS] == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    most, v = _largest_friction(own, i), rate / law[SLIP_RATE]
    if law[PRESLIDING] == 0.0:
        part = np.tanh(v)
        effort = most * part
        return effort, 0.0, most * (1.0 - part * part) / law[SLIP_RATE], 0.0, effort * rate
    s, by_c = _bent(own, i, c)
    alpha, slope = step((abs(s) - _ELASTIC) / (1.0 - _ELASTIC))
    slope /= 1.0 - _ELASTIC
    if not s * v > 0.0:
        alpha = slope = 0.0
    damping = np.exp(-v * v)
    faster = v * (1.0 - alpha * abs(s))  # rate of s
    effort = most * (s + damping * faster)
    by_s = most * (1.0 - damping * v * np.sign(s) * (slope * abs(s) + alpha))
    by_rate = most * damping * ((1.0 - alpha * abs(s)) - 2.0 * v * faster) / law[SLIP_RATE]
    lost = effort * rate - most * s * law[SLIP_RATE] * faster
    return effort, by_s * by_c, by_rate, 0.5 * most * law[PRESLIDING] * s * s, lost


@kernel
def _slid(own: np.ndarray, i: int, c: float, width: float, field: int) -> tuple[float, float]:
    """Slider at a coordinate, and its slope, from its memory; `width` is its way from the mean to either curve."""
    s = kept(own, field, i) + (c - kept(own, COORDINATE, i)) / width
    if abs(s) < 1.0:
        return s, 1.0 / width
    return float(np.sign(s)), 0.0


@kernel
def slider(own: np.ndarray, i: int, c: float, rate: float, column: int, field: int, table: int) -> Law:
    """Law of a slider between two curves, from their mean; its way, its memory, and half of the distance of the curves."""
    width = floats_2d(own, LAWS)[i, column]
    if width == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    half, turn, _ = table_at(own, i, table, c)
    s, by_c = _slid(own, i, c, width, field)
    effort = half * s + 0.5 * turn * width * s * s
    bend = (turn + 0.5 * _bend_of_table(own, i, table, c) * width * s) * s + (half + turn * width * s) * by_c
    lost = half * s * rate if abs(s) == 1.0 and s * rate > 0.0 else 0.0
    return effort, bend, 0.0, 0.5 * half * width * s * s, lost


@kernel
def harness(own: np.ndarray, i: int, c: float, rate: float) -> Law:
    """Law of a harness; its energy is that of the mean curve and of the slider."""
    if floats_2d(own, LAWS)[i, SLIDER] == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    effort, bend, _, stored, lost = slider(own, i, c, rate, SLIDER, HARNESS, OF_WIDTH)
    mean, slope, energy = table_at(own, i, OF_HARNESS, c)
    return mean + effort, slope + bend, 0.0, energy + stored, lost


@kernel
def motor(own: np.ndarray, i: int, t: float, rate: float) -> tuple[float, float]:
    """Moment or force of a motor along the coordinate, and its slope by the rate."""
    law = floats_2d(own, LAWS)[i]
    kind, ratio = int(law[MOTOR]), law[RATIO]
    if kind == NO_MOTOR:
        return 0.0, 0.0
    value = _program(own, i, PUSH, t)[0]
    if kind == TORQUE:
        pushed, slope = ratio * value, 0.0
    else:
        # the curve of the forward sense; with a speed, a governor lets through a part of it
        sense = -1.0 if kind == GOVERNED and value < 0.0 else 1.0
        found, by_speed, _ = table_at(own, i, OF_MOTOR, sense * ratio * rate)
        pushed, slope = sense * ratio * found, ratio * ratio * by_speed
        if kind == GOVERNED:
            part = sense * (value - rate) / law[BAND]
            if part < 1.0:
                part = max(part, -1.0)
                within = part > -1.0
                slope = part * slope - (sense * pushed / law[BAND] if within else 0.0)
                pushed *= part
    if law[WHEEL] > 0.0 and pushed < 0.0:
        return 0.0, 0.0
    return pushed, slope


@kernel
def law_at(
    own: np.ndarray, i: int, t: float, c: float, rate: float, per_second: float
) -> tuple[float, float, float, float, float, float]:
    """All laws of a coordinate, and the power that motors and moving free lengths put in, W.

    If the inverse of a step's duration (1/s) is given, the dissipated power is that without bristles, slider, stops and
    latch; see `lost_in_step` and `mean_loss_of_stops`. If it is negative, stops and latch are `held`, see `stops_after`.
    """
    effort, by_c, by_rate, energy, lost, put_in = _elastic(own, i, t, c, rate)
    of_spring = slider(own, i, c, rate, SPRING_SLIDER, SPRING_SLID, OF_SPRING_WIDTH)
    of_stops = stops_after(own, i, kept(own, COORDINATE, i), c, rate, per_second < 0.0)
    for part in (of_stops, harness(own, i, c, rate), of_spring, friction(own, i, c, rate)):
        effort += part[0]
        by_c += part[1]
        by_rate += part[2]
        energy += part[3]
        lost += part[4]
    if per_second > 0.0:
        law = floats_2d(own, LAWS)[i]
        lost -= harness(own, i, c, rate)[4] + of_spring[4] + of_stops[4]
        if law[PRESLIDING] > 0.0:
            lost -= friction(own, i, c, rate)[4]
    pushed, slope = motor(own, i, t, rate)
    return effort - pushed, by_c, by_rate - slope, energy, lost, put_in + pushed * rate


@kernel
def resting(own: np.ndarray, i: int, c: float) -> tuple[float, float]:
    """Effort (N or N m) and energy (J) of bristles and sliders."""
    law, effort, energy = floats_2d(own, LAWS)[i], 0.0, 0.0
    if law[PRESLIDING] > 0.0:
        most, s = _largest_friction(own, i), _bent(own, i, c)[0]
        effort, energy = most * s, 0.5 * most * law[PRESLIDING] * s * s
    of_harness = slider(own, i, c, 0.0, SLIDER, HARNESS, OF_WIDTH)
    of_spring = slider(own, i, c, 0.0, SPRING_SLIDER, SPRING_SLID, OF_SPRING_WIDTH)
    return effort + of_harness[0] + of_spring[0], energy + of_harness[3] + of_spring[3]


@kernel(inline=True)
def _remembers(law: np.ndarray) -> bool:
    """Whether a coordinate has bristles or sliders."""
    return bool(law[PRESLIDING] > 0.0 or law[SLIDER] > 0.0 or law[SPRING_SLIDER] > 0.0)


@kernel
def _loss(own: np.ndarray, i: int, c: float, rate: float) -> tuple[float, float, float]:
    """Energy that bristles and slider lose from the last accepted state to another one, J; then their effort (N or N m) and
    energy (J).
    """
    effort, energy = resting(own, i, c)
    if floats_2d(own, LAWS)[i, PRESLIDING] > 0.0:
        effort = friction(own, i, c, rate)[0] + (effort - _largest_friction(own, i) * _bent(own, i, c)[0])
    way = c - kept(own, COORDINATE, i)
    return 0.5 * (kept(own, EFFORT, i) + effort) * way - (energy - kept(own, BENT, i)), effort, energy


@kernel
def lost_in_step(own: np.ndarray, i: int, before: float, c: float, rate: float) -> float:
    """Energy that bristles and slider lose in a step between two coordinates, J. In motions its end is already accepted,
    and the energy of a latch that has opened is a part of it.
    """
    if c == kept(own, COORDINATE, i) and before != c:
        return kept(own, LOST, i)
    return _loss(own, i, c, rate)[0] if _remembers(floats_2d(own, LAWS)[i]) else 0.0


@kernel
def remember(own: np.ndarray, i: int, c: float, rate: float, opened: float) -> None:
    """Write coordinate, bristles, sliders and the energy that they lost in the step to the memory, with the energy of a
    latch that has `opened`, J.
    """
    memory, m, law = floats_1d(own, KEPT), integers_1d(own, KINDS).shape[0], floats_2d(own, LAWS)[i]
    memory[LOST * m + i] = 0.0
    if _remembers(law):
        memory[LOST * m + i], memory[EFFORT * m + i], memory[BENT * m + i] = _loss(own, i, c, rate)
        bristle = _bent(own, i, c)[0] if law[PRESLIDING] > 0.0 else 0.0
        memory[BRISTLE * m + i] = bristle
        if law[SLIDER] > 0.0:
            memory[HARNESS * m + i] = _slid(own, i, c, law[SLIDER], HARNESS)[0]
        if law[SPRING_SLIDER] > 0.0:
            memory[SPRING_SLID * m + i] = _slid(own, i, c, law[SPRING_SLIDER], SPRING_SLID)[0]
    if before_stops(own, i, c):
        memory[IMPACT * m + i] = abs(rate)
    memory[LOST * m + i] += opened
    memory[COORDINATE * m + i], memory[RATE * m + i] = c, rate
