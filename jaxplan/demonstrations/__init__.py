"""Demonstrations: the expert as an agent, and what is kept of its episodes."""

from jaxplan.demonstrations.expert import DemonstrationConfig as DemonstrationConfig
from jaxplan.demonstrations.expert import ExpertAgent as ExpertAgent
from jaxplan.demonstrations.recorder import Recorder as Recorder
from jaxplan.demonstrations.relabel import Relabeler as Relabeler
from jaxplan.demonstrations.timed import TimedRecorder as TimedRecorder
