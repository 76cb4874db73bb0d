"""Networks as plain arrays, the way `deepsft-lab bench --export DIR` writes them: `network.json` names the arrays and
says where each lies in `arrays.f32`, a row of little-endian 32-bit floats."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

DESCRIPTION = "network.json"
VALUES = "arrays.f32"

Arrays = dict[str, np.ndarray]


@dataclass
class PlainNetwork:
    """A network's shape and weights, images [N, 3, H, W] and what it says of them."""

    config: dict
    weights: Arrays
    images: np.ndarray
    outputs: Arrays


def load(folder: Path) -> PlainNetwork:
    description = json.loads((folder / DESCRIPTION).read_text())
    values = np.fromfile(folder / VALUES, dtype="<f4")

    def read(entry: dict) -> np.ndarray:
        count = int(np.prod(entry["shape"]))
        return values[entry["offset"] :][:count].reshape(entry["shape"])

    def group(name: str) -> Arrays:
        return {entry["name"]: read(entry) for entry in description[name]}

    return PlainNetwork(description["config"], group("weights"), group("inputs")["images"], group("outputs"))


def save(folder: Path, network: PlainNetwork) -> None:
    parts: list[np.ndarray] = []
    offset = 0

    def group(arrays: Arrays) -> list[dict]:
        nonlocal offset
        entries = []
        for name, array in arrays.items():
            entries.append({"name": name, "shape": list(array.shape), "offset": offset})
            parts.append(np.ascontiguousarray(array, dtype="<f4").ravel())
            offset += array.size
        return entries

    description = {
        "config": network.config,
        "weights": group(network.weights),
        "inputs": group({"images": network.images}),
        "outputs": group(network.outputs),
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / DESCRIPTION).write_text(json.dumps(description, indent=1) + "\n")
    np.concatenate(parts).tofile(folder / VALUES)
