"""Response of machines whose parameters are known as intervals or distributions only."""

from shoal.response.respond import respond
from shoal.response.result import Response
from shoal.response.uncertain import uncertain

__all__ = ["Response", "respond", "uncertain"]
