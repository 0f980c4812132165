#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""Runs network_bench, times ONNX Runtime and numpy (what scipy computes with) on the same network
and inputs, prints the table, and fails unless ours takes at most 0.6 of emlearn's time and less
than everybody else's for one evaluation, which is what a cycle of the box needs. Thousands of points
in one call are shown beside: matrix products that no loop in real time can use. Who cannot be
installed is named and left out.
  network_report.py NETWORK_BENCH
  network_report.py --self-test"""

import json
import pathlib
import subprocess
import sys
import tempfile
import time

OURS, EMLEARN_LIMIT = "compbox", 0.6
IN_BULK = "points in one call"
INPUTS, HIDDEN, OUTPUTS = 19, 20, 3
COMPILED = ["emlearn", "FANN", "GSL", "Eigen"]
OPTIONS = ["--benchmark_enable_random_interleaving=true", "--benchmark_repetitions=15",
           "--benchmark_min_time=0.02", "--benchmark_report_aggregates_only=true",
           "--benchmark_out_format=json"]


def run(program, folder):
    """{contestant: ns per point}, medians of CPU time over interleaved repetitions."""
    out = folder / "result.json"
    subprocess.run([program, f"--write={folder / 'network.txt'}", f"--benchmark_out={out}"] + OPTIONS,
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    return {b["run_name"]: 1e9 / b["items_per_second"]
            for b in json.loads(out.read_text())["benchmarks"] if b["aggregate_name"] == "median"}


def median_ns(function, points, repetitions):
    times = []
    for _ in range(repetitions):
        start = time.process_time_ns()
        function()
        times.append(time.process_time_ns() - start)
    return sorted(times)[repetitions // 2] / points


class Network:
    def __init__(self, np, path):
        rows = [np.array(line.split(), np.float32) for line in open(path)]
        self.w1, self.b1 = rows[0].reshape(HIDDEN, INPUTS), rows[1]
        self.w2, self.b2 = rows[2].reshape(OUTPUTS, HIDDEN), rows[3]
        self.x, self.y = rows[4].reshape(-1, INPUTS), rows[5].reshape(-1, OUTPUTS)


def both_ways(name, np, net, evaluate):
    """{name: ns per point} of all points in one call and of one call per point, after comparing."""
    worst = float(np.max(np.abs(evaluate(net.x) - net.y)))
    if not worst < 2e-5:
        sys.exit(f"{name} and compbox differ by {worst:g}")
    few = [row.reshape(1, -1) for row in net.x[:300]]
    return {f"{name}, {len(net.x)} {IN_BULK}": median_ns(lambda: evaluate(net.x), len(net.x), 15),
            f"{name}, one call per point": median_ns(lambda: [evaluate(row) for row in few], 300, 7)}


def numpy_times(np, net):
    w1, w2 = net.w1.T.copy(), net.w2.T.copy()
    return both_ways("numpy", np, net, lambda x: np.tanh(x @ w1 + net.b1) @ w2 + net.b2)


def onnx_times(np, net):
    import onnxruntime
    from onnx import TensorProto, helper, numpy_helper
    table = [numpy_helper.from_array(value, name) for name, value in
             (("w1", net.w1), ("b1", net.b1), ("w2", net.w2), ("b2", net.b2))]
    nodes = [helper.make_node("Gemm", ["x", "w1", "b1"], ["s"], transB=1),
             helper.make_node("Tanh", ["s"], ["h"]),
             helper.make_node("Gemm", ["h", "w2", "b2"], ["y"], transB=1)]
    graph = helper.make_graph(
        nodes, "network", [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n", INPUTS])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["n", OUTPUTS])], table)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(model.SerializeToString(), options,
                                           providers=["CPUExecutionProvider"])
    return both_ways("ONNX Runtime", np, net, lambda x: session.run(None, {"x": x})[0])


def limit_of(name):
    """None: no limit."""
    if name == OURS or name.endswith(IN_BULK):
        return None
    return EMLEARN_LIMIT if name == "emlearn" else 1.0


def report(times):
    """Prints the table; the list of limits that are not met."""
    print(f"19-20-3 network, random input{'':>24}ns/point   ours/theirs   allowed")
    broken = []
    for name, ns in sorted(times.items(), key=lambda one: one[1]):
        ratio, limit = times[OURS] / ns, limit_of(name)
        print(f"  {name:<48}{ns:11.1f}{ratio:14.3f}{f'{limit:.2f}' if limit else '':>10}")
        if limit and not ratio <= limit:
            broken.append(f"{ratio:.3f} of {name}, allowed {limit}")
    return broken


def self_test():
    """A contestant that becomes too fast for us must be reported."""
    right = {OURS: 1.0, "emlearn": 2.0, "FANN": 1.5}
    if report(right):
        sys.exit("self-test: right times were refused")
    for name, ns in (("emlearn", 1.6), ("FANN", 0.9)):
        if not report({**right, name: ns}):
            sys.exit(f"self-test: not caught: {name}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        try:
            times = run(sys.argv[1], folder)
        except subprocess.CalledProcessError as error:
            sys.exit(error.stderr.decode())
        left_out = [one for one in COMPILED if one not in times]
        for what, timed in (("numpy", numpy_times), ("ONNX Runtime", onnx_times)):
            try:
                import numpy as np
                times.update(timed(np, Network(np, folder / "network.txt")))
            except ImportError as error:
                left_out.append(f"{what} ({error.name} is missing)")
    broken = report(times)
    for one in left_out:
        print(f"left out: {one} is not installed here")
    if broken:
        sys.exit("\n".join(broken))


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    else:
        main()
