"""UM-Bridge 1.0, the protocol of uncertainty tools: models at the root of the service.

See Seelinger et al., UM-Bridge: Uncertainty quantification and modeling bridge, JOSS 8(83), 2023. Clients post without
a content type and expect errors in the protocol's own form.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Depends, Request, Response
from fastapi.exceptions import RequestValidationError

from shoal.api.refusal import Refusal, of_validation
from shoal.api.routes import require_ready
from shoal.api.schemas import MODELS, ModelCall, ModelTask, Operation
from shoal.api.strict import StrictRoute

_ERRORS = {
    "not-found": "ModelNotFound",
    "unsupported": "UnsupportedFeature",
    "input": "InvalidInput",
    "malformed": "InvalidInput",
    "too-much": "InvalidInput",
}
"""The protocol's names of refusals, all with status 400."""


class BridgeRoute(StrictRoute):
    """A route whose refusals have the protocol's form."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """The handler that FastAPI calls."""
        inner = super().get_route_handler()

        async def handler(request: Request) -> Response:
            try:
                return await inner(request)
            except RequestValidationError as error:
                return _error(of_validation(error))
            except Refusal as refusal:
                return _error(refusal)

        return handler


def _error(refusal: Refusal) -> Response:
    kind = _ERRORS.get(refusal.kind, refusal.kind)
    status = 400 if refusal.kind in _ERRORS else refusal.status_code
    content = orjson.dumps({"error": {"type": kind, "message": refusal.text}})
    return Response(content, status, dict(refusal.headers or {}), "application/json")


_DOCUMENTED: dict[int | str, dict[str, Any]] = {
    status: {"description": "An error in the protocol's form"} for status in (400, 401, 408, 413, 429, 500, 503, 504)
}
router = APIRouter(route_class=BridgeRoute, tags=["UM-Bridge"], strict_content_type=False, responses=_DOCUMENTED)


@router.get("/Info")
async def info() -> dict[str, Any]:
    """The models there are."""
    return {"protocolVersion": 1.0, "models": list(MODELS)}


async def known(call: ModelCall) -> ModelCall:
    """The call, if its model exists. Raises Refusal."""
    if call.name not in MODELS:
        raise Refusal("not-found", f"no model {call.name!r}; there are {', '.join(MODELS)}")
    return call


Call = Annotated[ModelCall, Depends(known)]


@router.post("/ModelInfo")
async def model_info(call: Call) -> dict[str, Any]:
    """Return the capabilities of a model."""
    return {"support": {"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False}}


_COMPUTED: dict[Operation, str] = {
    "InputSizes": "How many parameters a model has.",
    "OutputSizes": "How many numbers a model gives.",
    "Evaluate": "The model at `input`.",
    "Gradient": "`sens` times the Jacobian of the model at `input`.",
    "ApplyJacobian": "The Jacobian of the model at `input` times `vec`.",
}


def _computed(operation: Operation) -> Callable[[ModelCall, Request], Coroutine[Any, Any, Response]]:
    """The endpoint of an operation, which a worker carries out."""

    async def endpoint(call: Call, request: Request) -> Response:
        pool, settings = request.app.state.calls, request.app.state.settings
        task = ModelTask(operation, call)
        answer = await pool.run("model", task, settings.wall_seconds, gone=request.is_disconnected)
        return Response(answer, media_type="application/json")

    return endpoint


for _operation, _text in _COMPUTED.items():
    router.add_api_route(
        f"/{_operation}",
        _computed(_operation),
        methods=["POST"],
        name=_operation,
        description=_text,
        dependencies=[Depends(require_ready)],
    )


@router.post("/ApplyHessian")
async def apply_hessian(call: Call) -> None:
    """Second derivatives, which no model has."""
    raise Refusal("unsupported", f"{call.name} has no second derivatives")
