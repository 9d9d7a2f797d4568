"""The pieces of an upload, for schemathesis: bytes as they are."""

import schemathesis


@schemathesis.serializer("application/offset+octet-stream")
def pieces(_context, value):
    return value if isinstance(value, bytes) else str(value).encode()
