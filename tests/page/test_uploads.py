"""Resumable uploads by a client of others (tuspy): a server that is killed in the middle loses nothing."""

import hashlib
import json
import socket
import subprocess
import urllib.request

from tusclient.client import TusClient

from conftest import PROGRAM, wait_until_ready


def test_an_upload_goes_on_after_the_server_was_killed(tmp_path, film):
    address = free_address()
    data = tmp_path / "data"
    service = start(data, address)
    try:
        client = TusClient(f"{address}/v1/uploads")
        size = film.stat().st_size
        upload = client.uploader(str(film), chunk_size=size // 10 + 1, metadata={"filename": film.name})
        for _ in range(5):
            upload.upload_chunk()
        sent = upload.offset
        service.kill()
        service.wait()
        service = start(data, address)
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


def start(data, address):
    arguments = ["serve", "--bind", address.removeprefix("http://"), "--data", str(data), "--no-sample"]
    service = subprocess.Popen([PROGRAM, *arguments], stdin=subprocess.DEVNULL)
    wait_until_ready(service, address)
    return service


def free_address():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"http://127.0.0.1:{probe.getsockname()[1]}"
