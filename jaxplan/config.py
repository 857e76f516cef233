"""Every setting, as frozen dataclasses. Defaults are the paper's numbers where it gives them.

A file in `configs/` holds differences from these defaults and nothing else.
"""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class PlannerConfig:
    """RRT and RRT-Connect (Algorithm 1). Switches apply to every sampler alike."""

    method: Literal["rrt", "rrt_connect"] = "rrt_connect"
    max_expansions: int = 500
    """N_rrt: proposals whose motion is checked, each connect step included."""
    p_uniform: float = 0.2
    """Probability that a proposal is a uniform segment and not a learned one."""
    uniform_mode: Literal["toward", "independent"] = "toward"
    """`toward`: the uniform move goes from the nearest node toward q_rand (classical RRT).
    `independent`: its direction is drawn apart from q_rand, as the paper's UniformSegment."""
    goal_bias: float = 0.05
    """Probability that a uniform proposal goes straight toward q_goal."""
    step_min: float = 0.05
    step_max: float = 0.2
    """Step length of every sampler, s in [step_min, step_max] [rad]."""
    goal_tolerance: float = 0.05
    """A node reaches q_goal within this distance [rad]."""
    goal_connect: float = 0.3
    """An accepted node nearer to q_goal than this tries the straight motion there [rad]; 0 = off."""
    toggle_tie_break: float = 0.0
    """Nodes whose distances to the target differ by less than this [rad] count as tied, and the
    one nearer to q_toggle is the base of a learned proposal (section 4.3); 0 = off."""
    metric: tuple[float, ...] | None = None
    """Diagonal of W in d(q, q') = |W (q - q')|; None = identity."""
    proposals: int = 16
    """Proposals checked in one call. Any value gives the tree that 1 gives."""
    edge_resolution: float = 0.025
    """Longest gap between checked configurations of a motion [rad]."""


@dataclass(frozen=True)
class TrajectoryConfig:
    """Shortcut, B-spline, time parameterisation and dense validation (section 4.3)."""

    shortcut_rounds: int = 8
    shortcut_candidates: int = 32
    spline_step: float = 0.1
    """Longest knot spacing of the spline [rad]."""
    check_resolution: float = 0.02
    """Gap of the dense validation [rad]."""
    check_rows: int = 1024
    """Configurations of one collision call."""
    velocity_scale: float = 0.6
    acceleration_scale: float = 0.4
    """Shares of the joint velocity and acceleration limits that are used."""
    control_period: float = 0.01
    """Sampling period of the timed trajectory [s]."""


PANDA_Q_MIN = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
PANDA_Q_MAX = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)
"""Joint limits that scale the networks' joints to [-1, 1] [rad]."""


@dataclass(frozen=True)
class EncoderConfig:
    """Image encoder. The defaults are ResNet-18 with group normalisation (section 4.3)."""

    stem: Literal["conv7", "patch4"] = "conv7"
    """`conv7`: 7x7 stride 2 and max-pool. `patch4`: 4x4 pixels to channels and a 3x3; both
    quarter the resolution."""
    width: int = 64
    """Channels of the first stage; each later stage doubles them."""
    blocks: tuple[int, ...] = (2, 2, 2, 2)
    """Residual blocks of each stage."""
    last_strides: tuple[int, int] = (2, 2)
    """Strides of the last two stages; 1 keeps spatial cells and with them precision."""
    keypoints: int = 32
    """Maps of the spatial softmax."""
    features: int = 64
    average: bool = False
    """Adds a projection of the global average: whether and how big, beside where."""


@dataclass(frozen=True)
class PredictorConfig:
    """The upper network F_psi (section 4.2)."""

    encoder: EncoderConfig = EncoderConfig()
    state_features: int = 64
    hidden: int = 256
    dropout: float = 0.1
    q_min: tuple[float, ...] = PANDA_Q_MIN
    q_max: tuple[float, ...] = PANDA_Q_MAX


@dataclass(frozen=True)
class SamplerConfig:
    """The diffusion sampler D_theta (section 4.3)."""

    denoiser: Literal["unet1d", "film_mlp"] = "unet1d"
    hidden: tuple[int, ...] = (64, 128, 256)
    """U-Net: channels of each level. FiLM-MLP: width of each block."""
    encoder: EncoderConfig | None = EncoderConfig()
    """None: the condition holds the predictor's image features, frozen."""
    cond_features: int = 256
    step_features: int = 128
    relative: bool = False
    """Adds q_toggle - q_curr and q_goal - q_curr [rad] to the condition's input."""
    num_train_timesteps: int = 100
    num_inference_steps: int = 25
    step_min: float = 0.05
    step_max: float = 0.2
    """s in [step_min, step_max] [rad]."""
    q_min: tuple[float, ...] = PANDA_Q_MIN
    q_max: tuple[float, ...] = PANDA_Q_MAX
