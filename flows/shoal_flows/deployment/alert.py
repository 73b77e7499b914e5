"""Alerts of failed nights: an automation of Prefect's, set by $SHOAL_ALERT alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from shoal.errors import InputError

if TYPE_CHECKING:
    from uuid import UUID

NAME = "A night is not as it should be"
NIGHT = "nightly/night"
BLOCK = "shoal-alert"
STATES = ("Not to be trusted", "Failed", "TimedOut", "Crashed", "Late")
"""Of a night: its lines, the flow, its hour, its process; one that nobody ran is late."""
TITLE = "flow_run.name ~ ': ' ~ event.resource['prefect.state-name']"
TEXT = "event.resource['prefect.state-message'] ~ '\\n' ~ (flow_run|ui_url)"
"""Expressions of Prefect's templates: what is the matter, then every line that is wrong and the page of the run."""


@dataclass(frozen=True)
class Receiver:
    """url: of a web hook that takes {"text": ...}, or another service in the form of Apprise (mailtos://...)."""

    url: str

    @property
    def hooked(self) -> bool:
        """Return whether it is asked by POST, without Apprise."""
        return self.url.startswith(("http://", "https://"))


def whom(url: str) -> Receiver | None:
    """The receiver of that address; None if it is empty. Raises InputError."""
    if not (url := url.strip()):
        return None
    found = Receiver(url)
    if not found.hooked:
        from apprise import Apprise

        if not Apprise().add(url):
            scheme = url.partition(":")[0][:40]  # what follows may be a password
            raise InputError(f"SHOAL_ALERT: {scheme}:... is no address that can be told: https://... or mailtos://...")
    return found


def state(receiver: Receiver | None) -> None:
    """Make this receiver the only one of the server of PREFECT_API_URL."""
    from prefect.client.orchestration import get_client

    with get_client(sync_client=True) as client:
        stated = client.read_automations_by_name(NAME)
        for one in stated:
            client.delete_automation(one.id)
        if receiver is not None:
            client.create_automation(_automation(receiver, client.read_deployment_by_name(NIGHT).id))


def _automation(receiver: Receiver, night: UUID) -> Any:
    from prefect.automations import AutomationCore, CallWebhook, EventTrigger, Posture, SendNotification
    from prefect.blocks.notifications import SlackWebhook
    from prefect.blocks.webhook import Webhook

    action: CallWebhook | SendNotification
    if receiver.hooked:
        hook = Webhook(url=receiver.url, headers={"Content-Type": "application/json"})
        payload = f'{{"text": {{{{ ({TITLE} ~ "\\n" ~ {TEXT})|tojson }}}}}}'
        action = CallWebhook(block_document_id=hook.save(BLOCK, overwrite=True), payload=payload)
    else:
        # Prefect's blocks for mail need accounts elsewhere; this one gives Apprise every address that is not Slack's.
        block = SlackWebhook(url=receiver.url)
        saved = block.save(BLOCK, overwrite=True)
        action = SendNotification(block_document_id=saved, subject=f"{{{{ {TITLE} }}}}", body=f"{{{{ {TEXT} }}}}")
    return AutomationCore(
        name=NAME,
        description="Whoever $SHOAL_ALERT names is told.",
        trigger=EventTrigger(
            expect={f"prefect.flow-run.{name}" for name in STATES},
            match_related={"prefect.resource.id": f"prefect.deployment.{night}"},
            for_each={"prefect.resource.id"},
            posture=Posture.Reactive,
            threshold=1,
            within=0,
        ),
        actions=[action],
    )
