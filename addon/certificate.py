"""What was measured against what was promised: common to surfaces and clouds."""

from dataclasses import dataclass, field

STRETCH_SLACK = 1e-3  # what float32 coordinates cannot express


@dataclass
class Certificate:
    """What was measured, and which promises it breaks (none, as a rule)."""

    measured: dict
    violations: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    @property
    def holds(self):
        return not self.violations
