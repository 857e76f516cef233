"""Every network at the paper's size. For a GPU.

    python -m jaxplan.train predictor --config configs/paper.py
    python -m jaxplan.train sampler --config configs/paper.py

The predictor: ResNet-18 with group normalisation, 100,000 steps of 64 images. The sampler: U-Net
(64, 128, 256) and a ResNet-18 of its own, 50,000 steps of 128 images. On two CPU cores (26
images/s) they would take three days each; neither was run to its end.
"""

from jaxplan.config import PredictorTraining, SamplerTraining

predictor = PredictorTraining(name="predictor_paper")
sampler = SamplerTraining(name="sampler_paper", steps=50_000, batch_size=128)
