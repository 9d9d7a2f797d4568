"""A resumable upload by tus-js-client in node: the connection is cut inside a piece, the server is killed."""

import hashlib
import json
import os
import socket
import subprocess
import threading
import urllib.request
from pathlib import Path

from conftest import PROGRAM
from service import free_address, start

HERE = Path(__file__).parent
MODULES = HERE.parents[1] / "target/web"
# `make vendor` installs node from a wheel if the machine has none.
WITH_NODE = {**os.environ, "PATH": f"{os.environ['PATH']}:{MODULES.parent / 'node-venv/bin'}"}


def test_an_upload_by_tus_js_client_goes_on_where_it_was_cut(tmp_path, film):
    assert (MODULES / "node_modules/tus-js-client").is_dir(), "tus-js-client is missing: run `make vendor`"
    size = film.stat().st_size
    address = free_address()
    service = [start(PROGRAM, tmp_path / "data", address)]

    def kill_and_start_again():
        service[0].kill()
        service[0].wait()
        service[0] = start(PROGRAM, tmp_path / "data", address)

    wire = CutWire(address, size // 2, kill_and_start_again)
    try:
        command = ["node", HERE / "resume.mjs", MODULES, f"{wire.address}/v1/uploads", film]
        done = subprocess.run(command, env=WITH_NODE, check=True, capture_output=True, text=True, timeout=120)
        said = json.loads(done.stdout)
        assert wire.cuts == 1 and said["retries"] >= 1, said
        assert 0 < said["offsets"][-1] <= size // 2, said
        assert wire.carried_bytes < 1.1 * size, "the first half was sent again"
        [footage] = json.load(urllib.request.urlopen(f"{address}/v1/footage"))["items"]
        assert footage["sha256"] == hashlib.sha256(film.read_bytes()).hexdigest()
        assert footage["name"] == film.name
    finally:
        service[0].kill()
        service[0].wait()


class CutWire:
    """A proxy to the service that is cut once, after a number of bytes. Then it calls `then`."""

    def __init__(self, address, cut_after_bytes, then):
        self.to = ("127.0.0.1", int(address.rsplit(":", 1)[1]))
        self.cut_after_bytes, self.then = cut_after_bytes, then
        self.carried_bytes = self.cuts = 0
        listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{listener.getsockname()[1]}"
        threading.Thread(target=self.listen, args=(listener,), daemon=True).start()

    def listen(self, listener):
        while True:
            near, _ = listener.accept()
            threading.Thread(target=self.carry, args=(near,), daemon=True).start()

    def carry(self, near):
        try:
            with near, socket.create_connection(self.to) as far:
                self.carry_there(near, far)
        except OSError:
            pass  # either side hung up, or the service is not back yet

    def carry_there(self, near, far):
        back = threading.Thread(target=self.carry_back, args=(far, near), daemon=True)
        back.start()
        while piece := near.recv(16 << 10):
            room = self.cut_after_bytes - self.carried_bytes
            if self.cuts == 0 and len(piece) >= room:
                far.sendall(piece[:room])
                self.carried_bytes, self.cuts = self.cut_after_bytes, 1
                # Let the service read the received bytes before it is killed.
                far.shutdown(socket.SHUT_WR)
                back.join(timeout=30)
                self.then()
                return
            far.sendall(piece)
            self.carried_bytes += len(piece)

    @staticmethod
    def carry_back(far, near):
        try:
            while piece := far.recv(16 << 10):
                near.sendall(piece)
        except OSError:
            pass  # either side hung up
