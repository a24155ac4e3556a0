"""What a check-up found, for tests to compare."""

from __future__ import annotations

from app.domain.check_up import Level, Report, Topic
from app.domain.message import render
from app.services.check_up.session import CheckUpSession

Found = CheckUpSession | Report


def says(found: Found, topic: Topic) -> tuple[Level, str]:
    """The only finding of that topic."""
    [finding] = [finding for finding in found.findings if finding.topic is topic]
    return finding.level, render(finding.says)


def why_not_tried(report: Report) -> str:
    [finding] = [finding for finding in report.findings if finding.topic.is_tried]
    assert not report.is_complete
    assert (finding.topic, finding.level) == (Topic.ORDER, Level.AMBER)
    return render(finding.says)


def not_green(found: Found) -> dict[Topic, Level]:
    return {finding.topic: finding.level for finding in found.findings if finding.level is not Level.GREEN}


def in_words(found: Found) -> str:
    """All findings, for a test that fails."""
    return "\n".join(
        f"{finding.level} {finding.topic}: {render(finding.says)} - {render(finding.means)}"
        for finding in found.findings
    )
