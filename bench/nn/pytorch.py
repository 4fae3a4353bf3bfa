"""The same networks in PyTorch, one thread: forward without gradients, and a step of forward, backward and Adam
in floats and with bfloat16 where PyTorch sees fit.

  pytorch.py      one line of JSON: nanoseconds a sample by width
"""
import json
import time

import torch

torch.set_num_threads(1)


class Net(torch.nn.Module):
    def __init__(self, width):
        super().__init__()
        self.layers = torch.nn.ModuleList(torch.nn.Linear(width, width) for _ in range(6))

    def forward(self, x):
        h = torch.relu(self.layers[0](x))
        for first in (1, 3):
            h = torch.relu(h + self.layers[first + 1](torch.relu(self.layers[first](h))))
        return self.layers[5](h)


def best(action, batch, rounds):
    fastest = float("inf")
    for _ in range(rounds):
        start = time.perf_counter()
        action()
        fastest = min(fastest, time.perf_counter() - start)
    return fastest / batch * 1e9


def forward(width, batch):
    net, x = Net(width), torch.rand(batch, width)
    with torch.inference_mode():
        return best(lambda: net(x), batch, 200)


def train(width, batch, autocast):
    net, x = Net(width), torch.rand(batch, width, requires_grad=True)  # a coupling below needs its gradient
    optimiser = torch.optim.Adam(net.parameters(), lr=1e-9)
    out = torch.rand(batch, width)

    def step():
        optimiser.zero_grad(set_to_none=True)
        x.grad = None
        with torch.autocast("cpu", dtype=torch.bfloat16, enabled=autocast):
            y = net(x)
        y.backward(out.to(y.dtype))
        optimiser.step()

    return best(step, batch, 50)


# Forward in the batch that suits it; training in ours, since the batch is part of the method.
print(json.dumps({
    "forward": {width: min(forward(width, batch) for batch in (64, 512, 2048, 8192)) for width in (32, 64, 128)},
    "train": {width: train(width, 2048, False) for width in (32, 64, 128)},
    "train_bf16": {width: train(width, 2048, True) for width in (32, 64, 128)},
}))  # fmt: skip
