"""Lines that carry the meaning, each written wrong in one way, and the tests that should notice."""

from typing import NamedTuple


class Mutant(NamedTuple):
    """One change of one place."""

    name: str
    file: str
    """In `jaxplan/`."""
    old: str
    """Occurs once in the file."""
    new: str
    tests: str
    """Files in `tests/`, each as a whole or `file::test`, with blanks between them."""


DIFFUSION, LEARNING = "test_diffusion.py", "test_learning.py"
PLANNING, TIMING = "test_planning.py", "test_trajectory.py"
MUTANTS = (
    # Diffusion
    Mutant(
        "DDIM adds the noise that it should take away",
        "diffusion/ddim.py",
        "(x_t - jnp.sqrt(1.0 - abar)",
        "(x_t + jnp.sqrt(1.0 - abar)",
        DIFFUSION,
    ),
    Mutant(
        "DDIM keeps the noise of the step it comes from",
        "diffusion/ddim.py",
        "jnp.sqrt(1.0 - abar_next) * eps, x_t",
        "jnp.sqrt(1.0 - abar) * eps, x_t",
        DIFFUSION,
    ),
    Mutant(
        "DDIM begins at the noisiest step",
        "diffusion/ddim.py",
        "* stride)[::-1]",
        "* stride + stride - 1)[::-1]",
        DIFFUSION,
    ),
    Mutant(
        "the schedule is a cosine and not its square",
        "diffusion/schedule.py",
        "np.pi / 2) ** 2",
        "np.pi / 2)",
        DIFFUSION,
    ),
    Mutant(
        "the network learns the sample and not the noise",
        "diffusion/loss.py",
        "(denoise(x_t, t) - eps) ** 2",
        "(denoise(x_t, t) - x_0) ** 2",
        DIFFUSION,
    ),
    Mutant(
        "a segment's length is read the wrong way round",
        "diffusion/coding.py",
        "jnp.clip(centre + half * s",
        "jnp.clip(centre - half * s",
        DIFFUSION,
    ),
    Mutant(
        "a base lies on the other side of the arm",
        "diffusion/coding.py",
        "return (base - q) / spread",
        "return (q - base) / spread",
        DIFFUSION,
    ),
    # Training
    Mutant(
        "the average forgets itself and keeps the newest weights",
        "learning/train_state.py",
        "decay * e + (1 - decay) * p",
        "decay * p + (1 - decay) * e",
        LEARNING,
    ),
    Mutant(
        "the average has another power",
        "learning/train_state.py",
        "** -config.ema_power",
        "** -1.0",
        LEARNING,
    ),
    Mutant(
        "all steps draw the same noise",
        "learning/train_state.py",
        "key = jax.random.fold_in(key, state.step)",
        "key = jax.random.fold_in(key, 0)",
        LEARNING,
    ),
    Mutant(
        "weights of gripper and subgoal are exchanged",
        "learning/losses.py",
        "[config.w_q, config.w_g, config.w_s, config.w_r]",
        "[config.w_q, config.w_s, config.w_g, config.w_r]",
        LEARNING,
    ),
    Mutant(
        "Huber's two halves do not meet",
        "learning/losses.py",
        "kappa * (size - 0.5 * kappa)",
        "kappa * (size - kappa)",
        LEARNING,
    ),
    Mutant(
        "the limit's hinge begins beyond the limit",
        "learning/losses.py",
        "- (1.0 - delta)",
        "- (1.0 + delta)",
        LEARNING,
    ),
    Mutant(
        "every epoch repeats its first batch",
        "learning/loop.py",
        "order[position * size : (position + 1) * size]",
        "order[:size]",
        LEARNING,
    ),
    Mutant(
        "a run goes on with other settings",
        "learning/run.py",
        "        if changed:",
        "        if False:",
        "test_learning.py test_written.py",
    ),
    Mutant(
        "segments begin behind the end of their path",
        "learning/segments.py",
        "base_arc = paths.arc + jax",
        "base_arc = paths.length + jax",
        LEARNING,
    ),
    Mutant(
        "weights of anybody are taken",
        "learning/checkpoint.py",
        "sha256(file) for file in files",
        "'' for file in files",
        LEARNING,
    ),
    Mutant(
        "damaged demonstrations are read",
        "data/shards.py",
        "if sha256(path) != digest:",
        "if False:",
        "test_data.py",
    ),
    Mutant(
        "toggle and subgoal are exchanged in labels",
        "demonstrations/expert.py",
        "return Subgoal(keyframes.q[-1], keyframes.gripper_toggle, q_goal)",
        "return Subgoal(q_goal, keyframes.gripper_toggle, keyframes.q[-1])",
        "test_demonstrations.py",
    ),
    # Samplers
    Mutant(
        "the temperature does nothing",
        "samplers/segments.py",
        "return config.temperature * normal",
        "return normal",
        "test_samplers.py",
    ),
    Mutant(
        "every bank is the first one",
        "samplers/bank.py",
        "keys = jax.vmap(jax.random.fold_in)(keys, number)",
        "keys = jax.vmap(jax.random.fold_in)(keys, 0 * number)",
        "test_studies.py test_samplers.py",
    ),
    # Search
    Mutant(
        "learned where uniform was drawn",
        "planning/proposal.py",
        "uniform[..., 0] >= config.p_uniform",
        "uniform[..., 0] < config.p_uniform",
        PLANNING,
    ),
    Mutant(
        "the goal bias is what is left of it",
        "planning/proposal.py",
        "uniform[..., 1] < config.goal_bias",
        "uniform[..., 1] > config.goal_bias",
        PLANNING,
    ),
    Mutant(
        "a broken sampler is believed",
        "planning/proposal.py",
        "learned = learned & usable(segment)",
        "learned = learned & True",
        PLANNING,
    ),
    Mutant(
        "a node beside the goal is the goal",
        "planning/rrt.py",
        "solved=~connecting & (gap <= config.goal_tolerance),\n    )\n\n\ndef ends",
        "solved=~connecting & (gap <= config.goal_connect),\n    )\n\n\ndef ends",
        PLANNING,
    ),
    Mutant(
        "the tree does not go on to a segment's end",
        "planning/rrt.py",
        "following = ok & ~close & outcome.follows",
        "following = ok & close & outcome.follows",
        "test_tree_context.py test_planning.py",
    ),
    Mutant(
        "the tree leaves the limits",
        "planning/segment.py",
        "q_new = space.project(q_base +",
        "q_new = (q_base +",
        PLANNING,
    ),
    Mutant(
        "the last edge of a path is not looked at again",
        "planning/soundness.py",
        "(edge < found.path_length[:, None] - 1) & dense",
        "(edge < found.path_length[:, None] - 2) & dense",
        PLANNING,
    ),
    Mutant(
        "a proof is of the middle only",
        "planning/sweep.py",
        "jnp.where(short[:, None], 0.0, half)",
        "jnp.where(short[:, None], 0.0, 0.0 * half)",
        "test_circles.py test_planner.py",
    ),
    Mutant(
        "nodes that do not exist are near",
        "planning/tree.py",
        "(sides[:, None] == side[..., None]) & used",
        "(sides[:, None] == side[..., None])",
        PLANNING,
    ),
    Mutant(
        "where two trees meet the path stands still",
        "planning/tree.py",
        "jnp.maximum(n_onward - 1, 0)",
        "jnp.maximum(n_onward, 0)",
        PLANNING,
    ),
    Mutant(
        "the long way round",
        "planning/space.py",
        "short = gap - rounded(",
        "short = gap + rounded(",
        "test_circles.py",
    ),
    Mutant(
        "ends may lie outside the limits",
        "planning/ends.py",
        "(ends > space.q_max + LIMIT_SLACK)",
        "(ends > space.q_max + 1.0)",
        PLANNING,
    ),
    # Collision
    Mutant(
        "of two margins the smaller counts",
        "collision/margins.py",
        "kept = jnp.maximum(margin, own)",
        "kept = jnp.minimum(margin, own)",
        "test_collision.py",
    ),
    Mutant(
        "what moves comes no closer but goes away",
        "collision/engine.py",
        "required(own, score.margin) + closer",
        "required(own, score.margin) - closer",
        "test_reach.py",
    ),
    Mutant(
        "what is ignored counts",
        "collision/engine.py",
        "return ~world.ignored & (",
        "return (~world.ignored | True) & (",
        "test_collision.py",
    ),
    Mutant(
        "certificates ask C MuJoCo only",
        "collision/certify.py",
        "both = np.minimum(ours, theirs)",
        "both = theirs",
        "test_certify.py",
    ),
    Mutant(
        "certificates take the tolerance for a margin",
        "collision/certify.py",
        "if least >= -tolerance:\n        return Certificate(True",
        "if least >= tolerance:\n        return Certificate(True",
        "test_certify.py",
    ),
    Mutant(
        "certificates look half as closely",
        "collision/course.py",
        "= 2 * self.travel.most(",
        "= self.travel.most(",
        "test_continuous.py",
    ),
    Mutant(
        "certificates go the long way round",
        "collision/course.py",
        "path[:, turns] = np.unwrap(path[:, turns], axis=0)",
        "path[:, turns] = path[:, turns]",
        "test_certify.py",
    ),
    # Motions
    Mutant(
        "speeds are limited by their roots",
        "trajectory/timing.py",
        "_SMALLEST_RATE)) ** 2",
        "_SMALLEST_RATE))",
        TIMING,
    ),
    Mutant(
        "what exceeds the limits within an interval stays",
        "trajectory/timing.py",
        "np.sqrt(x / excess[:, None])",
        "np.sqrt(x)",
        TIMING,
    ),
    Mutant(
        "what is not proven of a curve is forgotten",
        "trajectory/validation.py",
        "left &= motion.max(axis=1) > _SMALLEST",
        "left &= motion.max(axis=1) > 10.0",
        TIMING,
    ),
    Mutant(
        "shortcuts are taken without a check",
        "trajectory/shortcut.py",
        "zip(first, free, strict=True) if ok}",
        "zip(first, free, strict=True)}",
        TIMING,
    ),
    # The outer loop, and what is said of it
    Mutant(
        "a subgoal beside the toggle stays a subgoal",
        "algorithm1.py",
        "(near | late)[:, None]",
        "late[:, None]",
        "test_episodes.py test_evaluation.py",
    ),
    Mutant(
        "all phases of an episode draw the same numbers",
        "episodes.py",
        "jax.random.fold_in(jax.random.key(seed), number)",
        "jax.random.fold_in(jax.random.key(seed), 0 * number)",
        "test_studies.py",
    ),
    Mutant(
        "a mug that lies is placed",
        "tasks/mug/judge.py",
        "mug[2, 2] < np.cos(MAX_TILT)",
        "mug[2, 2] < -np.cos(MAX_TILT)",
        "test_mug.py::test_the_judge_names_what_is_wrong",
    ),
    Mutant(
        "Wilson's interval of 90 %",
        "evaluation/statistics.py",
        "z: float = 1.959964",
        "z: float = 1.644854",
        "test_evaluation.py",
    ),
    Mutant(
        "an interval has one tail",
        "evaluation/statistics.py",
        "[(1 - level) / 2, (1 + level) / 2]",
        "[1 - level, level]",
        "test_studies.py",
    ),
    Mutant(
        "trials that failed count in Table 2",
        "evaluation/expansions.py",
        "good = there & ~failed",
        "good = there",
        "test_studies.py",
    ),
    Mutant(
        "the farthest toggle is the nearest",
        "evaluation/toggle_error.py",
        "float(distances.min())",
        "float(distances.max())",
        "test_evaluation.py",
    ),
)
