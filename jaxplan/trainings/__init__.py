"""What can be trained: each kind's settings, and what trains it."""

from jaxplan.trainings.registry import Training as Training
from jaxplan.trainings.registry import trainings as trainings
