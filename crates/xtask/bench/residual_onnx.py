"""The paper's network and R50F as ONNX graphs, written from their descriptions and not from the Rust code, with the operators
another program's author would choose."""

import numpy as np
import onnx
from onnx import TensorProto, helper

from network_onnx import OPSET, Graph
from plain_arrays import Arrays

MAPS = {"paper": ["depth", "registration"], "r50f": ["maps"]}
"""What the graphs say of every pixel."""

MAIN_MAPS = ["main"]
"""What the paper's network says when it ends with its main block."""


class ResidualNetwork:
    """Bottleneck blocks over a graph; `weights` by their path, batch normalisation folded."""

    def __init__(self, weights: Arrays) -> None:
        self.weights = weights
        self.graph = Graph()

    def convolution(self, path: str, x: str, stride: int = 1, relu: bool = True, **output) -> str:
        g = self.graph
        weight = self.weights[f"{path}.weight"]
        constants = g.constant(weight), g.constant(self.weights[f"{path}.bias"])
        final = {} if relu else output
        x = g.op("Conv", x, *constants, strides=[stride, stride], pads=[weight.shape[2] // 2] * 4, **final)
        return g.op("Relu", x, **output) if relu else x

    def bottleneck(self, path: str, x: str, stride: int = 1, upsampling: int = 1) -> str:
        """1x1 convolutions before the up-sampling, which they commute with."""
        g = self.graph
        branch = self.enlarged(self.convolution(f"{path}.reduce", x, stride), upsampling)
        branch = self.convolution(f"{path}.expand", self.convolution(f"{path}.spatial", branch), relu=False)
        if f"{path}.shortcut.weight" in self.weights:
            x = self.enlarged(self.convolution(f"{path}.shortcut", x, stride, relu=False), upsampling)
        return g.op("Relu", g.op("Add", branch, x))

    def stack(self, path: str, x: str, identities: int, stride: int = 1, upsampling: int = 1, rows=None) -> str:
        x = self.cropped(self.bottleneck(f"{path}.first", x, stride, upsampling), rows)
        for k in range(identities):
            x = self.bottleneck(f"{path}.identities.{k}", x)
        return x

    def enlarged(self, x: str, factor: int) -> str:
        if factor == 1:
            return x
        nearest = {"mode": "nearest", "coordinate_transformation_mode": "asymmetric", "nearest_mode": "floor"}
        return self.graph.resized(x, factor, **nearest)

    def cropped(self, x: str, rows: tuple[int, int] | None) -> str:
        return self.graph.slice(x, 2, *rows) if rows else x

    def entry(self, path: str, x: str, stride: int, pad: int) -> str:
        x = self.convolution(f"{path}entry", x, 2)
        return self.graph.op("MaxPool", x, kernel_shape=[3, 3], strides=[stride, stride], pads=[pad] * 4)

    def main_block(self, image: str) -> str:
        x = self.entry("main.", image, 3, 0)
        x = self.stack("main.encode3", self.stack("main.encode2", x, 2), 3, stride=2)
        x = self.stack("main.decode5", self.stack("main.encode4", x, 5, stride=2), 5)
        x = self.stack("main.decode6", x, 3, upsampling=2, rows=(0, 23))
        x = self.stack("main.decode7", x, 2, upsampling=2)
        x = self.convolution("main.smooth", self.cropped(self.enlarged(x, 3), (1, 137)))
        x = self.cropped(self.enlarged(x, 2), (1, 271))
        return self.convolution("main.output", x, relu=False, output="main")

    def refinement_block(self, path: str, seen: str, **output) -> str:
        x = self.entry(f"{path}.", seen, 3, 0)
        x = self.stack(f"{path}.encode3", self.stack(f"{path}.encode2", x, 2), 3, stride=2)
        x = self.stack(f"{path}.decode6", x, 3, upsampling=2)
        x = self.stack(f"{path}.decode7", x, 2, upsampling=2, rows=(1, 91))
        return self.convolution(f"{path}.output", self.enlarged(x, 3), relu=False, **output)

    def paper(self, image: str, outputs: list[str]) -> None:
        g = self.graph
        main = self.main_block(image)
        if outputs == MAIN_MAPS:
            return
        seen = g.op("Concat", image, main, axis=1)
        self.refinement_block("depth_refinement", seen, output="depth")
        correction = self.refinement_block("registration_refinement", seen)
        g.op("Add", g.slice(main, 1, 1, 3), correction, output="registration")

    def r50f(self, image: str, _outputs: list[str]) -> None:
        x = self.stack("encode2", self.entry("", image, 2, 1), 2)
        for path, identities in (("encode3", 3), ("encode4", 5), ("encode5", 2)):
            x = self.stack(path, x, identities, stride=2)
        neurons = self.graph.op("Relu", self.dense("neurons", self.graph.op("Flatten", x)))
        shape = self.graph.constant([1, 3, 270, 480], np.int64)
        self.graph.op("Reshape", self.dense("maps", neurons), shape, output="maps")

    def dense(self, path: str, x: str) -> str:
        constants = [self.graph.constant(self.weights[f"{path}.{array}"]) for array in ("weight", "bias")]
        return self.graph.op("Gemm", x, *constants)


def build(config: dict, weights: Arrays, outputs: list[str]) -> onnx.ModelProto:
    """The graph for one image of 270 x 480 pixels, values 0 to 1, called `images`."""
    network = ResidualNetwork(weights)
    g = network.graph
    image = g.op("Sub", g.times("images", 2.0), g.constant(1.0))
    {"paper": network.paper, "r50f": network.r50f}[config["architecture"]](image, outputs)
    channels = {"main": 3, "depth": 1, "registration": 2, "maps": 3}
    described = [helper.make_tensor_value_info(name, TensorProto.FLOAT, (1, channels[name], 270, 480)) for name in outputs]
    images = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, 270, 480])
    graph = helper.make_graph(g.nodes, "deepsft", [images], described, g.constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="deepsft-bench")
    model.ir_version = 8
    return model
