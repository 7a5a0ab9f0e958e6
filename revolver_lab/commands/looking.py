"""Commands that look at robots: list, doctor, strip, gif."""

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


def strip(arguments: Arguments) -> int:
    """Draws a film strip along alpha."""
    evolve = rvl.load(arguments.name)
    alphas = arguments.alpha or rvl.lab.ALPHAS
    rvl.lab.strip(evolve, alphas, path=arguments.out, **_picture(arguments))
    return wrote(arguments.out)


def gif(arguments: Arguments) -> int:
    """Draws a film of the robot along alpha, or of policies on its robots, side by side."""
    shown = evolve = rvl.load(arguments.name)
    if arguments.policy is not None:
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
    titles = arguments.title or (given if len(given) > 1 else [arguments.name])
    several = {"--policy": given, "--alpha": alphas, "--title": titles}
    panels = max(map(len, several.values()))
    for option, values in several.items():
        if len(values) not in (1, panels):
            counts = ", ".join(f"{len(each)} {name}" for name, each in several.items())
            raise SettingsError(f"{counts}", "as many of each as there are panels, or one",
                                f"Give 1 or {panels} for {option}.")  # fmt: skip
    policies = {each: policy_of(arguments.name, each) for each in given}
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
