"""libigl as a rival in `deepsft-lab completion speed --rival`: ARAP (cells of spokes, Sorkine and Alexa 2007) with the
given vertices held exactly.

    python libigl_turns.py FOLDER

reads a line at a time from standard input and answers each with a line:

    mesh              reads vertices.f64 and faces.i64 in FOLDER, the rest mesh
    solve ITERATIONS  reads given.i32, places.f64 and start.f64; precompute and iterations; answers with JSON
    energy            reads result.f64, vertices; answers with their ARAP energy

The energy is that of the paper with the plain cotangent weights of libigl and the best rotation of each cell, and the
same function is used for libigl's own result. DEEPSFT_BENCH_THREADS says on how many threads."""

import json
import os
import sys
import time
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "IGL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = os.environ["DEEPSFT_BENCH_THREADS"]

import igl  # noqa: E402
import numpy as np  # noqa: E402


class Cells:
    """The directed edges (i, j) of the rest mesh, sorted by i, with cotangent weights."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray):
        laplacian = igl.cotmatrix(vertices, faces).tocoo()
        edges = laplacian.row != laplacian.col
        order = np.argsort(laplacian.row[edges], kind="stable")
        self.i = laplacian.row[edges][order]
        self.j = laplacian.col[edges][order]
        self.weights = laplacian.data[edges][order]
        self.rest = vertices[self.i] - vertices[self.j]
        # Every vertex has an edge here, so each cell starts where i changes.
        self.starts = np.flatnonzero(np.diff(self.i, prepend=-1))

    def energy(self, vertices: np.ndarray) -> float:
        deformed = vertices[self.i] - vertices[self.j]
        outer = self.weights[:, None, None] * deformed[:, :, None] * self.rest[:, None, :]
        covariances = np.add.reduceat(outer, self.starts)
        left, _, right = np.linalg.svd(covariances)
        mirrored = np.linalg.det(left @ right) < 0
        left[mirrored, :, 2] *= -1
        rotations = (left @ right)[self.i]
        residuals = deformed - np.einsum("eab,eb->ea", rotations, self.rest)
        return float(np.sum(self.weights * np.sum(residuals**2, axis=1)))


def points(path: Path) -> np.ndarray:
    return np.fromfile(path, dtype="<f8").reshape(-1, 3)


def solve(folder: Path, vertices: np.ndarray, faces: np.ndarray, iterations: int) -> tuple[float, float, np.ndarray]:
    given = np.fromfile(folder / "given.i32", dtype="<i4")
    places = points(folder / "places.f64")
    start = points(folder / "start.f64")
    start[given] = places
    data = igl.ARAPData()
    data.energy = igl.ARAP_ENERGY_TYPE_SPOKES
    data.max_iter = iterations
    began = time.perf_counter()
    igl.arap_precomputation(vertices, faces, 3, given, data)
    prepared = time.perf_counter()
    result = igl.arap_solve(places, data, start)
    done = time.perf_counter()
    return 1e3 * (prepared - began), 1e3 * (done - prepared), result


def main() -> None:
    folder = Path(sys.argv[1])
    for line in sys.stdin:
        question, *words = line.split()
        if question == "mesh":
            vertices = points(folder / "vertices.f64")
            faces = np.fromfile(folder / "faces.i64", dtype="<i8").reshape(-1, 3)
            cells = Cells(vertices, faces)
            answer = str(len(faces))
        elif question == "solve":
            precompute_ms, solve_ms, result = solve(folder, vertices, faces, int(words[0]))
            answer = json.dumps(
                {"precompute_ms": precompute_ms, "solve_ms": solve_ms, "energy": cells.energy(result)}
            )
        elif question == "energy":
            answer = repr(cells.energy(points(folder / "result.f64")))
        else:
            sys.exit(f"there is nothing called {question!r}")
        print(answer, flush=True)


if __name__ == "__main__":
    main()
