"""Every setting, as frozen dataclasses. Defaults are the paper's numbers where it gives them.

Only `PlannerConfig` has defaults of its own; the paper's are in `PAPER_PLANNER`.
A file in `configs/` holds differences from these defaults and nothing else.
"""

import types
import typing
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

from jaxplan.ranges import (
    Checked,
    Count,
    NotNegative,
    Number,
    Positive,
    Probability,
    Share,
    Step,
    StepOrOff,
    Whole,
)


@dataclass(frozen=True)
class PlannerConfig(Checked):
    """RRT and RRT-Connect (Algorithm 1). Switches apply to every sampler alike.

    The defaults are for planning as such; `PAPER_PLANNER` has the paper's numbers.
    """

    method: Literal["rrt", "rrt_connect", "ao_rrt_connect"] = "rrt_connect"
    """`ao_rrt_connect` uses all of `max_expansions` to find ever shorter paths."""
    max_expansions: Count = 50_000
    """N_rrt: proposals whose motion is checked, each connect step included."""
    p_uniform: Probability = 0.2
    """Probability that a proposal is a uniform segment and not a learned one, if there is a
    sampler."""
    tree_context: bool = True
    """A learned segment that says where it begins is taken from the node nearest to its end,
    straight at that end, and followed there. Off: from the node nearest to q_goal, along its
    direction, as in Algorithm 1."""
    greedy: bool = False
    """Samples of a uniform or goal-biased proposal are followed too, and not stepped toward once;
    in RRT-Connect this is RRT-ConCon."""
    uniform_mode: Literal["toward", "independent"] = "toward"
    """`toward`: the uniform move goes from the nearest node toward q_rand (classical RRT).
    `independent`: its direction is drawn apart from q_rand, as the paper's UniformSegment."""
    goal_bias: Probability = 0.05
    """Probability that a uniform proposal goes straight toward q_goal."""
    step_min: Positive = 1.0
    step_max: Positive = 1.0
    """Step length of every sampler, s in `[step_min, step_max]` [rad]."""
    goal_tolerance: NotNegative = 0.05
    """A node reaches q_goal within this distance [rad]."""
    goal_connect: NotNegative = 0.3
    """An accepted node this near to q_goal [rad] tries the straight motion there; 0 = off."""
    goal_tree: Literal["mirrored", "uniform"] = "mirrored"
    """RRT-Connect's second tree: learned segments reversed, or uniform ones only."""
    toggle_tie_break: NotNegative = 0.0
    """Nodes whose distances to the target differ by less than this [rad] count as tied, and the
    one nearer to q_toggle is the base of a learned proposal (section 4.3); 0 = off."""
    balance: bool = True
    """RRT-Connect's smaller tree grows until it has half of the other's nodes; off: in turn."""
    dynamic_domain: NotNegative = 3.0
    """Of a node whose motion was blocked: farther samples than this [rad] do not come to it, see
    `planning.domain`; 0 = off."""
    metric: tuple[Positive, ...] | None = None
    """Diagonal of W in d(q, q') = |W (q - q')|; None = identity."""
    workers: Count = 16
    """K: expansions of a problem in one round, which do not know of each other. 1 is the textbook
    algorithm; more find a way sooner."""
    lanes: Count = 32
    """Problems of a batch that are searched side by side; the others wait for a free lane."""
    check_rows: Count = 256
    """Configurations of one collision call, about. More pays on a GPU; the trees are the same."""
    margin: NotNegative = 0.0
    """Clearance that a configuration needs to count as free [m]; 0 = C MuJoCo's own verdict."""
    edge_resolution: Step = 1 / 32
    """Longest gap between checked configurations of a motion [rad]."""
    path_resolution: StepOrOff = 0.01
    """The same on the path that is found, checked once more as a whole; 0 = off."""


PAPER_PLANNER = PlannerConfig(
    max_expansions=500,
    step_min=0.05,
    step_max=0.2,
    balance=False,
    dynamic_domain=0.0,
    workers=1,
    margin=0.004,  # covers tracking errors
    edge_resolution=0.025,
    path_resolution=0.0,  # what is executed is validated after smoothing
)
"""Section 5.1, and one proposal at a time."""


@dataclass(frozen=True)
class RolloutConfig(Checked):
    """Algorithm 1's outer loop."""

    max_phases: Count = 24
    merge_distance: NotNegative = 0.1
    """A predicted subgoal this near to the toggle [rad] becomes the toggle."""
    toggle_tolerance: NotNegative = 0.1
    """The gripper toggles where every joint is this near to q_toggle [rad]: a mug that already
    stands on the table may stop the hand a little before it."""
    stall_phases: Whole = 4
    """After so many phases without a toggle the subgoal is the toggle itself."""
    max_stuck: Whole = 2
    """Phases in a row without a motion after which an episode has failed."""
    carry_speed: Positive = 0.6
    """Factor on velocities (squared: on accelerations) while the gripper is closed."""
    regrasp: bool = False
    """A gripper that has closed on nothing opens, backs off and looks again."""


@dataclass(frozen=True)
class DemonstrationConfig(Checked):
    """What a demonstration visits and keeps. Noise is a joint's standard deviation [rad]."""

    noisy_episodes: Probability = 0.5
    """Share of episodes whose keyframes are driven to with noise."""
    keyframe_noise: NotNegative = 0.015
    toggle_noise: NotNegative = 0.004
    frame_noise: NotNegative = 0.03
    """Of the arms from which the camera looks beside the phase's start."""
    perturbed_first: Whole = 2
    """Frames from perturbed arms in a phase before the first grasp, where the picture decides."""
    perturbed: Whole = 1
    """The same in later phases."""


@dataclass(frozen=True)
class TrajectoryConfig(Checked):
    """Shortcut, B-spline, time parameterisation and dense validation (section 4.3)."""

    shortcut_rounds: Whole = 8
    shortcut_candidates: Count = 32
    spline_step: Step = 0.1
    """Longest knot spacing of the spline [rad]."""
    check_resolution: Step = 0.01
    """Longest gap between checked configurations where nothing proves what lies between [rad]."""
    check_rows: Count = 1024
    """Configurations of one collision call."""
    velocity_scale: Share = 1.0
    acceleration_scale: Share = 1.0
    """Shares of the joint velocity and acceleration limits that are used."""
    control_period: Step = 0.01
    """Sampling period of the timed trajectory [s]."""


MUG_TRAJECTORY = TrajectoryConfig(velocity_scale=0.6, acceleration_scale=0.4)
"""What the arm does in physics: its controller follows no motion at its very limits."""

PANDA_Q_MIN = (-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973)
PANDA_Q_MAX = (2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973)
"""Joint limits that scale the networks' joints to [-1, 1] [rad]."""


@dataclass(frozen=True)
class EncoderConfig(Checked):
    """Image encoder. The defaults are ResNet-18 with group normalisation (section 4.3)."""

    stem: Literal["conv7", "patch4"] = "conv7"
    """`conv7`: 7x7 stride 2 and max-pool. `patch4`: 4x4 pixels to channels and a 3x3; both
    quarter the resolution."""
    width: Count = 64
    """Channels of the first stage; each later stage doubles them."""
    blocks: tuple[Count, ...] = (2, 2, 2, 2)
    """Residual blocks of each stage."""
    last_strides: tuple[Count, Count] = (2, 2)
    """Strides of the last two stages; 1 keeps spatial cells and with them precision."""
    keypoints: Count = 32
    """Maps of the spatial softmax."""
    features: Count = 64
    average: bool = False
    """Adds a projection of the global average: whether and how big, beside where."""
    scales: Count = 1
    """Stages whose maps are summed before the spatial softmax, at the finest one's resolution."""


@dataclass(frozen=True)
class HandCameraConfig(Checked):
    """How the hand's camera is mounted on a Panda, and what plane its rays are cut with."""

    position: tuple[Number, Number, Number] = (-0.065, 0.0, 0.0)
    """In the hand's frame [m]."""
    tilt: Number = -0.12
    """About the hand's y, from straight ahead [rad]."""
    fovy: Positive = 50.0
    """Vertical field of view [deg]."""
    aspect: Positive = 136 / 88
    plane: Number = 0.04
    """Height above the table: the axis of a mug that lies there [m]."""
    centre: tuple[Number, Number] = (0.47, 0.0)
    """Middle of what is looked at [m]."""
    scale: Positive = 0.15
    """Half of its extent [m]."""


@dataclass(frozen=True)
class PredictorConfig(Checked):
    """The upper network F_psi (section 4.2)."""

    encoder: EncoderConfig = EncoderConfig()
    camera: HandCameraConfig | None = None
    """Adds where on the table the keypoints lie, by way of the joints; None = as in the paper."""
    state_features: Count = 64
    hidden: Count = 256
    dropout: Probability = 0.1
    q_min: tuple[Number, ...] = PANDA_Q_MIN
    q_max: tuple[Number, ...] = PANDA_Q_MAX


@dataclass(frozen=True)
class SegmentConfig(Checked):
    """What all learned samplers have in common: what they see, and what a segment is."""

    encoder: EncoderConfig | None = EncoderConfig()
    """None: the condition holds the predictor's image features, frozen."""
    cond_features: Count = 256
    relative: bool = False
    """Adds q_toggle - q_curr and q_goal - q_curr [rad] to the condition's input."""
    tree_context: bool = False
    """A segment comes with the configuration at which it is meant to begin."""
    temperature: NotNegative = 1.0
    """Factor on the noise that segments are drawn from; training does not look at it. Below 1
    they keep to what is typical: more precise, less diverse."""
    step_min: Positive = 0.05
    step_max: Positive = 0.2
    """s in [step_min, step_max] [rad]."""
    q_min: tuple[Number, ...] = PANDA_Q_MIN
    q_max: tuple[Number, ...] = PANDA_Q_MAX

    @property
    def size(self) -> int:
        """Length of x_0: direction and step length, and with `tree_context` the base."""
        joints = len(self.q_min)
        return joints + 1 + self.tree_context * joints


@dataclass(frozen=True)
class SamplerConfig(SegmentConfig):
    """The diffusion sampler D_theta (section 4.3)."""

    denoiser: Literal["unet1d", "film_mlp"] = "unet1d"
    hidden: tuple[Count, ...] = (64, 128, 256)
    """U-Net: channels of each level. FiLM-MLP: width of each block."""
    step_features: Count = 128
    num_train_timesteps: Count = 100
    num_inference_steps: Count = 25


@dataclass(frozen=True)
class FewStepConfig(SamplerConfig):
    """The diffusion sampler's noise-to-segment map in 1 to 4 steps, learned from it."""

    num_inference_steps: Count = 1
    noisiest: Whole = 96
    """Noise step from which x_T starts, as the teacher's: DDIM-25 begins there."""


@dataclass(frozen=True)
class CvaeConfig(SegmentConfig):
    """The conditional VAE of Ichter, Harrison and Pavone, over segments."""

    latent: Count = 3
    hidden: tuple[Count, ...] = (512, 512)
    """Of the recognition network and of the decoder."""


@dataclass(frozen=True)
class GanConfig(SegmentConfig):
    """Conditional GAN over segments. The paper gives no architecture."""

    latent: Count = 16
    generator: tuple[Count, ...] = (512, 512, 512)
    discriminator: tuple[Count, ...] = (512, 512)


@dataclass(frozen=True)
class LossConfig(Checked):
    """Weights of equations 1 to 3, with the numbers of section 5.1."""

    w_q: NotNegative = 2.0
    w_g: NotNegative = 1.0
    w_s: NotNegative = 1.0
    w_r: NotNegative = 1e-4
    huber_kappa: Positive = 2.0
    lambda_lim: NotNegative = 1.0
    lambda_prox: NotNegative = 0.5
    delta: NotNegative = 0.02
    """Margin of the limit hinge, in joints scaled to [-1, 1]."""


@dataclass(frozen=True)
class OptimizerConfig(Checked):
    """AdamW with warm-up and cosine decay to zero; EMA as in Diffusion Policy."""

    learning_rate: NotNegative = 1e-4
    warmup_steps: Whole = 500
    betas: tuple[Probability, Probability] = (0.95, 0.999)
    weight_decay: NotNegative = 1e-6
    gradient_clip: Positive = 1.0
    """Largest global norm of the gradient."""
    ema_power: Positive = 0.75
    ema_max: Probability = 0.9999


@dataclass(frozen=True)
class AugmentConfig(Checked):
    """Photometric augmentation, and no other.

    With a camera on the hand, shifting the image would move the mug and leave the label
    behind.
    """

    brightness: NotNegative = 0.08
    """Largest shift, as a share of the range."""
    contrast: NotNegative = 0.15
    """Largest relative change."""
    noise: NotNegative = 0.01
    """Standard deviation of pixel noise, as a share of the range."""


@dataclass(frozen=True, kw_only=True)
class TrainConfig(Checked):
    """What all trainings have in common."""

    name: str
    """The run's directory under `runs/`."""
    data: tuple[str, ...] = ("data/mug",)
    """Directories of demonstrations."""
    out: str | None = None
    """Where the weights are exported when training ends; None = in the run's directory."""
    init: str | None = None
    """Directory of weights to start from, as after new demonstrations; None = fresh ones."""
    seed: Whole = 0
    steps: Whole = 100_000
    batch_size: Count = 64
    optimizer: OptimizerConfig = OptimizerConfig()
    val_fraction: Probability = 0.05
    """Share of the episodes (by seed) that is held out."""
    log_every: Count = 50
    validate_every: Count = 1000
    checkpoint_every: Count = 1000


@dataclass(frozen=True, kw_only=True)
class PredictorTraining(TrainConfig):
    """`python -m jaxplan.train predictor`."""

    name: str = "predictor"
    network: PredictorConfig = PredictorConfig()
    loss: LossConfig = LossConfig()
    augment: AugmentConfig = AugmentConfig()


@dataclass(frozen=True, kw_only=True)
class SegmentTraining(TrainConfig):
    """What the trainings of all learned samplers have in common."""

    network: SegmentConfig
    predictor: str = "jaxplan/pretrained"
    """Directory with the predictor's weights; read where the sampler has no encoder."""
    target_noise: NotNegative = 0.02
    """Standard deviation of the noise on q_toggle and q_goal in the condition [rad], so that
    the sampler does not overtrust targets that a predictor will estimate."""
    val_problems: Count = 64
    val_segments: Count = 32
    """Validation draws `val_segments` segments for each of `val_problems` conditions."""


@dataclass(frozen=True, kw_only=True)
class SamplerTraining(SegmentTraining):
    """`python -m jaxplan.train sampler`."""

    name: str = "sampler"
    network: SamplerConfig = SamplerConfig()


@dataclass(frozen=True, kw_only=True)
class FewStepTraining(SegmentTraining):
    """`python -m jaxplan.train few_step`."""

    name: str = "few_step"
    network: FewStepConfig = FewStepConfig()
    teacher: str = "jaxplan/pretrained"
    """Directory with the diffusion sampler's weights."""
    learned_steps: tuple[Whole, ...] = (96, 72, 48, 24)
    """Noise steps of the teacher's DDIM run from which its end is learned."""


@dataclass(frozen=True, kw_only=True)
class CvaeTraining(SegmentTraining):
    """`python -m jaxplan.train cvae`."""

    name: str = "cvae"
    network: CvaeConfig = CvaeConfig()
    kl_weight: NotNegative = 4e-4
    """Of the KL divergence (summed over the latent's coordinates) beside the mean squared
    error of a coordinate; Ichter's number."""


@dataclass(frozen=True, kw_only=True)
class GanTraining(SegmentTraining):
    """`python -m jaxplan.train gan`."""

    name: str = "gan"
    network: GanConfig = GanConfig()
    r1: NotNegative = 0.1
    """Gamma of the penalty gamma / 2 |grad D|^2 on true segments."""
    instance_noise: NotNegative = 0.02
    """Standard deviation of the noise on what the discriminator sees."""


def from_dict(kind: type, values: Any) -> Any:
    """Rebuilds a config of class `kind` from `dataclasses.asdict`, also by way of JSON.

    Raises:
        ValueError: A key that `kind` does not have.
    """
    if isinstance(kind, types.UnionType):
        kinds = [k for k in typing.get_args(kind) if k is not type(None)]
        return None if values is None else from_dict(kinds[0], values)
    if is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        known = {field.name for field in fields(kind)}
        if unknown := sorted(set(values) - known):
            raise ValueError(f"{kind.__name__} has no {', '.join(unknown)}")
        return kind(**{name: from_dict(hints[name], v) for name, v in values.items()})
    return tuple(values) if isinstance(values, list) else values
