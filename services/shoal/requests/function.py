"""The functions of `import shoal`: signature, documentation and checks from their requests."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping
from functools import update_wrapper
from types import UnionType
from typing import Any, ParamSpec, Protocol, TypeVar, Union, cast, get_args, get_origin

from shoal.requests.option import Option
from shoal.requests.request import Field, offered, read, renamed

P = ParamSpec("P")
Q = TypeVar("Q")
R = TypeVar("R")


class Shown:
    """A type as documentation shows it."""

    def __init__(self, text: str) -> None:
        self._text = text

    def __repr__(self) -> str:
        return self._text

    def __eq__(self, other: object) -> bool:
        return repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash(self._text)


class Function(Protocol[P, Q, R]):
    """A public function. request: what it is asked; answer: what computes from that."""

    __name__: str
    request: Any
    answer: Callable[[Q], R]

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Return the answer to a request that is stated field by field."""
        ...


def function(request: Callable[P, Q]) -> Callable[[Callable[[Q], R]], Function[P, Q, R]]:
    """Make the public function of a request from what answers it."""

    def made(compute: Callable[[Q], R]) -> Function[P, Q, R]:
        signature = _signature(request, compute)

        def public(*args: Any, **kwargs: Any) -> R:
            return compute(read(request, stated(public, args, kwargs)))

        # Not `wraps`: who inspects this would find the function of one argument beneath.
        update_wrapper(public, compute, ("__module__", "__name__", "__qualname__"), ())
        del public.__wrapped__  # type: ignore[attr-defined]
        public.__dict__.update(__signature__=signature, request=request, answer=compute)
        public.__annotations__ = {name: one.annotation for name, one in signature.parameters.items()}
        public.__doc__ = _documentation(request, compute)
        return cast("Function[P, Q, R]", public)

    return made


def stated(public: Any, args: tuple[Any, ...], kwargs: Mapping[str, Any], depth: int = 3) -> dict[str, Any]:
    """Return what is given to such a function, by the names of today. Raises TypeError, InputError."""

    def say(note: str) -> None:
        warnings.warn(f"{public.__name__}: {note}", FutureWarning, stacklevel=depth + 2)

    given = renamed(public.request, kwargs, say)
    return dict(public.__signature__.bind(*args, **given).arguments)


def _signature(request: Any, compute: Callable[..., Any]) -> inspect.Signature:
    parameters = [
        inspect.Parameter(
            one.name,
            inspect.Parameter.POSITIONAL_OR_KEYWORD if one.positional else inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if one.required else one.default,
            annotation=shown(one),
        )
        for one in offered(request, "python").values()
    ]
    answer = inspect.signature(compute).return_annotation
    return inspect.Signature(parameters, return_annotation=Shown(answer) if isinstance(answer, str) else answer)


def shown(field: Field) -> Any:
    """Return the type of a field as documentation shows it."""
    return Shown(field.option.shown or plain(field.type))


def plain(annotation: Any) -> str:
    """Return the text of a type without what else is stated of it."""
    if hasattr(annotation, "__metadata__"):
        return plain(get_args(annotation)[0])
    if isinstance(annotation, str):
        return repr(annotation)
    if isinstance(annotation, list):
        return f"[{', '.join(map(plain, annotation))}]"
    kind, parts = get_origin(annotation), [plain(part) for part in get_args(annotation)]
    if kind in (Union, UnionType):
        return " | ".join(parts)
    name = "None" if annotation is type(None) else getattr(annotation, "__name__", str(annotation))
    return f"{name}[{', '.join(parts)}]" if parts else name


def _documentation(request: Any, compute: Callable[..., Any]) -> str:
    """Return the text of a request, its fields, and what its function says of the answer."""
    fields = offered(request, "python").values()
    arguments = "\n".join(f"    {one.name}: {_sentence(one.option)}" for one in fields)
    answer = inspect.cleandoc(compute.__doc__ or "").partition("\n\n")[2]
    return f"{inspect.cleandoc(request.__doc__)}\n\nArgs:\n{arguments}\n\n{answer}\n"


def _sentence(option: Option) -> str:
    return option.help
