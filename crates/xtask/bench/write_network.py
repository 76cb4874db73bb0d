"""Writes the ONNX graph of an exported network and checks that ONNX Runtime computes with it what DeepSfT does.

    python write_network.py EXPORT_FOLDER NETWORK.onnx [--main]

With --main the paper's network ends with its main block. Prints one line of JSON: the largest difference of each output, and the share of the pixels that differ visibly. Fails
when the two programs do not compute the same function."""

import json
import sys
from pathlib import Path

import numpy as np
import onnx
import onnxruntime

import network_onnx
import plain_arrays
import residual_onnx

SMOOTH_TOLERANCE = 2e-3
"""Largest difference of bin and mask logits: sums of some thousand products in another order, relative to values of
the order of 10."""

COORDINATE_TOLERANCE = 1e-3
"""A difference of a coordinate (u, v or normalised log depth) that counts: half a pixel of a sheet that fills the
image."""

RELATIVE_TOLERANCE = 1e-4
"""Largest difference of what the paper's network or R50F says, over the largest value."""

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


def maps_of(config: dict, said: plain_arrays.Arrays) -> plain_arrays.Arrays:
    """Depth in mm and (u, v) of what the paper's network or R50F says."""
    if "depth" in said:
        depth, uv = said["depth"], said["registration"]
    else:
        (maps,) = said.values()
        depth, uv = maps[:, :1], maps[:, 1:]
    near, far = config["depth_range"]["near_mm"], config["depth_range"]["far_mm"]
    return {"depth_mm": np.maximum(near + depth * (far - near), near), "uv": uv}


def write_residual(network: plain_arrays.PlainNetwork, target: Path, main_only: bool) -> dict:
    """The graph of the paper's network or R50F; how far its maps are from ours, as fractions of the largest value."""
    outputs = residual_onnx.MAIN_MAPS if main_only else residual_onnx.MAPS[network.config["architecture"]]
    onnx.save(residual_onnx.build(network.config, network.weights, outputs), target)
    session = onnxruntime.InferenceSession(target, providers=["CPUExecutionProvider"])
    maps = maps_of(network.config, dict(zip(outputs, session.run(outputs, {"images": network.images}))))
    largest = {}
    for name, values in maps.items():
        largest[name] = float(np.abs(values - network.outputs[name]).max() / max(1.0, np.abs(values).max()))
        if not largest[name] <= RELATIVE_TOLERANCE:
            raise SystemExit(f"ONNX Runtime's {name} differ from DeepSfT's by {largest[name]} of the largest")
    return {"largest_difference": largest}


def main() -> None:
    folder, target = map(Path, sys.argv[1:3])
    main_only = "--main" in sys.argv[3:]
    network = plain_arrays.load(folder)
    if network.config["architecture"] in residual_onnx.MAPS:
        print(json.dumps({"onnxruntime": onnxruntime.__version__, **write_residual(network, target, main_only)}))
        return
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
