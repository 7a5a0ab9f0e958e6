"""Commands that look at robots: list, doctor, match, strip, gif."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import revolver_lab as rvl
from revolver_lab.commands.parts import BAD_USE, Arguments, policy_of, wrote
from revolver_lab.errors import SettingsError

if TYPE_CHECKING:
    from revolver_lab.evolution.evolution import Evolution
    from revolver_lab.lab import Rollout


def show_list(arguments: Arguments) -> int:
    """Prints the registered robots, one a line."""
    from revolver_lab.robots import registry

    for name in registry.names():
        robot = registry.get(name)
        print(name if arguments.short else f"{name:<22} {robot.summary:<40} {robot.origin}")
    return 0


def doctor(_: Arguments) -> int:
    """Tells what was found here; returns 2 if something that everything needs is wrong."""
    from revolver_lab.lab.doctor import probe_report

    findings = probe_report()
    print(*findings, sep="\n")
    return BAD_USE if any(f.mend and not f.needed_for for f in findings) else 0


def match(arguments: Arguments) -> int:
    """Prints what became what, and how many parameters change."""
    evolve = _evolution(arguments.names)
    print(evolve, evolve.matching, sep="\n")
    return 0


def _evolution(names: Sequence[str]) -> "Evolution":
    """Returns the registered evolution of one name, or that between two files."""
    if len(names) > 2:
        raise SettingsError(f"{len(names)} robots: {', '.join(names)}", "a name, or two files",
                            "Leave the others out.")  # fmt: skip
    return rvl.load(names[0]) if len(names) == 1 else rvl.Evolution(*names)


def strip(arguments: Arguments) -> int:
    """Draws a film strip along alpha."""
    evolve = _evolution(arguments.names)
    alphas = arguments.alpha or rvl.lab.ALPHAS
    rvl.lab.strip(evolve, alphas, path=arguments.out, **_picture(arguments))
    return wrote(arguments.out)


def gif(arguments: Arguments) -> int:
    """Draws a film of the robot along alpha, or of policies on its robots, side by side."""
    shown = evolve = _evolution(arguments.names)
    if arguments.policy is not None:
        if len(arguments.names) > 1:
            raise SettingsError("--policy with two files, which have no task", "a robot by name",
                                "Film it in Python: rvl.lab.record(..., task=...).")  # fmt: skip
        shown = _rollouts(evolve, arguments)
    elif arguments.alpha:
        raise SettingsError(
            "--alpha without --policy", "--alpha with --policy", "Try: revolver-lab strip."
        )
    rvl.lab.film(
        shown, arguments.out, fps=arguments.fps, speed=arguments.speed, **_picture(arguments)
    )
    return wrote(arguments.out)


def _rollouts(evolve: "Evolution", arguments: Arguments) -> "list[Rollout]":
    """Plays an episode for each panel: one policy on several robots, or each on its own."""
    given, alphas = arguments.policy, arguments.alpha
    if alphas is None:
        alphas = (0.0, 0.5, 1.0) if len(given) == 1 else (1.0,)
    titles = arguments.title or (given if len(given) > 1 else arguments.names)
    several = {"--policy": given, "--alpha": alphas, "--title": titles}
    panels = max(map(len, several.values()))
    for option, values in several.items():
        if len(values) not in (1, panels):
            counts = ", ".join(f"{len(each)} {name}" for name, each in several.items())
            raise SettingsError(f"{counts}", "as many of each as there are panels, or one",
                                f"Give 1 or {panels} for {option}.")  # fmt: skip
    policies = {each: policy_of(evolve.name, each) for each in given}
    rows = zip(*(list(v) * (panels // len(v)) for v in several.values()))
    return [
        rvl.lab.record(
            policies[each], evolve, alpha, task=arguments.task, seed=arguments.seed,
            steps=arguments.steps, title=title,
        )
        for each, alpha, title in rows
    ]  # fmt: skip


def _picture(arguments: Arguments) -> dict[str, Any]:
    """The size of one picture [pixels], and the camera it is taken by."""
    size = {"width": arguments.width, "height": arguments.height}
    return size | {"camera": arguments.camera}
