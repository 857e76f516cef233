"""Tasks; a second one is a second folder, and a line in the registry."""

from jaxplan.tasks.registry import DEFAULT as DEFAULT
from jaxplan.tasks.registry import TASKS as TASKS
from jaxplan.tasks.registry import TaskEntry as TaskEntry
from jaxplan.tasks.registry import check as check
from jaxplan.tasks.registry import load as load
from jaxplan.tasks.registry import names as names
from jaxplan.tasks.tabletop import ONE as ONE
from jaxplan.tasks.tabletop import Tabletop as Tabletop
