"""Robots' cells: problems that people have, drawn or given, and paths recorded of them."""

from jaxplan.cells.description import Cell as Cell
from jaxplan.cells.description import slots_needed as slots_needed
from jaxplan.cells.problem import Problem as Problem
from jaxplan.cells.problem import furnished as furnished
from jaxplan.cells.problem import read_json as read_json
from jaxplan.cells.problem import read_problem as read_problem
from jaxplan.cells.problem import slots_of as slots_of
from jaxplan.cells.recorder import CellRecorder as CellRecorder
from jaxplan.cells.recorder import RecordConfig as RecordConfig
from jaxplan.cells.recorder import record as record
