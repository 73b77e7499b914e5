"""The only page of Dask's schedulers and workers: /health, for this machine's names.

Dask's own pages show calls, logs and figures of all computations to whoever asks. `settings.defaults` puts this module
in their place.
"""

from __future__ import annotations

from distributed.http.health import HealthHandler
from shoal.api.guard import RequestPolicy, allowed_hosts
from tornado.web import HTTPError

_POLICY = RequestPolicy(allowed_hosts())


class _Health(HealthHandler):  # type: ignore[misc]
    def prepare(self) -> None:
        """Refuse requests for other hosts and of other pages."""
        asked = self.request
        scope = {
            "type": "http",
            "scheme": asked.protocol,
            "method": asked.method,
            "headers": [(name.encode(), value.encode("latin-1", "replace")) for name, value in asked.headers.get_all()],
        }
        if (refusal := _POLICY.refusal(scope)) is not None:
            raise HTTPError(refusal.status_code, refusal.text)


routes: list[tuple[str, type[HealthHandler], dict[str, object]]] = [("/health", _Health, {})]
