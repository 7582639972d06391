"""Functions of time of a case as programs of pieces (`fsm.kernels.programs`)."""

from __future__ import annotations

import math

import numpy as np

from fsm.case.models.joint_motor import SlideMotor, TurnMotor
from fsm.case.models.time_program import Constant, Cycle, Ramp, Table, TimeFunction, end_of
from fsm.kernels.interpolation import hermite_cubic, monotone_slopes
from fsm.kernels.programs import CONSTANT, Piece, Program, rest


def time_function(function: TimeFunction | None) -> Program:
    """Program of a function of time; None is the constant 1. Its pieces have the same value on both sides of a break."""
    if function is None or isinstance(function, Constant):
        return CONSTANT
    if isinstance(function, Ramp):
        return _ramp(function)
    return _cycle(function) if isinstance(function, Cycle) else _table(function)


def motor_program(motor: TurnMotor | SlideMotor) -> Program:
    """Coordinate from the start on, of a motor that prescribes it."""
    if motor.way is not None:
        return time_function(motor.time).scaled(motor.way)
    assert motor.speed is not None
    return time_function(motor.time).scaled(motor.speed).integral()


def _ramp(function: Ramp) -> Program:
    start, length = function.start, function.end - function.start
    if function.shape == "unbounded":
        return Program((Piece(-math.inf, True, start, (0.0, 1.0 / length)),))
    linear = function.shape == "linear"
    powers = (0.0, 1.0 / length) if linear else (0.0, 0.0, 3.0 / length**2, -2.0 / length**3)
    return Program((rest(-math.inf, 0.0), Piece(start, linear, start, powers), rest(function.end, 1.0)))


def _cycle(function: Cycle) -> Program:
    start, speed = function.start, 2.0 * math.pi / function.period
    middle, wave = 0.0, (1.0, speed, 0.0)
    if function.form == "pulsating":
        middle, wave = 0.5, (0.5, speed, -0.5 * math.pi)
    moving = Program((rest(-math.inf, 0.0), Piece(start, True, start, (middle,), wave)))
    end = end_of(function)
    return moving if end is None else Program((*moving.pieces, rest(end, moving.at(end)[0], closed=False)))


def _table(function: Table) -> Program:
    time, value = np.asarray(function.time, dtype=float), np.asarray(function.value, dtype=float)
    if function.interpolation == "smooth":  # without overshoot (Fritsch and Carlson, 1980), at rest at both ends
        rates = np.zeros(len(time))
        if len(time) > 2:
            rates[1:-1] = monotone_slopes(time, value)[1:-1]
        powers = hermite_cubic(time, value, rates).coefficients[::-1]
    else:
        powers = np.array([value[:-1], np.diff(value) / np.diff(time)])
    pieces = [Piece(begin, True, begin, tuple(row)) for begin, row in zip(time.tolist(), powers.T.tolist(), strict=False)]
    return Program((rest(-math.inf, float(value[0])), *pieces, rest(float(time[-1]), float(value[-1]))))
