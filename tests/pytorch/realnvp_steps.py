#!/usr/bin/python3
"""Ten steps of Adam on a small Real NVP, in PyTorch: what src/train/fit_realnvp_test.cpp compares warpath's with.

    /usr/bin/python3 tests/pytorch/realnvp_steps.py tests/data/realnvp_steps.json      (Debian: python3-torch)

The model is written from docs and papers, apart from warpath's code: logit space, affine couplings with alternating
masks (Dinh et al. 2017), s = scale * tanh(.), beyond |logit| = 8 with slope 1, residual networks, dense layers with
gains before each ReLU (actnorm), or batch normalisation.
"""
import json
import math
import sys

import torch

EDGE = 8.0
torch.set_default_dtype(torch.float64)
torch.set_num_threads(1)


class Net(torch.nn.Module):
    def __init__(self, inputs, width, blocks, outputs, norm):
        super().__init__()
        self.norm = norm
        sizes = [(inputs, width)] + [(width, width)] * (2 * blocks) + [(width, outputs)]
        self.weight = torch.nn.ParameterList(
            [torch.nn.Parameter((torch.rand(o, i) * 2 - 1) * math.sqrt(3 / i)) for i, o in sizes])
        self.bias = torch.nn.ParameterList([torch.nn.Parameter((torch.rand(o) - 0.5) * 0.4) for _, o in sizes])
        gains = len(sizes) - 1 if norm != "none" else 0
        self.gain = torch.nn.ParameterList([torch.nn.Parameter(torch.rand(sizes[i][1]) + 0.5) for i in range(gains)])

    def layer(self, i, x):
        if not self.gain or i == len(self.weight) - 1:
            return x @ self.weight[i].T + self.bias[i]
        y = x @ self.weight[i].T
        if self.norm == "batch":
            return torch.nn.functional.batch_norm(y, None, None, self.gain[i], self.bias[i], training=True, eps=1e-5)
        return y * self.gain[i] + self.bias[i]

    def forward(self, x):
        h = torch.relu(self.layer(0, x))
        for i in range(1, len(self.weight) - 1, 2):
            h = torch.relu(h + self.layer(i + 1, torch.relu(self.layer(i, h))))
        return self.layer(len(self.weight) - 1, h)


class Flow(torch.nn.Module):
    def __init__(self, dims, couplings, width, blocks, shared, norm):
        super().__init__()
        self.kept, self.moved, self.shared = [], [], shared
        self.nets, self.scales = torch.nn.ModuleList(), torch.nn.ParameterList()
        for c in range(couplings):
            kept = [i for i in range(dims) if i % 2 == c % 2]
            moved = [i for i in range(dims) if i % 2 != c % 2]
            self.kept.append(kept)
            self.moved.append(moved)
            outputs = [2 * len(moved)] if shared else [len(moved)] * 2
            self.nets.append(torch.nn.ModuleList([Net(len(kept), width, blocks, o, norm) for o in outputs]))
            self.scales.append(torch.nn.Parameter(torch.rand(len(moved)) - 0.5))

    def log_density(self, y):
        def log_logistic(v):
            return torch.nn.functional.logsigmoid(v) + torch.nn.functional.logsigmoid(-v)

        v = torch.log(y) - torch.log1p(-y)
        log_q = -log_logistic(v).sum(1)
        for c in reversed(range(len(self.nets))):
            x = v[:, self.kept[c]].clamp(-EDGE, EDGE)
            s, t = torch.cat([net(x) for net in self.nets[c]], 1).chunk(2, 1)
            s = self.scales[c] * torch.tanh(s)
            w = v[:, self.moved[c]] - t
            inside = w.abs() <= EDGE * torch.exp(s)
            moved = torch.where(inside, w * torch.exp(-s), w - EDGE * torch.sign(w) * (torch.exp(s) - 1))
            log_q = log_q - torch.where(inside, s, torch.zeros_like(s)).sum(1)
            v = v.clone()
            v[:, self.moved[c]] = moved
        return log_q + log_logistic(v).sum(1)

    def named(self):
        for c, nets in enumerate(self.nets):
            for name, net in zip(["st"] if self.shared else ["s", "t"], nets):
                for k in range(len(net.weight)):
                    yield f"coupling{c}.{name}.layer{k}.weight", net.weight[k]
                    yield f"coupling{c}.{name}.layer{k}.bias", net.bias[k]
                    if k < len(net.gain):
                        yield f"coupling{c}.{name}.layer{k}.gain", net.gain[k]
            yield f"coupling{c}.scale", self.scales[c]


def numbers(tensor, digits=7):
    return [float(f"{x:.{digits}g}") for x in tensor.detach().flatten().tolist()]


def run(dims, couplings, width, blocks, shared, norm, samples, rate, seed):
    torch.manual_seed(seed)
    flow = Flow(dims, couplings, width, blocks, shared, norm)
    y = torch.rand(samples, dims)
    y[:, 0] = y[:, 0] ** 3
    y[:, -1] = 0.5 * y[:, -1] + 0.25 * y[:, 0] + 0.1
    y[0, 0], y[1, -1] = 1e-5, 1 - 1e-5  # where couplings have slope 1
    y = torch.tensor(numbers(y)).reshape(samples, dims).float().double()
    for _, p in flow.named():  # what the file says is what is trained
        p.data = torch.tensor(numbers(p)).reshape(p.shape).float().double()
    out = dict(dims=dims, couplings=couplings, width=width, blocks=blocks, shared=shared, norm=norm, rate=rate,
               y=numbers(y, 9), parameters={name: numbers(p, 9) for name, p in flow.named()}, loss=[])
    adam = torch.optim.Adam(flow.parameters(), lr=rate)
    for _ in range(10):
        adam.zero_grad()
        loss = -flow.log_density(y).mean()
        loss.backward()
        adam.step()
        out["loss"].append(loss.item())
    out["after"] = {name: numbers(p) for name, p in flow.named() if name.startswith("coupling0") and "weight" not in name}
    return out


runs = [
    run(2, 2, 16, 1, False, "none", 150, 1e-3, 1),
    run(3, 3, 16, 1, False, "actnorm", 130, 3e-3, 2),
    run(4, 2, 16, 1, True, "actnorm", 128, 1e-3, 3),
    run(2, 2, 16, 1, False, "batch", 150, 1e-3, 4),
]
with open(sys.argv[1], "w") as file:
    json.dump(dict(made_by="tests/pytorch/realnvp_steps.py", torch=torch.__version__, runs=runs), file)
    file.write("\n")
