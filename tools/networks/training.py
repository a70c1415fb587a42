# SPDX-License-Identifier: Apache-2.0
"""The loop that trains a network. The same seed, steps and data give the same network on the same machine."""
import json
import math
import pathlib
import time

import numpy as np
import torch

LEAST_SHARE = 0.02  # of the learning rate, at the end
SETTLING = 30  # batches from which the batch norms take their statistics before each look


def rate_at(step, steps, rate):
    """Rises during the first twentieth of the steps, then falls along a cosine (Loshchilov and Hutter, ICLR 2017)."""
    rise = max(1, steps // 20)
    if step < rise:
        return rate * (step + 1) / rise
    share = (step - rise) / max(1, steps - rise)
    return rate * (LEAST_SHARE + (1 - LEAST_SHARE) * 0.5 * (1 + math.cos(math.pi * share)))


def random_of(seed, step):
    """Random numbers of one step, the same whether the training was interrupted before it or not."""
    return np.random.default_rng([seed, step])


class Progress:
    """Figures of a training, one line of JSON each in the file, and on the screen."""

    def __init__(self, file):
        self.file, self.start = file, time.process_time()

    def add(self, **figures):
        figures["processor_s"] = round(time.process_time() - self.start, 1)
        with open(self.file, "a") as stream:
            stream.write(json.dumps(figures) + "\n")
        print(
            "  ".join("%s %s" % (k, "%.4f" % v if isinstance(v, float) else v) for k, v in figures.items()), flush=True
        )


def train(network, batch, loss, judge, *, steps, seed, out, rate=3e-3, looks=10):
    """Trains the network and leaves in it the weights that judge() liked best.

    batch(random) gives the tensors of one step, the network's input first; loss(outputs, *targets) is what falls;
    judge(network) gives a figure of the anatomies of choice, larger is better. It is asked `looks` times. Writes
    progress.jsonl and checkpoint.pt into the folder `out`, and goes on from a checkpoint with the same seed and steps.
    Returns the losses of all steps of this call."""
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    optimizer = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=1e-4)
    progress, checkpoint = Progress(out / "progress.jsonl"), out / "checkpoint.pt"
    state = {"seed": seed, "steps": steps, "step": 0, "best": -math.inf, "best_weights": None}
    if checkpoint.exists():
        kept = torch.load(checkpoint)
        if all(kept[key] == state[key] for key in ("seed", "steps")):
            state = kept
            network.load_state_dict(state["weights"])
            optimizer.load_state_dict(state["optimizer"])
    every, losses = max(1, steps // looks), []
    for step in range(state["step"], steps):
        network.train()
        image, *targets = batch(random_of(seed, step))
        for group in optimizer.param_groups:
            group["lr"] = rate_at(step, steps, rate)
        optimizer.zero_grad()
        value = loss(network(image), *targets)
        if not torch.isfinite(value):
            raise SystemExit("train: the loss is not finite at step %d; try a smaller rate" % step)
        value.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimizer.step()
        losses.append(value.item())
        if (step + 1) % every == 0 or step + 1 == steps:
            settle(network, batch, seed)
            figure = look(network, judge, state)
            progress.add(step=step + 1, loss=float(np.mean(losses[-every:])), choice=figure)
            state.update(step=step + 1, weights=network.state_dict(), optimizer=optimizer.state_dict())
            torch.save(state, checkpoint)
    if state["best_weights"] is not None:
        network.load_state_dict(state["best_weights"])
    network.eval()
    return losses


def train_as_told(arguments, network, batch, loss, judge):
    """The same, with the seed, the steps and the folder of the command line."""
    return train(
        network, batch, loss, judge, steps=arguments.steps, seed=arguments.seed, out=pathlib.Path(arguments.out)
    )


def tell(arguments, figures, **more):
    """Writes figures.json, with what else is to be kept, and prints the figures of each part."""
    (pathlib.Path(arguments.out) / "figures.json").write_text(json.dumps({**more, **figures}, indent=1))
    for part, found in figures.items():
        print(part, "  ".join("%s %.3f" % item for item in found.items()))


def settle(network, batch, seed):
    """Gives the batch norms the mean statistics of some batches under today's weights. Those of the training lag behind
    the weights, and each remembers its last ten batches only."""
    network.train()
    norms = [layer for layer in network.modules() if isinstance(layer, torch.nn.BatchNorm2d)]
    for norm in norms:
        norm.reset_running_stats()
        norm.momentum = None  # the mean over all batches
    with torch.no_grad():
        for i in range(SETTLING):
            network(batch(np.random.default_rng([seed, i, 1]))[0])


def look(network, judge, state):
    """The figure of the anatomies of choice; keeps the weights if it is the best."""
    network.eval()
    with torch.no_grad():
        figure = float(judge(network))
    if figure > state["best"]:
        state.update(best=figure, best_weights={k: v.clone() for k, v in network.state_dict().items()})
    return figure
