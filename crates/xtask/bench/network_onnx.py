"""The compact network as an ONNX graph, written from its description and not from the Rust code, with the operators
another program's author would choose: one strided convolution for the patches, Resize, DepthToSpace, Pad."""

import math

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from plain_arrays import Arrays

OPSET = 17
PATCH = 4
PIXELS_PER_CELL = 8
NEIGHBOURS = 2
RELU_GAIN = 1.7139587

ALL_OUTPUTS = ["bins.0", "bins.1", "bins.2", "main", "refined", "pixels", "mask"]
"""Everything the graph can say; `pixels` are the refined coordinates at every pixel."""

MAPS = ["pixels", "mask"]
"""What depth and registration maps are read from."""


class Graph:
    """Nodes and constants of a graph under construction; values are named by strings."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []

    def constant(self, values, dtype=np.float32) -> str:
        name = f"constant{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(values, dtype=dtype), name))
        return name

    def op(self, kind: str, *inputs: str, output: str | None = None, **attributes) -> str:
        output = output or f"{kind.lower()}{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, list(inputs), [output], **attributes))
        return output

    def times(self, x: str, factor: float) -> str:
        return self.op("Mul", x, self.constant(factor))

    def scaled_relu(self, x: str) -> str:
        return self.times(self.op("Relu", x), RELU_GAIN)

    def slice(self, x: str, axis: int, start: int, end: int) -> str:
        ends = [self.constant([value], np.int64) for value in (start, end, axis)]
        return self.op("Slice", x, *ends)

    def resized(self, x: str, factor: int, **attributes) -> str:
        scales = self.constant([1.0, 1.0, factor, factor])
        return self.op("Resize", x, "", scales, **attributes)


class CompactNetwork:
    """The network's blocks over a graph; `weights` by their path, all standardisation folded."""

    def __init__(self, config: dict, weights: Arrays) -> None:
        self.config = config
        self.weights = weights
        self.graph = Graph()

    def convolution(self, path: str, x: str, stride: int = 1) -> str:
        weight = self.weights[f"{path}.weight"]
        return self.convolution_of(weight, self.weights[f"{path}.bias"], x, stride, weight.shape[2] // 2)

    def convolution_of(self, weight: np.ndarray, bias: np.ndarray, x: str, stride: int, pad: int) -> str:
        constants = self.graph.constant(weight), self.graph.constant(bias)
        return self.graph.op("Conv", x, *constants, strides=[stride, stride], pads=[pad] * 4)

    def residual(self, path: str, x: str) -> str:
        g = self.graph
        branch = self.convolution(f"{path}.first", g.scaled_relu(x))
        return g.op("Add", x, self.convolution(f"{path}.second", g.scaled_relu(branch)))

    def up(self, path: str, coarse: str, rows: int, columns: int) -> str:
        """1x1, then nearest up-sampling by two, cropped."""
        g = self.graph
        return self.doubled(self.convolution(path, g.scaled_relu(coarse)), rows, columns)

    def doubled(self, x: str, rows: int, columns: int) -> str:
        g = self.graph
        x = g.resized(x, 2, mode="nearest", coordinate_transformation_mode="asymmetric", nearest_mode="floor")
        return g.slice(g.slice(x, 2, 0, rows), 3, 0, columns)

    def linear(self, x: str, factor: int) -> str:
        return self.graph.resized(x, factor, mode="linear", coordinate_transformation_mode="half_pixel")

    def expected_coordinate(self, logits: str, bins: int) -> str:
        """Expectation over the most likely bin and its neighbours on each side."""
        g = self.graph
        best = g.op("Cast", g.op("ArgMax", logits, axis=1, keepdims=1), to=TensorProto.FLOAT)
        index = g.constant(np.arange(bins).reshape(1, bins, 1, 1))
        distance = g.op("Abs", g.op("Sub", index, best))
        near = g.op("Cast", g.op("LessOrEqual", distance, g.constant(NEIGHBOURS)), to=TensorProto.FLOAT)
        peak = g.op("ReduceMax", logits, axes=[1], keepdims=1)
        weight = g.op("Mul", g.op("Exp", g.op("Sub", logits, peak)), near)
        position = g.constant((np.arange(bins) / (bins - 1)).reshape(1, bins, 1, 1))
        axis = g.constant([1], np.int64)
        total = g.op("ReduceSum", weight, axis, keepdims=1)
        return g.op("Div", g.op("ReduceSum", g.op("Mul", weight, position), axis, keepdims=1), total)

    def isometric_depth(self, coordinates: str, rows: int, columns: int) -> str:
        """Depths that an isometric surface would have by the singular values of its registration's Jacobian."""
        g = self.graph
        width_mm, height_mm = self.config["template_size_mm"]
        near, far = (self.config["depth_range"][key] for key in ("near_mm", "far_mm"))

        def difference(x: str, axis: int, length: int) -> str:
            pads = [0] * 8
            pads[axis] = pads[4 + axis] = 1
            padded = g.op("Pad", x, g.constant(pads, np.int64), mode="edge")
            step = g.op("Sub", g.slice(padded, axis, 2, length + 2), g.slice(padded, axis, 0, length))
            return g.times(step, 1.0 / (2 * PIXELS_PER_CELL))

        def square(x: str) -> str:
            return g.op("Mul", x, x)

        def added(x: str, y: str) -> str:
            return g.op("Add", x, y)

        u = g.times(g.slice(coordinates, 1, 0, 1), width_mm)
        v = g.times(g.slice(coordinates, 1, 1, 2), height_mm)
        ux, uy, vx, vy = (difference(m, axis, n) for m in (u, v) for axis, n in ((3, columns), (2, rows)))
        a, b = added(square(ux), square(vx)), added(square(uy), square(vy))
        c = added(g.op("Mul", ux, uy), g.op("Mul", vx, vy))
        half_sum = g.times(added(a, b), 0.5)
        half_gap = g.op("Sqrt", added(square(g.times(g.op("Sub", a, b), 0.5)), square(c)))

        def normalised(eigenvalue: str) -> str:
            singular_value = g.op("Sqrt", g.op("Max", eigenvalue, g.constant(1e-6)))
            depth = g.times(singular_value, self.config["focal"] / near)
            log_depth = g.times(g.op("Log", depth), 1.0 / math.log(far / near))
            return g.op("Clip", log_depth, g.constant(-0.5), g.constant(1.5))

        cues = normalised(g.op("Sub", half_sum, half_gap)), normalised(added(half_sum, half_gap))
        return g.op("Concat", *cues, axis=1)

    def refinement(self, path: str, features: str, *cues: str) -> str:
        g = self.graph
        x = self.convolution(f"{path}.entry", g.op("Concat", features, *cues, axis=1))
        x = self.convolution(f"{path}.middle", g.scaled_relu(x))
        return self.convolution(f"{path}.correction", g.scaled_relu(x))

    def patches(self, image: str) -> str:
        """Patches embedded by a 1x1 convolution over space-to-depth, here as one strided convolution."""
        weight, bias = self.weights["main.patch.weight"], self.weights["main.patch.bias"]
        kernel = weight.reshape(weight.shape[0], 3, PATCH, PATCH)
        return self.convolution_of(kernel, bias, image, PATCH, 0)

    def forward(self, images: str, height: int, width: int) -> None:
        g = self.graph
        rows, columns = height // 8, width // 8
        image = g.times(g.op("Sub", images, g.constant(0.5)), 4.0)
        patches = self.patches(image)
        at8 = self.residual("main.encode8", self.convolution("main.down8", g.scaled_relu(patches), 2))
        at16 = self.residual("main.encode16", self.convolution("main.down16", g.scaled_relu(at8), 2))
        at32 = self.convolution("main.down32", g.scaled_relu(at16), 2)
        for block in range(self.config["blocks_at_32"]):
            at32 = self.residual(f"main.encode32.{block}", at32)
        at16 = g.op("Add", at16, self.up("main.lateral16", at32, rows // 2, columns // 2))
        at16 = self.residual("main.decode16", at16)
        read = g.scaled_relu(at16)
        coarse = []
        for k, bins in enumerate(self.config["bins"]):
            logits = g.op("Identity", self.convolution(f"main.bins.{k}", read), output=f"bins.{k}")
            coarse.append(self.expected_coordinate(logits, bins))
        at8 = g.op("Add", at8, self.up("main.lateral8", at16, rows, columns))
        features = g.scaled_relu(self.residual("main.decode8", at8))
        offset = self.convolution("main.offset", features)
        main = g.op("Add", self.linear(g.op("Concat", *coarse, axis=1), 2), offset, output="main")

        isometric = self.isometric_depth(main, rows, columns)
        correction = self.refinement("depth_refinement", features, main, isometric)
        depth = g.op("Add", g.slice(main, 1, 2, 3), correction)
        registration = g.slice(main, 1, 0, 2)
        correction = self.refinement("registration_refinement", features, registration, depth, isometric)
        refined = g.op("Concat", g.op("Add", registration, correction), depth, axis=1, output="refined")
        g.op("Identity", self.linear(refined, PIXELS_PER_CELL), output="pixels")

        coarse_mask = self.doubled(self.convolution("mask_coarse", features), 2 * rows, 2 * columns)
        fine_mask = self.convolution("mask_fine", g.scaled_relu(patches))
        mask = self.convolution("mask", g.scaled_relu(g.op("Add", coarse_mask, fine_mask)))
        g.op("DepthToSpace", mask, output="mask", blocksize=PATCH, mode="CRD")


def build(config: dict, weights: Arrays, height: int, width: int, outputs: list[str]) -> onnx.ModelProto:
    """The graph for one image of `height` x `width` pixels (multiples of 16), values 0 to 1, called `images`."""
    network = CompactNetwork(config, weights)
    network.forward("images", height, width)
    cells = height // PIXELS_PER_CELL, width // PIXELS_PER_CELL
    shapes = {
        **{f"bins.{k}": (bins, cells[0] // 2, cells[1] // 2) for k, bins in enumerate(config["bins"])},
        **{"main": (3, *cells), "refined": (3, *cells), "pixels": (3, height, width), "mask": (1, height, width)},
    }
    described = [helper.make_tensor_value_info(name, TensorProto.FLOAT, (1, *shapes[name])) for name in outputs]
    image = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, height, width])
    graph = helper.make_graph(network.graph.nodes, "deepsft", [image], described, network.graph.constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="deepsft-bench")
    model.ir_version = 8
    onnx.checker.check_model(model, full_check=True)
    return model
