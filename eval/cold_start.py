"""What a fresh process waits for: `python eval/cold_start.py DATA` prints it as JSON.

Seconds of the first checks and of the first plan, compilation included, of the same again,
and how many programs were compiled when the obstacles then moved.
"""

import json
import sys
import time
from collections.abc import Callable
from itertools import islice
from typing import Any

import jax
import numpy as np
from parts.queries import planner_for

from jaxplan.evaluation.motion_bench import read_problems, read_robot

SET = "table_pick"


def main(data: str) -> None:
    """Asks everything once, then with moved obstacles, and prints."""
    compiled: list[str] = []

    def listen(event: str, duration_secs: float, **_: str | int) -> None:
        if event.endswith(("jaxpr_trace_duration", "backend_compile_duration")):
            compiled.append(event)

    jax.monitoring.register_event_duration_secs_listener(listen)
    problems = read_problems(data)[SET]
    planner, worlds = planner_for(read_robot(data), problems)
    problem = problems[0]
    q = np.linspace(problem.q_start, problem.q_goal, 4096)

    def check(world: Any) -> None:
        planner.clearance(q, world)

    def plan(world: Any) -> None:
        planner.plan(problem.q_start, problem.q_goal, 0, world)

    found = {
        "checker": _seconds(check, worlds[0]),
        "planner": _seconds(plan, worlds[0]),
    }
    compiled.clear()
    found["checker again"] = _seconds(check, worlds[0])
    found["planner again"] = _seconds(plan, worlds[0])
    for world in islice(worlds, 1, 20):
        check(world)
        plan(world)
    print(json.dumps(found | {"recompilations": len(compiled)}))


def _seconds(call: Callable, argument: Any) -> float:
    start = time.perf_counter()
    call(argument)
    return time.perf_counter() - start


if __name__ == "__main__":
    main(sys.argv[1])
