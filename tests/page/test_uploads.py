"""Resumable uploads by the client tuspy. Killing the server during an upload loses no received piece."""

import hashlib
import json
import urllib.request

from tusclient.client import TusClient

from conftest import PROGRAM
from service import free_address, start


def test_an_upload_goes_on_after_the_server_was_killed(tmp_path, film):
    address = free_address()
    data = tmp_path / "data"
    service = start(PROGRAM, data, address)
    try:
        client = TusClient(f"{address}/v1/uploads")
        size = film.stat().st_size
        upload = client.uploader(str(film), chunk_size=size // 10 + 1, metadata={"filename": film.name})
        for _ in range(5):
            upload.upload_chunk()
        sent = upload.offset
        service.kill()
        service.wait()
        service = start(PROGRAM, data, address)
        rest = client.uploader(str(film), url=upload.url, chunk_size=size // 10 + 1)
        assert rest.offset == sent and 0 < sent < size
        rest.upload()
        [footage] = json.load(urllib.request.urlopen(f"{address}/v1/footage"))["items"]
        assert footage["sha256"] == hashlib.sha256(film.read_bytes()).hexdigest()
        assert footage["name"] == film.name
    finally:
        service.kill()
        service.wait()


def test_every_piece_may_have_a_checksum(empty_service, film):
    client = TusClient(f"{empty_service}/v1/uploads")
    client.uploader(str(film), chunk_size=10_000, upload_checksum=True).upload()
    [footage] = json.load(urllib.request.urlopen(f"{empty_service}/v1/footage"))["items"]
    assert footage["sha256"] == hashlib.sha256(film.read_bytes()).hexdigest()
