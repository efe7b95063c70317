"""The volume-bookkeeping sensor: the books of the oil, believing the data sheet."""

from __future__ import annotations

import math

import casadi as ca

from ramsight.plant.ddh import DdhUnit
from ramsight.sensor.books import Factors, Tuning, keep_books
from ramsight.sensor.judgement import AT_RELIEF, COLDEST, HOTTEST, NEAR_RELIEF, STOP_ZONE
from ramsight.sensor.status import Status
from ramsight.sensor.virtual_sensor import SensorGraph, VirtualSensor


def balance(unit: DdhUnit, tuning: Tuning | None = None) -> VirtualSensor:
    """The volume-bookkeeping sensor of a unit.

    Args:
        unit: the unit's parts; it is taken to be its data sheet.
        tuning: how it listens.

    Returns:
        A sensor with position, velocity, load and status; it does not know its standard deviation (NaN).
    """
    graph = SensorGraph()
    books = keep_books(graph, unit, tuning or Tuning(), Factors())
    stroke, setting = books.cylinder.stroke, books.held.side.relief.setting
    position = ca.fmin(ca.fmax(graph.position + books.step, 0.0), stroke)
    velocity = ca.if_else(graph.elapsed > 0.0, books.step / ca.fmax(graph.elapsed, 1e-6), 0.0)
    near = ca.fmax(books.held_pressure, books.other_pressure) > NEAR_RELIEF * setting
    relief_opens = ca.logic_and(books.highest_pressure > AT_RELIEF * setting, books.turning > 0.5)
    away = stroke - books.travel > STOP_ZONE * stroke  # at its stop the piston is where it seems to be
    lost = graph.lost(ca.logic_and(relief_opens, away), graph.referenced)
    extreme = ca.logic_or(graph.oil_temperature < COLDEST, graph.oil_temperature > HOTTEST)
    status = ca.if_else(extreme, float(Status.OUTSIDE_TEMPERATURE), float(Status.OK))
    status = ca.if_else(near, float(Status.NEAR_RELIEF), status)
    status = ca.if_else(lost, float(Status.POSITION_LOST), status)
    return graph.counting("balance", position=position, velocity=velocity, load=books.load, std=math.nan, status=status)
