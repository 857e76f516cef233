"""Every network at the paper's size. For a GPU.

    python -m jaxplan.train predictor --config configs/paper.py
    python -m jaxplan.train sampler --config configs/paper.py      (then cvae, gan, few_step)

The predictor: ResNet-18 with group normalisation, 100,000 steps of 64 images. The samplers: U-Net
(64, 128, 256), Ichter's CVAE, or a GAN, each with a ResNet-18 of its own, 50,000 steps of 128
images. On two CPU cores (26 images/s) they would take three days each; none was run to its end.
"""

from typing import Any

from jaxplan.learning import OptimizerConfig, PredictorTraining
from jaxplan.samplers import CvaeTraining, FewStepTraining, GanTraining, SamplerTraining

budget: dict[str, Any] = {"steps": 50_000, "batch_size": 128}

predictor = PredictorTraining(name="predictor_paper")
sampler = SamplerTraining(name="sampler_paper", **budget)
cvae = CvaeTraining(name="cvae_paper", **budget)
gan = GanTraining(
    name="gan_paper", optimizer=OptimizerConfig(betas=(0.5, 0.99)), **budget
)
few_step = FewStepTraining(
    name="few_step_paper", teacher="runs/sampler_paper/weights", **budget
)
