"""The upper network at the paper's size: ResNet-18 with group normalisation. For a GPU.

    python -m jaxplan.train predictor --config configs/predictor_paper.py

About 100,000 steps of 64 images; on two CPU cores it would take three days (26 images/s).
Not yet run to the end. The paper reports no error of its own for this network.
"""

from jaxplan.config import PredictorTraining

predictor = PredictorTraining(name="predictor_paper")
