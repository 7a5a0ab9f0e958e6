"""Commands that look at robots: list, doctor, strip, gif."""

import revolver_lab as rvl
from revolver_lab.commands.parts import BAD_USE, Arguments, policy_of, wrote
from revolver_lab.errors import SettingsError


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
    size = _size(arguments)
    rvl.lab.strip(evolve, arguments.alpha or rvl.lab.ALPHAS, path=arguments.out, **size)
    return wrote(arguments.out)


def gif(arguments: Arguments) -> int:
    """Draws a film of the robot along alpha, or of a policy on its robots."""
    shown = evolve = rvl.load(arguments.name)
    if arguments.policy is not None:
        policy = policy_of(arguments.name, arguments.policy)
        shown = [
            rvl.lab.record(
                policy, evolve, alpha, task=arguments.task, seed=arguments.seed,
                steps=arguments.steps, title=arguments.title or arguments.name,
            )
            for alpha in arguments.alpha or (0.0, 0.5, 1.0)
        ]  # fmt: skip
    elif arguments.alpha:
        raise SettingsError(
            "--alpha without --policy", "--alpha with --policy", "Try: revolver-lab strip."
        )
    rvl.lab.film(shown, arguments.out, fps=arguments.fps, **_size(arguments))
    return wrote(arguments.out)


def _size(arguments: Arguments) -> dict[str, int]:
    """The size of one picture [pixels]."""
    return {"width": arguments.width, "height": arguments.height}
