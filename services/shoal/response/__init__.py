"""How a machine answers when its parameters are known as intervals or distributions only."""

from shoal.response.respond import respond, uncertain
from shoal.response.result import Response

__all__ = ["Response", "respond", "uncertain"]
