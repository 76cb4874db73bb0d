"""Writes the ONNX graph of an exported network and checks that ONNX Runtime computes with it what DeepSfT does.

    python write_network.py EXPORT_FOLDER NETWORK.onnx

Prints one line of JSON: the largest difference of each output, and the share of the pixels that differ visibly. Fails
when the two programs do not compute the same function."""

import json
import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime

import network_onnx
import plain_arrays

SMOOTH_TOLERANCE = 2e-3
"""Largest difference of bin and mask logits: sums of some thousand products in another order, relative to values of
the order of 10."""

COORDINATE_TOLERANCE = 1e-3
"""A difference of a coordinate (u, v or normalised log depth) that counts: half a pixel of a sheet that fills the
image."""

MOST_DIFFERENT = 0.005
"""Share of the pixels that may differ by more: where two bins are equally likely, rounding chooses between them."""


def compare(network: plain_arrays.PlainNetwork, answers: plain_arrays.Arrays) -> dict:
    difference = {name: np.abs(answers[name] - network.outputs[name]) for name in network_onnx.ALL_OUTPUTS}
    largest = {name: float(values.max()) for name, values in difference.items()}
    # Not "greater": what is no number differs.
    differing = float((~(difference["pixels"] <= COORDINATE_TOLERANCE)).any(axis=1).mean())
    for name in ("bins.0", "bins.1", "bins.2", "mask"):
        scale = max(1.0, float(np.abs(network.outputs[name]).max()) / 10)
        if not largest[name] <= SMOOTH_TOLERANCE * scale:
            raise SystemExit(f"ONNX Runtime's {name} differ from DeepSfT's by {largest[name]}")
    if not differing <= MOST_DIFFERENT:
        raise SystemExit(f"ONNX Runtime's coordinates differ from DeepSfT's in {differing:.2%} of the pixels")
    median = float(np.median(difference["pixels"]))
    return {"largest_difference": largest, "median_difference": median, "differing_pixel_share": differing}


def main() -> None:
    folder, target = map(Path, sys.argv[1:3])
    network = plain_arrays.load(folder)
    _, _, height, width = network.images.shape
    everything = network_onnx.build(network.config, network.weights, height, width, network_onnx.ALL_OUTPUTS)
    session = onnxruntime.InferenceSession(everything.SerializeToString(), providers=["CPUExecutionProvider"])
    answers = session.run(network_onnx.ALL_OUTPUTS, {"images": network.images})
    comparison = compare(network, dict(zip(network_onnx.ALL_OUTPUTS, answers)))
    maps = network_onnx.build(network.config, network.weights, height, width, network_onnx.MAPS)
    onnx.save(maps, target)
    print(json.dumps({"onnxruntime": onnxruntime.__version__, **comparison}))


if __name__ == "__main__":
    main()
