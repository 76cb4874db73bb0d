"""Writes the golden maps that a test of the crate `deepsft` compares the paper's network and R50F with.

An independent program: the layers are written down here a second time, from the tables of the paper and of Keras'
ResNet-50, in plain numpy and double precision, batch normalisation unfolded, decoding blocks up-sampled before their
convolutions. Weights and image are the same formula of names and indices in both programs, so that no file holds them.
The networks have 1/16 of the paper's widths.

    python -B golden_resnet.py FOLDER

writes paper.json and r50f.json. Of what requirements.txt locks it needs numpy only."""

import json
import sys
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

DIVISOR = 16
HEIGHT, WIDTH = 270, 480
EPSILON = 1e-3
ROW_STEP, COLUMN_STEP = 15, 20
"""Of the maps every so manieth row and column is written, and the mean and the deviation of all pixels."""

Array = np.ndarray


def uniform(name: str, count: int) -> Array:
    """Numbers of 0..1 that depend on `name` and their index alone: FNV-1a of the name, SplitMix64 of the sum."""
    seed = 0xCBF29CE484222325
    for byte in name.encode():
        seed = ((seed ^ byte) * 0x100000001B3) & 0xFFFFFFFFFFFFFFFF
    with np.errstate(over="ignore"):
        z = (np.arange(count, dtype=np.uint64) + np.uint64(seed)) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z ^= z >> np.uint64(31)
    return (z >> np.uint64(11)).astype(np.float64) / 2.0**53


def values(name: str, shape: tuple, low: float, high: float) -> Array:
    drawn = low + (high - low) * uniform(name, int(np.prod(shape)))
    return drawn.astype(np.float32).astype(np.float64).reshape(shape)


def weights(name: str, shape: tuple, fan_in: int) -> Array:
    limit = np.sqrt(3.0 / fan_in)
    return values(f"{name}.weight", shape, -limit, limit)


def convolution(name: str, x: Array, outputs: int, kernel: int, stride: int = 1) -> Array:
    inputs = x.shape[0]
    w = weights(name, (outputs, inputs, kernel, kernel), inputs * kernel**2)
    b = values(f"{name}.bias", (outputs,), -0.1, 0.1)
    pad = kernel // 2
    padded = np.pad(x, ((0, 0), (pad, pad), (pad, pad)))
    windows = sliding_window_view(padded, (kernel, kernel), axis=(1, 2))[:, ::stride, ::stride]
    return np.tensordot(w, windows, axes=([1, 2, 3], [0, 3, 4])) + b[:, None, None]


def normalised(name: str, x: Array, outputs: int, kernel: int, stride: int = 1) -> Array:
    x = convolution(name, x, outputs, kernel, stride)
    column = lambda part, low, high: values(f"{name}.normalisation.{part}", (outputs,), low, high)[:, None, None]
    gamma, beta = column("gamma", 0.5, 1.5), column("beta", -0.1, 0.1)
    mean, variance = column("running_mean", -0.1, 0.1), column("running_var", 0.5, 1.5)
    return gamma * (x - mean) / np.sqrt(variance + EPSILON) + beta


def relu(x: Array) -> Array:
    return np.maximum(x, 0)


def nearest(x: Array, factor: int) -> Array:
    return x.repeat(factor, axis=1).repeat(factor, axis=2)


def max_pool(x: Array, stride: int, pad: int) -> Array:
    padded = np.pad(x, ((0, 0), (pad, pad), (pad, pad)), constant_values=-np.inf)
    return sliding_window_view(padded, (3, 3), axis=(1, 2))[:, ::stride, ::stride].max(axis=(3, 4))


def block(name: str, x: Array, widths: tuple, stride: int, shortcut: bool) -> Array:
    y = relu(normalised(f"{name}.reduce", x, widths[0], 1, stride))
    y = relu(normalised(f"{name}.spatial", y, widths[1], 3))
    y = normalised(f"{name}.expand", y, widths[2], 1)
    kept = normalised(f"{name}.shortcut", x, widths[2], 1, stride) if shortcut else x
    return relu(y + kept)


def stack(name: str, x: Array, widths: tuple, identities: int, stride: int = 1, up: int = 1, rows: slice = slice(None)) -> Array:
    widths = tuple(width // DIVISOR for width in widths)
    x = block(f"{name}.first", nearest(x, up), widths, stride, True)[:, rows]
    for k in range(identities):
        x = block(f"{name}.identities.{k}", x, widths, 1, False)
    return x


def main_block(name: str, x: Array) -> Array:
    x = max_pool(relu(normalised(f"{name}.entry", x, 64 // DIVISOR, 7, 2)), 3, 0)
    x = stack(f"{name}.encode2", x, (64, 64, 256), 2)
    x = stack(f"{name}.encode3", x, (128, 128, 512), 3, stride=2)
    x = stack(f"{name}.encode4", x, (256, 256, 1024), 5, stride=2)
    x = stack(f"{name}.decode5", x, (1024, 1024, 256), 5)
    x = stack(f"{name}.decode6", x, (512, 512, 128), 3, up=2, rows=slice(0, 23))
    x = stack(f"{name}.decode7", x, (256, 256, 64), 2, up=2)
    x = nearest(x, 3)[:, 1:-1]
    x = relu(normalised(f"{name}.smooth", x, 64 // DIVISOR, 7))
    return convolution(f"{name}.output", nearest(x, 2)[:, 1:-1], 3, 3)


def refinement_block(name: str, x: Array, outputs: int) -> Array:
    x = max_pool(relu(normalised(f"{name}.entry", x, 64 // DIVISOR, 7, 2)), 3, 0)
    x = stack(f"{name}.encode2", x, (64, 64, 256), 2)
    x = stack(f"{name}.encode3", x, (128, 128, 512), 3, stride=2)
    x = stack(f"{name}.decode6", x, (512, 512, 128), 3, up=2)
    x = stack(f"{name}.decode7", x, (256, 256, 64), 2, up=2, rows=slice(1, 91))
    return convolution(f"{name}.output", nearest(x, 3), outputs, 3)


def paper(image: Array) -> dict[str, Array]:
    image = 2 * image - 1
    main = main_block("main", image)
    seen = np.concatenate([image, main])
    return {
        "main_depth": main[:1],
        "main_registration": main[1:],
        "depth": refinement_block("depth_refinement", seen, 1),
        "registration": main[1:] + refinement_block("registration_refinement", seen, 2),
    }


def dense(name: str, x: Array, outputs: int) -> Array:
    w = weights(name, (x.size, outputs), x.size)
    return x @ w + values(f"{name}.bias", (outputs,), -0.1, 0.1)


def r50f(image: Array) -> dict[str, Array]:
    x = max_pool(relu(normalised("entry", 2 * image - 1, 64 // DIVISOR, 7, 2)), 2, 1)
    x = stack("encode2", x, (64, 64, 256), 2)
    x = stack("encode3", x, (128, 128, 512), 3, stride=2)
    x = stack("encode4", x, (256, 256, 1024), 5, stride=2)
    x = stack("encode5", x, (512, 512, 2048), 2, stride=2)
    x = relu(dense("neurons", x.ravel(), 200 // DIVISOR))
    maps = dense("maps", x, 3 * HEIGHT * WIDTH).reshape(3, HEIGHT, WIDTH)
    return {"depth": maps[:1], "registration": maps[1:]}


def main() -> None:
    folder = Path(sys.argv[1])
    image = values("image", (3, HEIGHT, WIDTH), 0, 1)
    for name, network in (("paper", paper), ("r50f", r50f)):
        maps = network(image)
        sampled = {}
        for key, full in maps.items():
            assert full.shape[1:] == (HEIGHT, WIDTH) and 0.01 < full.std() < 100, f"{key} says nothing"
            few = full[:, ROW_STEP // 2 :: ROW_STEP, COLUMN_STEP // 2 :: COLUMN_STEP]
            sampled[key] = {
                "mean": float(full.mean()),
                "deviation": float(full.std()),
                "values": [float(f"{value:.7g}") for value in few.ravel()],
            }
        text = {"width_divisor": DIVISOR, "row_step": ROW_STEP, "column_step": COLUMN_STEP, "maps": sampled}
        (folder / f"{name}.json").write_text(json.dumps(text) + "\n")
        print(name, {key: (round(m.mean(), 3), round(m.std(), 3)) for key, m in maps.items()})


if __name__ == "__main__":
    main()
