"""ONNX Runtime as a rival in `deepsft-lab bench --rival`: for each line on standard input one image goes through the
network, and a line with the milliseconds comes back.

    python onnxruntime_turns.py EXPORT_FOLDER NETWORK.onnx

DEEPSFT_BENCH_THREADS says on how many threads."""

import os
import sys
import time
from pathlib import Path

import onnxruntime

import plain_arrays


def main() -> None:
    folder, model = sys.argv[1:]
    images = plain_arrays.load(Path(folder)).images
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = int(os.environ["DEEPSFT_BENCH_THREADS"])
    options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    outputs = [output.name for output in session.get_outputs()]
    for _ in sys.stdin:
        began = time.perf_counter()
        session.run(outputs, {"images": images})
        print(1e3 * (time.perf_counter() - began), flush=True)


if __name__ == "__main__":
    main()
