"""P networks with their targets, gradients and optimiser: what an algorithm is built of."""

from collections.abc import Mapping

import numpy as np
import torch

from revolver_lab.learners.stacked.adam import Adam
from revolver_lab.learners.stacked.layout import Layout, export, forward, load


class Networks:
    """One network of each learner, or `twins` of them, that are trained together.

    Args:
        layout: Arrays of one network.
        learners: P.
        learning_rate: Of Adam.
        twins: Networks a learner; critics come in twos.
        target: Whether a slow copy follows them.
        device: Where they live.

    Attributes:
        flat: All weights, (P, twins D).
        target: Those of the slow copy, or None.
        gradient: The latest gradient, (P, twins D).
        adam: The optimiser.
    """

    def __init__(
        self, layout: Layout, learners: int, learning_rate: float, *, twins: int = 1,
        target: bool = False, device: str = "cpu",
    ):  # fmt: skip
        self.layout, self.twins = layout, twins
        self.flat = torch.zeros(learners, twins * layout.size, device=device)
        self.target = torch.zeros_like(self.flat) if target else None
        self.gradient = torch.zeros_like(self.flat)
        self.adam = Adam(self.flat, learning_rate)
        self._gradients = self._views(self.gradient)
        self._fixed = self._views(self.flat)
        self._leaves = {k: v.detach().requires_grad_() for k, v in self._fixed.items()}
        self._slow = self._views(self.target) if self.target is not None else {}

    def _views(self, flat: torch.Tensor) -> dict[str, torch.Tensor]:
        """Names the arrays of all twins of all learners, (P twins, *shape) each."""
        return self.layout.views(flat.view(-1, self.layout.size))

    def __call__(self, x: torch.Tensor, *, train: bool = False) -> torch.Tensor:
        """Applies them: (P, B, inputs) -> (P, twins, B, outputs).

        Args:
            x: One batch a learner; twins see the same.
            train: Whether gradients will be asked for.
        """
        return self._apply(self._leaves if train else self._fixed, x)

    def follow(self, x: torch.Tensor) -> torch.Tensor:
        """Applies the slow copy, as calling does."""
        return self._apply(self._slow, x)

    def _apply(self, weights: Mapping[str, torch.Tensor], x: torch.Tensor) -> torch.Tensor:
        """Applies one set of weights."""
        spread = x[:, None].expand(-1, self.twins, -1, -1).flatten(0, 1)
        return forward(weights, spread).unflatten(0, (-1, self.twins))

    def descend(self, loss: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """Takes one step of Adam down each learner's own loss.

        A step whose gradient is not finite is not taken.

        Args:
            loss: (P,).
            mask: Who steps, (P, 1) bool.

        Returns:
            Whose gradient is finite, (P, 1) bool.
        """
        found = torch.autograd.grad(loss.sum(), list(self._leaves.values()))
        for view, part in zip(self._gradients.values(), found, strict=True):
            view.copy_(part)
        finite = torch.isfinite(self.gradient.sum(dim=1, keepdim=True))
        self.adam.step(self.gradient, mask & finite)
        return finite

    def drag(self, tau: float, mask: torch.Tensor) -> None:
        """Lets the slow copy follow: target <- (1 - tau) target + tau weights, where masked."""
        if self.target is not None:
            self.target.lerp_(self.flat, tau * mask)

    def arrays(self, learner: int, *, target: bool = False) -> dict[str, np.ndarray]:
        """Returns copies of one learner's arrays as `Policy` has them: "I.weight", or "K.I.weight".

        Args:
            learner: Which.
            target: The slow copy's instead.
        """
        views = self._slow if target else self._fixed
        found = {}
        for twin in range(self.twins):
            row = learner * self.twins + twin
            prefix = f"{twin}." if self.twins > 1 else ""
            for name, array in views.items():
                found[prefix + name] = export(name, array[row].cpu().numpy()).copy()
        return found

    def write(self, learner: int, arrays: Mapping[str, np.ndarray], *, target: bool) -> None:
        """Writes one learner's arrays, named as `arrays` names them."""
        views = self._slow if target else self._fixed
        for twin in range(self.twins):
            prefix = f"{twin}." if self.twins > 1 else ""
            for name, view in views.items():
                array = load(name, np.ascontiguousarray(arrays[prefix + name]))
                view[learner * self.twins + twin] = torch.as_tensor(array)

    def state(self) -> dict[str, torch.Tensor]:
        """Returns everything that a resumed run needs, live."""
        held = {"weights": self.flat, "first": self.adam.first, "second": self.adam.second,
                "count": self.adam.count}  # fmt: skip
        return held | ({"target": self.target} if self.target is not None else {})
