"""Extensions of schemathesis: upload pieces are sent as raw bytes, and every response status is recorded."""

import os
from pathlib import Path

import schemathesis


@schemathesis.serializer("application/offset+octet-stream")
def pieces(_context, value):
    return value if isinstance(value, bytes) else str(value).encode()


@schemathesis.hook
def after_call(_context, case, response):
    """Appends operation and status to the file CONTRACT_SEEN, from which `walk.tell` reads them."""
    with Path(os.environ["CONTRACT_SEEN"]).open("a") as seen:
        seen.write(f"{case.operation.label} {response.status_code}\n")
