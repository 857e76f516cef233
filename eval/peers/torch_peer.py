"""The diffusion sampler in PyTorch, as it is usually run: one proposal at a time.

The network has the layers of `jaxplan.networks` (Diffusion Policy's ConditionalUnet1D or the
FiLM-MLP, and the noise step's encoding) and random weights. The condition's vector is given:
its image is encoded once a phase, whoever samples. Needs the package `torch`.
"""

import numpy as np
import torch  # pyright: ignore[reportMissingImports]
from torch import nn  # pyright: ignore[reportMissingImports]
from torch.nn.functional import mish  # pyright: ignore[reportMissingImports]

from jaxplan import diffusion
from jaxplan.networks import SamplerConfig


class FilmBlock(nn.Module):
    """Convolution, FiLM, convolution, shortcut."""

    def __init__(self, inputs: int, channels: int, kernel: int, cond: int) -> None:
        super().__init__()
        self.first = conv_block(inputs, channels, kernel)
        self.film = nn.Sequential(nn.Mish(), nn.Linear(cond, 2 * channels))
        self.second = conv_block(channels, channels, kernel)
        same = inputs == channels
        self.shortcut = nn.Identity() if same else nn.Conv1d(inputs, channels, 1)

    def forward(self, h: torch.Tensor, cond: torch.Tensor) -> torch.Tensor:
        """`h` [B, inputs, L] to [B, channels, L], `cond` [B, cond]."""
        scale, shift = self.film(cond)[..., None].chunk(2, dim=1)
        return self.second(scale * self.first(h) + shift) + self.shortcut(h)


class Level(nn.Module):
    """Two blocks, the first of which changes the number of channels."""

    def __init__(self, inputs: int, channels: int, kernel: int, cond: int) -> None:
        super().__init__()
        self.first = FilmBlock(inputs, channels, kernel, cond)
        self.second = FilmBlock(channels, channels, kernel, cond)

    def forward(self, h: torch.Tensor, cond: torch.Tensor) -> torch.Tensor:
        """As a block."""
        return self.second(self.first(h, cond), cond)


class UNet(nn.Module):
    """Diffusion Policy's ConditionalUnet1D over the 8 numbers of a segment."""

    def __init__(self, hidden: tuple[int, ...], cond: int, kernel: int = 3) -> None:
        super().__init__()
        self.down = nn.ModuleList(
            Level(above, width, kernel, cond)
            for above, width in zip((1, *hidden), hidden, strict=False)
        )
        self.downsample = nn.ModuleList(
            nn.Conv1d(width, width, 3, stride=2, padding=1) for width in hidden[:-1]
        )
        self.middle = Level(hidden[-1], hidden[-1], kernel, cond)
        self.up = nn.ModuleList(
            Level(2 * below, width, kernel, cond)
            for below, width in zip(hidden[:0:-1], hidden[-2::-1], strict=True)
        )
        self.upsample = nn.ModuleList(
            nn.ConvTranspose1d(width, width, 4, stride=2, padding=1)
            for width in hidden[-2::-1]
        )
        self.end = nn.Sequential(
            conv_block(hidden[0], hidden[0], kernel), nn.Conv1d(hidden[0], 1, 1)
        )

    def forward(self, x_t: torch.Tensor, cond: torch.Tensor) -> torch.Tensor:
        """eps [B, 8] for x_t [B, 8] and conditions with their noise steps [B, C]."""
        h, skips = x_t[:, None], []
        for index, level in enumerate(self.down):
            h = level(h, cond)
            skips.append(h)
            if index < len(self.downsample):
                h = self.downsample[index](h)
        h = self.middle(h, cond)
        for level, upsample in zip(self.up, self.upsample, strict=True):
            h = upsample(level(torch.cat([h, skips.pop()], dim=1), cond))
        return self.end(h)[:, 0]


class FilmMlp(nn.Module):
    """Residual blocks of one width, each modulated by (1 + scale) and a shift."""

    def __init__(self, hidden: tuple[int, ...], cond: int, outputs: int) -> None:
        super().__init__()
        width, blocks = hidden[0], range(len(hidden))
        self.begin = nn.Linear(outputs, width)
        self.norm = nn.ModuleList(nn.LayerNorm(width, 1e-6) for _ in blocks)
        self.first = nn.ModuleList(nn.Linear(width, width) for _ in blocks)
        self.film = nn.ModuleList(nn.Linear(cond, 2 * width) for _ in blocks)
        self.second = nn.ModuleList(nn.Linear(width, width) for _ in blocks)
        self.end = nn.Sequential(
            nn.LayerNorm(width, 1e-6), nn.Mish(), nn.Linear(width, outputs)
        )

    def forward(self, x_t: torch.Tensor, cond: torch.Tensor) -> torch.Tensor:
        """As `UNet.forward`."""
        h, cond = self.begin(x_t), mish(cond)
        blocks = zip(self.norm, self.first, self.film, self.second, strict=True)
        for norm, first, film, second in blocks:
            scale, shift = film(cond).chunk(2, dim=1)
            h = h + second(mish((1 + scale) * first(norm(h)) + shift))
        return self.end(h)


class TorchSampler(nn.Module):
    """eps_theta(x_t, t, cond), and segments from it."""

    rates: torch.Tensor

    def __init__(self, config: SamplerConfig) -> None:
        super().__init__()
        self.config = config
        features, outputs = config.step_features, config.size
        cond = features + config.cond_features
        self.step = nn.Sequential(
            nn.Linear(features, 4 * features),
            nn.Mish(),
            nn.Linear(4 * features, features),
        )
        if config.denoiser == "unet1d":
            self.denoiser = UNet(config.hidden, cond)
        else:
            self.denoiser = FilmMlp(config.hidden, cond, outputs)
        half = features // 2
        rates = torch.exp(-np.log(10000.0) * torch.arange(half) / (half - 1))
        self.register_buffer("rates", rates)

    def forward(
        self, x_t: torch.Tensor, t: torch.Tensor, cond: torch.Tensor
    ) -> torch.Tensor:
        """eps for x_t [B, size], t [B] and conditions [B, C]."""
        angles = t[:, None] * self.rates
        step = self.step(torch.cat([angles.sin(), angles.cos()], dim=-1))
        return self.denoiser(x_t, torch.cat([step, cond], dim=-1))

    @torch.inference_mode()
    def draw(self, cond: torch.Tensor) -> np.ndarray:
        """`[B, size]` x_0 of segments by DDIM, for conditions [B, C]."""
        config = self.config
        joints = len(config.q_min)
        steps = diffusion.timesteps(
            config.num_train_timesteps, config.num_inference_steps
        )
        abars = diffusion.alphas_cumprod(config.num_train_timesteps)[steps].tolist()
        clip = diffusion.bounds(joints, config.tree_context)
        clip = torch.tensor(np.asarray(clip))
        x_t = torch.randn(len(cond), config.size)
        for t, abar, abar_next in zip(steps, abars, [*abars[1:], 1.0], strict=True):
            eps = self(x_t, torch.full((len(cond),), float(t)), cond)
            x_0 = (x_t - (1 - abar) ** 0.5 * eps) / abar**0.5
            x_0 = torch.clip(x_0, -clip, clip)
            x_t = abar_next**0.5 * x_0 + (1 - abar_next) ** 0.5 * eps
        return x_t.numpy()


def conv_block(inputs: int, channels: int, kernel: int) -> nn.Sequential:
    """Convolution, group normalisation with 8 groups, Mish."""
    conv = nn.Conv1d(inputs, channels, kernel, padding=kernel // 2)
    return nn.Sequential(conv, nn.GroupNorm(8, channels), nn.Mish())
