"""Writes the golden network that a test of the crate `deepsft` compares itself with: a small network of random weights,
a random image, and what ONNX Runtime computes from them.

    python -B golden.py FOLDER

writes network.json and arrays.f32. requirements.txt is the environment that wrote those that lie here. The graph is the
one that `cargo xtask bench` compares us with."""

import sys
from pathlib import Path

import numpy as np
import onnxruntime

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "xtask" / "bench"))

import network_onnx
import plain_arrays

SEED = 21

CONFIG = {
    "architecture": "compact",
    "channels": [4, 6, 8, 10],
    "blocks_at_32": 1,
    "bins": [7, 6, 5],
    "refinement_channels": 6,
    "mask_channels": 4,
    "template_size_mm": [297.0, 210.0],
    "focal": 380.0,
    "principal_point": [36.0, 27.0],
    "depth_range": {"near_mm": 150.0, "far_mm": 1200.0},
}

HEIGHT, WIDTH = 48, 80
"""3 x 5 cells of 16 pixels, so that both sides are cropped after up-sampling from stride 32."""

LEAST_MARGIN = 1e-2
"""Between the logits of the two most likely bins everywhere, so that rounding cannot choose another one."""


def layers(config: dict) -> list[tuple[str, int, int, int, float]]:
    """(path, inputs, outputs, kernel, gain) of each convolution. The gains of the layers that predict make their
    values as large as a trained network's."""
    c4, c8, c16, c32 = config["channels"]
    width, mask = config["refinement_channels"], config["mask_channels"]

    def residual(path: str, c: int) -> list:
        return [(f"{path}.first", c, c, 3, 1.0), (f"{path}.second", c, c, 3, 0.25)]

    def refinement(path: str, outputs: int) -> list:
        entry = (f"{path}.entry", c8 + 7, width, 3, 1.0)
        return [entry, (f"{path}.middle", width, width, 3, 1.0), (f"{path}.correction", width, outputs, 1, 0.02)]

    return [
        ("main.patch", 3 * network_onnx.PATCH**2, c4, 1, 1.0),
        ("main.down8", c4, c8, 3, 1.0),
        *residual("main.encode8", c8),
        ("main.down16", c8, c16, 3, 1.0),
        *residual("main.encode16", c16),
        ("main.down32", c16, c32, 3, 1.0),
        *(layer for block in range(config["blocks_at_32"]) for layer in residual(f"main.encode32.{block}", c32)),
        ("main.lateral16", c32, c16, 1, 1.0),
        *residual("main.decode16", c16),
        *((f"main.bins.{k}", c16, bins, 1, 2.0) for k, bins in enumerate(config["bins"])),
        ("main.lateral8", c16, c8, 1, 1.0),
        *residual("main.decode8", c8),
        ("main.offset", c8, 3, 1, 0.02),
        *refinement("depth_refinement", 4),
        *refinement("registration_refinement", 2),
        ("mask_coarse", c8, mask, 1, 1.0),
        ("mask_fine", c4, mask, 1, 1.0),
        ("mask_mix", mask, mask, 3, 0.25),
        ("mask", mask, network_onnx.PATCH**2, 1, 2.0),
    ]


def main() -> None:
    rng = np.random.default_rng(SEED)
    weights = {}
    for path, inputs, outputs, kernel, gain in layers(CONFIG):
        deviation = gain / np.sqrt(inputs * kernel**2)
        weights[f"{path}.weight"] = rng.normal(0, deviation, (outputs, inputs, kernel, kernel)).astype(np.float32)
        weights[f"{path}.bias"] = rng.normal(0, 0.1 * gain, outputs).astype(np.float32)
    images = rng.random((1, 3, HEIGHT, WIDTH), dtype=np.float32)
    model = network_onnx.build(CONFIG, weights, HEIGHT, WIDTH, network_onnx.ALL_OUTPUTS)
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    outputs = dict(zip(network_onnx.ALL_OUTPUTS, session.run(network_onnx.ALL_OUTPUTS, {"images": images})))
    for k in range(3):
        runner_up, best = np.sort(outputs[f"bins.{k}"], axis=1)[:, -2:].transpose(1, 0, 2, 3)
        assert (best - runner_up).min() > LEAST_MARGIN, "two bins are about equally likely: choose another seed"
    assert 0.2 < (outputs["mask"] > 0).mean() < 0.8, "the mask says nothing: choose another seed"
    plain_arrays.save(Path(sys.argv[1]), plain_arrays.PlainNetwork(CONFIG, weights, images, outputs))


if __name__ == "__main__":
    main()
