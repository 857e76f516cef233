"""Imitation policies: agents that act without search; each is a file and a registry line."""

from jaxplan.policies.agent import PolicyAgent as PolicyAgent
from jaxplan.policies.diffusion_policy import (
    DiffusionPolicyTraining as DiffusionPolicyTraining,
)
from jaxplan.policies.drive import Drive as Drive
from jaxplan.policies.drive import Step as Step
from jaxplan.policies.lstm_gmm import LstmGmmTraining as LstmGmmTraining
from jaxplan.policies.policy import Policy as Policy
from jaxplan.policies.registry import POLICIES as POLICIES
from jaxplan.policies.registry import init as init
from jaxplan.policies.registry import policy_of as policy_of
from jaxplan.policies.replay import Replay as Replay
from jaxplan.policies.transformer import TransformerTraining as TransformerTraining
