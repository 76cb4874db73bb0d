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

PLANE_REACHES = [5.0, 10.0]
"""Standard deviations of the windows that planes are fitted in, cells."""

PLANE_UNIT_MM = 100.0
PLANE_DAMPING = 1e-5
PLANE_HALF_SUPPORT = 0.01

DEPARTURE_GAIN = 10.0
LARGEST_DEPARTURE = 2.0

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


class Term:
    """A value of a graph that formulas can be written with."""

    def __init__(self, graph: Graph, name: str) -> None:
        self.graph, self.name = graph, name

    def _with(self, kind: str, other) -> "Term":
        name = other.name if isinstance(other, Term) else self.graph.constant(other)
        return Term(self.graph, self.graph.op(kind, self.name, name))

    def __add__(self, other) -> "Term":
        return self._with("Add", other)

    def __sub__(self, other) -> "Term":
        return self._with("Sub", other)

    def __mul__(self, other) -> "Term":
        return self._with("Mul", other)

    def __truediv__(self, other) -> "Term":
        return self._with("Div", other)

    def __neg__(self) -> "Term":
        return self * -1.0


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

    def planar_depth(self, coordinates: str, mask: str, rows: int, columns: int) -> list[str]:
        """Depth of the plane q (1 + g P) = A P + t fitted to the registration P in Gaussian windows around each
        cell with ray q, by least squares: one map a reach, near the depth that is there where little is seen."""
        g = self.graph
        config = self.config
        near, far = (config["depth_range"][key] for key in ("near_mm", "far_mm"))

        def channel(x: str, k: int) -> Term:
            return Term(g, g.slice(x, 1, k, k + 1))

        mean_logit = g.op("ReduceMean", mask, axes=[1], keepdims=1)
        pooled = g.op("AveragePool", mean_logit, kernel_shape=[2, 2], strides=[2, 2])
        seen = Term(g, g.op("Sigmoid", pooled))
        u, v = ((channel(coordinates, k) - 0.5) * (config["template_size_mm"][k] / PLANE_UNIT_MM) for k in (0, 1))
        depth_before = channel(coordinates, 2)
        centres = [(np.arange(count) + 0.5) * PIXELS_PER_CELL for count in (columns, rows)]
        x, y = ((centres[k] - config["principal_point"][k]) / config["focal"] for k in (0, 1))
        x, y = (np.broadcast_to(a, (rows, columns))[None, None] for a in (x[None, :], y[:, None]))
        rays = [Term(g, g.constant(a)) for a in (x, y)]

        def gaussian(length: int, deviation: float) -> str:
            steps = np.subtract.outer(np.arange(length), np.arange(length)) / deviation
            return g.constant(np.exp(-(steps**2) / 2) / (deviation * math.sqrt(2 * math.pi)))

        cues = []
        for reach in PLANE_REACHES:
            down, across = gaussian(rows, reach), gaussian(columns, reach)

            def window(value: Term) -> Term:
                return Term(g, g.op("MatMul", g.op("MatMul", down, value.name), across))

            support = window(seen)

            def mean(value: Term) -> Term:
                return window(value * seen) / (support + 1e-6)

            basis = [u, v]
            means = [mean(p) for p in basis]
            products = {(i, j): basis[i] * basis[j] for i, j in ((0, 0), (0, 1), (1, 1))}
            uu, uv, vv = (mean(products[ij]) - means[ij[0]] * means[ij[1]] for ij in products)
            uu, vv = uu + PLANE_DAMPING, vv + PLANE_DAMPING
            determinant = uu * vv - uv * uv

            def solved(a: Term, b: Term) -> tuple[Term, Term]:
                return (vv * a - uv * b) / determinant, (uu * b - uv * a) / determinant

            normal: dict = {}
            right: list = [None, None]
            fits = []
            for q in rays:
                # Regressions of q, q U and q V on P; what they leave over is the system for g.
                targets = [q, q * u, q * v]
                target_means = [mean(t) for t in targets]
                covariances = [[mean(t * p) - tm * pm for p, pm in zip(basis, means)] for t, tm in zip(targets, target_means)]
                slopes = [solved(*c) for c in covariances]

                def left_over(i: int, j: int) -> Term:
                    explained = covariances[i][0] * slopes[j][0] + covariances[i][1] * slopes[j][1]
                    return mean(targets[i] * targets[j]) - target_means[i] * target_means[j] - explained

                for i, j in products:
                    term = left_over(i + 1, j + 1)
                    normal[i, j] = normal[i, j] + term if (i, j) in normal else term
                for i in (0, 1):
                    term = -left_over(i + 1, 0)
                    right[i] = right[i] + term if right[i] else term
                fits.append((target_means, slopes))
            a, b, c = normal[0, 0] + PLANE_DAMPING, normal[0, 1], normal[1, 1] + PLANE_DAMPING
            determinant_g = a * c - b * b
            gu = (c * right[0] - b * right[1]) / determinant_g
            gv = (a * right[1] - b * right[0]) / determinant_g

            columns_of_pose: list[list[Term]] = [[], []]
            translation = []
            for target_means, slopes in fits:
                along = [slopes[0][k] + gu * slopes[1][k] + gv * slopes[2][k] for k in (0, 1)]
                for k in (0, 1):
                    columns_of_pose[k].append(along[k])
                offset = target_means[0] + gu * target_means[1] + gv * target_means[2]
                translation.append(offset - along[0] * means[0] - along[1] * means[1])
            r1, r2 = [*columns_of_pose[0], gu], [*columns_of_pose[1], gv]
            cross = [r1[i] * r2[j] - r1[j] * r2[i] for i, j in ((1, 2), (2, 0), (0, 1))]
            squares = [r[0] * r[0] + r[1] * r[1] + r[2] * r[2] for r in (r1, r2)]
            length = Term(g, g.op("Pow", (squares[0] * squares[1] + 1e-12).name, g.constant(0.25)))
            offset = cross[0] * translation[0] + cross[1] * translation[1] + cross[2]
            facing = cross[0] * rays[0] + cross[1] * rays[1] + cross[2]
            depth = offset * facing / (facing * facing + 1e-9) / length * PLANE_UNIT_MM
            positive = g.op("Max", depth.name, g.constant(1.0))
            log_depth = Term(g, g.op("Log", positive)) * (1 / math.log(far / near)) - math.log(near) / math.log(far / near)
            bounded = Term(g, g.op("Clip", log_depth.name, g.constant(-0.5), g.constant(1.5)))
            trust = support / (support + PLANE_HALF_SUPPORT)
            cues.append((depth_before + (bounded - depth_before) * trust).name)
        return cues

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

        coarse_mask = self.doubled(self.convolution("mask_coarse", features), 2 * rows, 2 * columns)
        mask = g.op("Add", coarse_mask, self.convolution("mask_fine", g.scaled_relu(patches)))
        mask = g.op("Add", mask, self.convolution("mask_mix", g.scaled_relu(mask)))
        mask = self.convolution("mask", g.scaled_relu(mask))
        g.op("DepthToSpace", mask, output="mask", blocksize=PATCH, mode="CRD")

        planar = self.planar_depth(main, mask, rows, columns)
        measured = g.op("Concat", self.isometric_depth(main, rows, columns), *planar, axis=1)

        def departures(depth: str) -> str:
            scaled = g.times(g.op("Sub", measured, depth), DEPARTURE_GAIN)
            return g.op("Clip", scaled, g.constant(-LARGEST_DEPARTURE), g.constant(LARGEST_DEPARTURE))

        depth = g.slice(main, 1, 2, 3)
        said = self.refinement("depth_refinement", features, main, departures(depth))
        shares = g.op("Softmax", g.slice(said, 1, 1, 2 + len(planar)), axis=1)
        weighed = g.op("Mul", shares, g.op("Concat", depth, *planar, axis=1))
        mean = g.op("ReduceSum", weighed, g.constant([1], np.int64), keepdims=1)
        depth = g.op("Add", mean, g.slice(said, 1, 0, 1))
        registration = g.slice(main, 1, 0, 2)
        correction = self.refinement("registration_refinement", features, registration, depth, departures(depth))
        refined = g.op("Concat", g.op("Add", registration, correction), depth, axis=1, output="refined")
        g.op("Identity", self.linear(refined, PIXELS_PER_CELL), output="pixels")


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
