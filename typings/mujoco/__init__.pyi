# MuJoCo's names come from a compiled module that ships no types.
from typing import Any

def __getattr__(name: str) -> Any: ...
