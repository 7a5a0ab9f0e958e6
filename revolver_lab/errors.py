"""The errors a user can meet: each says what was given, what is allowed, and what to do."""


class RevolverError(Exception):
    """Base of every error this package raises on purpose.

    Args:
        given: What was given, with its value.
        allowed: What is allowed instead, with the choices where they can be listed.
        remedy: The one thing to do next, as a sentence.

    Example:
        >>> raise AlphaError("alpha = 1.5", "a number in [0, 1]", "Clip it before the call.")
        Traceback (most recent call last):
        ...
        revolver_lab.errors.AlphaError: alpha = 1.5. Allowed: a number in [0, 1]. Clip it ...
    """

    def __init__(self, given: str, allowed: str, remedy: str):
        self.given, self.allowed, self.remedy = given, allowed, remedy
        super().__init__(f"{given}. Allowed: {allowed}. {remedy}")


class AlphaError(RevolverError, ValueError):
    """An evolution parameter outside [0, 1], or not a number."""


class RobotFileError(RevolverError, ValueError):
    """A robot file that is malformed, hostile, incomplete or outside its own folder."""


class MatchingError(RevolverError, ValueError):
    """Two robots, or pins between them, that cannot be put in correspondence."""


class ParameterError(RevolverError, ValueError):
    """A kinematic parameter that cannot be interpolated as asked."""


class UnknownNameError(RevolverError, LookupError):
    """A name that is not registered; the message lists the near ones."""


class SettingsError(RevolverError, ValueError):
    """A setting that cannot work, refused before anything is run."""


class PolicyFileError(RevolverError, ValueError):
    """A policy file that is torn, foreign, or does not fit the robot."""


class DemonstrationsError(RevolverError, ValueError):
    """Demonstrations that are torn, foreign, or do not fit the robot."""


class MissingExtraError(RevolverError, ImportError):
    """An optional or pinned dependency that is missing, or of another version."""
